"""The von Mises stress on the surface that a scene may ask for: closed forms of bars and beams, each solver alone."""

import importlib

import numpy as np
import pytest

from compare.result import load, save
from compare.scene import Scene, SceneError
from compare.scene import load as load_scene

SOLVERS = {"ancf": "ancf.run", "reference": "reference_fe.run"}
LENGTH, WIDTH, THICKNESS, YOUNG = 1.0, 0.2, 0.05, 2e9
TOML = """
schema_version = 1
name = "bar"
title = "A bar"
thickness = 0.05
surface_stress = true

[surface]
kind = "rectangle"
length = 1.0
width = 0.2

[material]
kind = "svk"
youngs_modulus = 2e9
poissons_ratio = NU

[[supports]]
kind = "clamp"
edge = "x0"
gradients = "tangential"

[[loads]]
LOAD
history = [[0, 0], [1, 1]]

[[probes]]
name = "P"
at = [1.0, 0.1, 0.0]

[analysis]
kind = "static"

[ancf]
time_step = 1.0
points = [4, 4, 3]
levels = [{ mesh = [16, 4], budget = "quick" }]

[reference]
time_step = 1.0
levels = [{ size = 0.06, budget = "quick" }]
"""
PULL = 'kind = "edge"\nedge = "x1"\nforce = [200.0, 0.0, 0.0]'
BEND = 'kind = "moment"\nedge = "x1"\nmoment = [0.0, 0.5, 0.0]'


def scene(folder, acting, nu=0.0, **changes):
    path = folder / "bar.toml"
    path.write_text(TOML.replace("NU", str(nu)).replace("LOAD", acting))
    return load_scene(path).override(changes)


def solved(asked: Scene, solver):
    result = importlib.import_module(SOLVERS[solver]).solve(asked, getattr(asked, solver).levels[0])
    assert result.status == "ok"
    return result


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_a_bar_in_tension_carries_force_over_area(tmp_path, solver, nu):
    """Half a length from the clamp, where its hold of the section is forgotten; strains of 1e-5 are linear."""
    outline = solved(scene(tmp_path, PULL, nu), solver).outline
    middle = np.abs(outline.points[:, 0] - 0.5) < 0.2
    assert middle.sum() > 20
    np.testing.assert_allclose(outline.stress[middle], 200.0 / (WIDTH * THICKNESS), rtol=2e-3)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_a_beam_in_bending_carries_m_c_over_i(tmp_path, solver, nu):
    """M c / I on both faces, 6 M / (b h^2); in the middle of the width of a strip with nu > 0 it is a few percent off,
    as a plate's free edges are another stress than its middle, so the mean over the width is what is M c / I."""
    outline = solved(scene(tmp_path, BEND, nu), solver).outline
    middle = (np.abs(outline.points[:, 0] - 0.5) < 0.15) & (np.abs(np.abs(outline.points[:, 2]) - THICKNESS / 2) < 1e-9)
    exact = 6 * 0.5 / (WIDTH * THICKNESS**2)
    assert middle.sum() > 20
    np.testing.assert_allclose(outline.stress[middle], exact, rtol=0.005 if nu == 0 else 0.06)
    assert outline.stress[middle].mean() == pytest.approx(exact, rel=0.005 if nu == 0 else 0.02)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_turned_bar_has_no_stress(solver):
    """A rigid rotation by half a radian, applied to the undeformed nodes of each solver."""
    turn = np.array([[np.cos(0.5), 0.0, np.sin(0.5)], [0.0, 1.0, 0.0], [-np.sin(0.5), 0.0, np.cos(0.5)]])
    asked = load_scene("rounded_groove").override({"surface_stress": True})
    level = getattr(asked, solver).levels[0]
    if solver == "ancf":
        from ancf.outline import facets
        from ancf.stress import von_mises
        from ancf.unpack import build, material_of

        model = build(asked, level)
        surface = facets(model.mesh, model.bands, asked.thickness)
        stress = von_mises(model.mesh, surface, model.mesh.vectors @ turn.T, material_of(asked))
    else:
        from reference_fe.mesh import make
        from reference_fe.stress import von_mises
        from reference_fe.unpack import material_of, mid_surface, plate_of, spacing_of

        plate = plate_of(asked, *mid_surface(asked))
        solid = make(plate, spacing_of(plate, level.size))
        points = solid.mesh.doflocs.T
        stress = von_mises(solid, points @ turn.T - points, material_of(asked))
    assert stress.max() < 1e-9 * asked.material.youngs_modulus


def test_a_plate_stretched_alike_both_ways_has_stress_over_stretch_until_no_thickness_is_left():
    """S = E e / (1 - nu), e = (s^2 - 1) / 2, over the stretch of the thickness, sqrt(1 - 4 nu e / (1 - nu));
    beyond e = 0.306, where it has none for nu = 0.45, over a tenth."""
    from ancf.outline import facets
    from ancf.stress import von_mises
    from ancf.unpack import build, material_of

    nu, asked = 0.45, load_scene("cantilever").override({"material.poissons_ratio": 0.45})
    model = build(asked, asked.ancf.levels[0])
    surface = facets(model.mesh, model.bands, asked.thickness)
    for s in (1.05, 1.2, 1.27, 1.5):
        e = (s**2 - 1) / 2
        left = np.sqrt(max(1 - 4 * nu / (1 - nu) * e, 0.01))
        stress = von_mises(model.mesh, surface, model.mesh.vectors * [s, s, 1], material_of(asked))
        np.testing.assert_allclose(stress, asked.material.youngs_modulus * e / (1 - nu) / left, rtol=1e-9)


def test_it_is_told_only_where_it_is_asked_for(tmp_path):
    quiet = solved(scene(tmp_path, PULL, surface_stress=False), "ancf")
    assert quiet.outline.stress is None
    told = solved(scene(tmp_path, PULL), "ancf")
    save(told, tmp_path / "told.npz")
    assert np.array_equal(load(tmp_path / "told.npz").outline.stress, told.outline.stress)


@pytest.mark.parametrize(("name", "reason"), [("plate_modes", "a mode has no size"), ("falling_tire", "'svk' only")])
def test_a_scene_that_has_none_may_not_ask_for_it(name, reason):
    with pytest.raises(SceneError, match=reason):
        load_scene(name).override({"surface_stress": True})
