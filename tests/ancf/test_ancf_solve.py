"""From scene to result: what is written down, failures by name, what is imported."""

import subprocess
import sys

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from ancf.linear_solver import LinearSolver
from ancf.newton import equilibrium
from ancf.outline import facets
from ancf.run import estimate, solve
from ancf.system import system
from ancf.unpack import build, held_of
from compare.result import load as load_result
from compare.result import save
from compare.scene import AncfLevel, load, parse

PLATE = {
    "name": "plate",
    "title": "a plate",
    "surface": {"kind": "rectangle", "length": 1.0, "width": 0.6},
    "thickness": 0.05,
    "grooves": [{"name": "g", "face": "bottom", "along": "x", "across": [0.2, 0.3], "depth": 0.03}],
    "material": {"kind": "svk", "youngs_modulus": 2.0e6, "density": 2000.0},
    "probes": [{"name": "P", "at": [1.0, 0.6, 0.0]}, {"name": "mean", "region": [[0.8, 1.0], [0.4, 0.6]]}],
    "analysis": {"kind": "dynamic", "until": 0.1, "every": 0.02},
    "ancf": {"levels": [{"mesh": [4, 3], "time_step": 0.01}]},
}
CLAMP = [{"kind": "clamp", "edge": "x0"}]
LEVEL = AncfLevel(element="conforming", mesh=(4, 3), points=(3, 3, 2), time_step=0.01)


def scene(**changes):
    return parse({**PLATE, **changes}, "test")


def falling(**changes):
    return scene(loads=[{"kind": "gravity", "acceleration": [0.0, 0.0, -9.81]}], **changes)


def test_free_fall_is_exact():
    """A free plate under gravity: z = -g t^2/2 and W = T = m (g t)^2 / 2, no strain; trapezoidal is exact."""
    result = solve(falling(), LEVEL)
    np.testing.assert_allclose(result.times, [0, 0.02, 0.04, 0.06, 0.08, 0.1])
    drop = -9.81 * result.times**2 / 2
    np.testing.assert_allclose(result.displacement[:, :, 2], np.stack([drop, drop], axis=1), atol=1e-9)
    kinetic = 0.5 * 2000 * (0.6 * 0.05 - 0.1 * 0.03) * (9.81 * result.times) ** 2
    np.testing.assert_allclose(result.energies["kinetic"], kinetic, rtol=1e-7)
    np.testing.assert_allclose(result.energies["external"], kinetic, rtol=1e-7)
    np.testing.assert_allclose(result.energies["strain"], 0, atol=1e-9)


def test_rigid_start_turns_about_the_origin():
    """After a short time every point has moved by its rigid velocity: error of order (spin t)^2."""
    t, spin, velocity = 1e-3, np.array([0.5, -1.0, 2.0]), np.array([1.0, 2.0, -1.0])
    moving = {"velocity": velocity.tolist(), "angular_velocity": spin.tolist()}
    case = scene(
        initial=moving,
        grooves=[],
        analysis={"kind": "dynamic", "until": t, "every": t},
        ancf={"levels": [{"mesh": [4, 3], "time_step": t}]},
    )
    result = solve(case, LEVEL.model_copy(update={"time_step": t}))
    expected = t * (velocity + np.cross(spin, [1.0, 0.6, 0.0]))
    np.testing.assert_allclose(result.displacement[-1, 0], expected, atol=5e-6)


def test_result_tells_what_was_solved(tmp_path):
    seen = []
    result = solve(falling(supports=CLAMP), LEVEL, seen.append)
    assert result.status == "ok" and result.solver == "ancf"
    assert result.unknowns == 12 * 20 - 9 * 4
    assert result.steps == 10 and result.newton_iterations >= 10
    assert seen == sorted(seen) and seen[-1] == 1.0
    assert result.facts["volume"] == pytest.approx(0.027) and result.facts["mass"] == pytest.approx(54.0)
    np.testing.assert_allclose(result.probe_position, [[1, 0.6, 0], [0.9, 0.5, 0]], atol=1e-12)
    assert result.displacement.shape == (6, 2, 3)
    assert result.h == pytest.approx(0.25)
    save(result, tmp_path / "r.npz")
    again = load_result(tmp_path / "r.npz")
    np.testing.assert_array_equal(again.displacement, result.displacement)
    assert again.facts == result.facts


def test_outline_closes_around_the_kept_material():
    """Divergence theorem over the triangles: the volume of box minus groove; the tip point moves like its probe."""
    result = solve(falling(supports=CLAMP), LEVEL)
    drawn = result.outline
    a, b, c = (drawn.points[drawn.triangles[:, k]] for k in range(3))
    assert np.einsum("na,na->", a, np.cross(b, c)) / 6 == pytest.approx(0.027, rel=1e-9)
    tips = np.abs(drawn.points - [1.0, 0.6, 0.025]).max(axis=1) < 1e-12
    assert tips.any()
    ends = drawn.displacement[tips] - result.displacement[-1, 0]
    assert np.abs(ends).max() < 0.025
    steps = np.abs(np.diff(drawn.points[drawn.edges], axis=1)[:, 0])
    assert np.all(np.isin(np.round(drawn.points[drawn.edges[steps[:, 0] > 1e-9][:, 0], 1], 9), [0.0, 0.2, 0.4, 0.6]))


@pytest.mark.parametrize("changes", [{"grooves": []}, {}], ids=["plain", "grooved"])
def test_patches_share_corners_inside_an_element_alone(changes):
    """Each place of an element's faces once; on element lines each element has its own, and a groove's edge is two."""
    case = falling(**changes)
    model = build(case, LEVEL)
    drawn = facets(model.mesh, model.bands, case.thickness)
    corners = list(zip(drawn.elements.tolist(), map(tuple, drawn.points.tolist()), strict=True))
    assert len(set(corners)) == len(corners) > len({point for _, point in corners})
    assert set(drawn.triangles.ravel().tolist()) == set(range(len(corners)))
    floor = [] if "grooves" in changes else [0.005]
    assert np.unique(drawn.points[:, 2]) == pytest.approx([-0.025, *floor, 0.025])
    edge = {point[2] for _, point in corners if abs(point[1] - 0.3) < 1e-9 and point[2] < 0.02}
    assert len(edge) == 2 * len(floor)


@pytest.mark.parametrize("name", ["cylinder_panel", "rounded_groove", "cantilever_patch"])
def test_shipped_scenes_run_and_balance(name):
    """Every other shipped scene at its coarsest level; the loads' work is the energy within the path's error."""
    case = load(name)
    result = solve(case, case.ladder("ancf")[0])
    assert result.status == "ok"
    stored = result.energies["strain"][-1] + result.energies["kinetic"][-1]
    assert result.energies["external"][-1] == pytest.approx(stored, rel=0.03)


FAILURES = {"newton_diverged", "inverted_element", "not_finite", "singular_tangent"}


def test_static_failure_is_named():
    """An edge load of a million times the plate's strength has no equilibrium on a path of load steps."""
    crush = [{"kind": "edge", "edge": "x1", "force": [-1e12, 0, 3e11]}]
    case = scene(supports=CLAMP, loads=crush, analysis={"kind": "static", "until": 1.0, "every": 1.0})
    result = solve(case, LEVEL.model_copy(update={"time_step": 1.0}))
    assert result.status in FAILURES
    assert result.message.startswith(result.status)
    assert np.all(np.isfinite(result.displacement))


ENRICHED = LEVEL.model_copy(update={"element": "enriched", "points": (4, 4, 3)})
STATIC = {"kind": "static", "until": 1.0, "every": 1.0}
PINS = ["X", "Y", "Z"]
PIN = {"kind": "hold", "corner": "x0y0", "components": PINS}
DOWN = [{"kind": "edge", "edge": "x1", "force": [0.0, 0.0, -5.0], "history": [[0.0, 0.0], [1.0, 1.0]]}]
FLOOR = {
    "name": "floor",
    "face": "bottom",
    "shape": {"kind": "plane", "point": [0.0, 0.0, -0.025], "normal": [0.0, 0.0, 1.0]},
    "stiffness": 1e5,
}
IN_PLANE = {"kind": "hold", "corner": "x1y0", "components": ["Y"], "over": "middle"}


@pytest.mark.parametrize("follow", ["load", "arc-length"])
@pytest.mark.parametrize(
    "supports, free",
    [
        ([PIN], "1 rigid motion is free"),
        ([{"kind": "hold", "edge": "x0", "components": PINS, "over": "middle"}], "1 rigid motion is free"),
        ([{"kind": "symmetry", "edge": "x0", "normal": "X"}], "3 rigid motions are free"),
        ([PIN, IN_PLANE], ""),
    ],
    ids=["the face at a corner", "a hinge", "symmetry", "a corner and a point"],
)
def test_statics_of_a_plate_that_is_not_held_is_named(supports, free, follow):
    """Round-off let some of these tangents through: what a corner's drilling turned by changed with the load steps."""
    case = scene(supports=supports, loads=DOWN, grooves=[], analysis={**STATIC, "follow": follow})
    result = solve(case, LEVEL.model_copy(update={"time_step": 0.5}))
    assert result.status == ("singular_tangent" if free else "ok")
    assert free in result.message and len(result.times) == (0 if free else len(result.displacement))


def test_an_obstacle_may_stop_what_supports_leave_free():
    """A plate on a floor, held in its plane, goes in by its weight; by 6e-4 more of that as it is squeezed."""
    case = scene(
        supports=[PIN | {"components": ["X", "Y"]}, IN_PLANE],
        loads=[{"kind": "gravity", "acceleration": [0.0, 0.0, -9.81]}],
        grooves=[],
        obstacles=[FLOOR],
        analysis=STATIC,
    )
    result = solve(case, LEVEL.model_copy(update={"time_step": 1.0}))
    assert result.status == "ok"
    np.testing.assert_allclose(result.displacement[-1, :, 2], -9.81 * 2000 * 0.05 / 1e5, rtol=1e-3)


def test_layers_that_loads_cannot_choose_are_a_named_failure():
    case = scene(supports=[PIN], loads=DOWN, analysis=STATIC)
    level = ENRICHED.model_copy(update={"enrich": 0.9})
    result = solve(case, level)
    assert result.status == "singular_tangent" and "layers" in result.message and "1 rigid motion" in result.message
    assert estimate(case, level)["unknowns"] == estimate(case, level.model_copy(update={"enrich": None}))["unknowns"]


@pytest.mark.parametrize(
    "changes",
    [
        {"analysis": STATIC},
        {"analysis": STATIC, "obstacles": [FLOOR]},
        {"analysis": {**STATIC, "follow": "arc-length"}},
        {},
    ],
    ids=["statics", "contact", "path", "dynamics"],
)
@pytest.mark.parametrize("enrich", [None, 0.9])
def test_a_plate_that_is_held_everywhere_stays(changes, enrich):
    whole = [{"kind": "hold", "whole": True, "components": PINS}]
    case = scene(supports=whole, loads=DOWN, **changes)
    result = solve(case, ENRICHED.model_copy(update={"time_step": 0.1, "enrich": enrich}))
    assert (result.status, result.unknowns) == ("ok", 0)
    assert len(result.times) > 1 and not result.displacement.any()


ROOT = 0.5**0.5
ARC = [[0.0, -ROOT, ROOT], [0.0, 0.0, 2 * ROOT], [0.0, ROOT, ROOT]]
CYLINDER = {
    "kind": "nurbs",
    "degree": [1, 2],
    "knots": [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1]],
    "control_points": [ARC, [[1.0, y, z] for _, y, z in ARC]],
    "weights": [[1, ROOT, 1]] * 2,
}
POLE = {
    "kind": "nurbs",
    "degree": [1, 1],
    "knots": [[0, 0, 1, 1]] * 2,
    "control_points": [[[0, 0, 0], [0, 0, 0]], [[1, 0, 0], [1, 1, 0]]],
}
RIDGE = {
    "kind": "nurbs",
    "degree": [1, 1],
    "knots": [[0, 0, 0.5, 1, 1], [0, 0, 1, 1]],
    "control_points": [[[x, y, 0.5 - abs(x - 0.5)] for y in (0.0, 1.0)] for x in (0.0, 0.5, 1.0)],
}


@pytest.mark.parametrize(
    ("surface", "thickness", "reason"),
    [(CYLINDER, 4.0, "folds"), (POLE, 0.05, "no normal"), (RIDGE, 0.05, "crease at x = 0.5")],
)
def test_shape_that_cannot_be_modelled_is_named(surface, thickness, reason):
    """A cylinder of radius 1 m that is 4 m thick, a triangle, of which a side has no length, and a ridge."""
    probes = [{"name": "P", "at": [0.5, 0.5, 0.0]}]
    result = solve(scene(surface=surface, thickness=thickness, grooves=[], probes=probes), LEVEL)
    assert result.status == "geometry_failed" and reason in result.message
    assert result.displacement.shape == (0, 1, 3) and result.unknowns == 0


@pytest.mark.parametrize("thickness", [5e-4, 2e-4])
def test_thin_plate_on_a_coarse_mesh_converges(thickness):
    """A plate 2,000 and 5,000 times as long as thick, pulled 0.04 mm down: Newton must know its own round-off."""
    down = [{"kind": "edge", "edge": "x1", "force": [0, 0, -16 * thickness**3], "history": [[0, 0], [1, 1]]}]
    analysis = {"kind": "static", "until": 1.0, "every": 1.0}
    case = scene(thickness=thickness, grooves=[], supports=CLAMP, loads=down, analysis=analysis)
    result = solve(case, LEVEL.model_copy(update={"mesh": (4, 2), "time_step": 1.0}))
    assert result.status == "ok" and result.newton_iterations < 20


def test_a_thin_shell_far_from_the_origin_converges():
    """Its positions, 300 from the origin, round the shear strain of elements of 15 by more than r_z does.

    An eighth of a pinched cylinder, t / R = 1/10,000, of which the ends keep their shape.
    """
    root = 0.5**0.5
    arc = [[300.0, 0.0], [300.0, 300.0], [0.0, 300.0]]
    surface = {
        "kind": "nurbs",
        "degree": [1, 2],
        "knots": [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1]],
        "control_points": [[[x, y, z] for x, z in arc] for y in (0.0, 300.0)],
        "weights": [[1.0, root, 1.0]] * 2,
    }
    case = scene(
        surface=surface,
        thickness=0.03,
        grooves=[],
        material={"kind": "svk", "youngs_modulus": 3.0e6, "poissons_ratio": 0.3},
        supports=[
            *({"kind": "symmetry", "edge": edge, "normal": n} for edge, n in (("x0", "Y"), ("y0", "Z"), ("y1", "X"))),
            {"kind": "hold", "edge": "x1", "components": ["X", "Z"]},
        ],
        loads=[{"kind": "point", "at": [0.0, 1.0], "force": [0.0, 0.0, -1e-3], "history": [[0.0, 0.0], [1.0, 1.0]]}],
        probes=[{"name": "P", "at": [0.0, 1.0, 0.0]}],
        analysis={"kind": "static", "until": 1.0, "every": 1.0},
    )
    result = solve(case, AncfLevel(element="enriched", mesh=(20, 20), points=(4, 4, 3), time_step=1.0))
    assert result.status == "ok" and result.displacement[-1, 0, 2] < 0


def test_blas_has_one_thread_during_a_solve_alone():
    def threads():
        """Of NumPy's and SciPy's; MKL, which another test may have loaded, is the reference's."""
        return {library["num_threads"] for library in threadpool_info() if library["internal_api"] == "openblas"}

    with threadpool_limits(2, user_api="blas"):
        before, during = threads(), []
        solve(falling(), LEVEL, progress=lambda fraction: during.append(threads()))
        assert all(inside == {1} for inside in during) and during
        assert threads() == before == {2}


def test_constant_load_bends_a_static_plate_from_the_start():
    """Statics under gravity that acts at once: brought up inside the first output, the same at every later one."""
    case = scene(
        supports=CLAMP,
        loads=[{"kind": "gravity", "acceleration": [0.0, 0.0, -1.0]}],
        analysis={"kind": "static", "until": 1.0, "every": 0.5},
        ancf={"levels": [{"mesh": [4, 3], "time_step": 0.25}]},
    )
    result = solve(case, LEVEL.model_copy(update={"time_step": 0.25}))
    assert result.status == "ok"
    assert result.displacement[0, 0, 2] < -0.1
    np.testing.assert_allclose(result.displacement[1:], result.displacement[:-1], atol=1e-9)


def test_dynamic_failure_is_named_and_keeps_what_was_reached():
    """A force of 1e12 N that starts at 0.05 s tears the plate: the history ends before it."""
    history = [[0.0, 0.0], [0.05, 0.0], [0.051, 1.0]]
    pull = [{"kind": "point", "at": [1.0, 0.6], "force": [1e12, 0, 1e12], "history": history}]
    result = solve(scene(supports=CLAMP, loads=pull, analysis={"kind": "dynamic", "until": 0.1, "every": 0.01}), LEVEL)
    assert result.status in FAILURES
    assert 0.03 < result.times[-1] < 0.06
    assert len(result.times) == len(result.displacement) == len(result.energies["strain"])


@pytest.mark.parametrize("element, coordinates", [("conforming", 48), ("acm", 48), ("enriched", 72)])
def test_estimate_matches_the_solve(element, coordinates):
    case, level = falling(supports=CLAMP), LEVEL.model_copy(update={"element": element, "points": (4, 4, 3)})
    told, result = estimate(case, level), solve(case, level)
    assert result.status == "ok" and result.level["element"] == element
    assert told["unknowns"] == result.unknowns
    assert f"{element} plate elements ({coordinates} coordinates)" in told["modelled"][0]
    assert told["elements"] == 12
    assert told["memory_mb"] > 0
    assert any("groove g" in line for line in told["modelled"])
    assert any("protrusions" in line for line in told["left_out"])


def test_bending_is_stiffer_with_poissons_ratio_as_explain_says():
    """A strip in plane strain: stiffness lambda + 2 mu, not E / (1 - nu^2), for r is linear in z.

    All y components and all r_y are held. Shear adds 3e-4 of the deflection, the mesh the same part to both.
    """
    nu, rise = 0.3, {}
    down = [{"kind": "edge", "edge": "x1", "force": [0, 0, -1e-3], "history": [[0, 0], [1, 1]]}]
    analysis = {"kind": "static", "until": 1.0, "every": 1.0}
    for ratio in (0.0, nu):
        material = {**PLATE["material"], "poissons_ratio": ratio}
        case = scene(grooves=[], supports=CLAMP, loads=down, analysis=analysis, material=material)
        model = build(case, LEVEL.model_copy(update={"mesh": (16, 1)}))
        held = held_of(case, model.mesh).reshape(-1, 3)
        held[:, 1] = held[model.mesh.kinds == "r_y"] = True
        strip = system(model.body, held.ravel(), model.system.loads, case.thickness)
        start = model.mesh.vectors.ravel()
        path = equilibrium(strip, LinearSolver(strip.assembly.pattern), start, 0.0, 1.0, 1.0)
        rise[ratio] = (model.probes @ (path.q - start).reshape(-1, 3))[0, 2]
    plate_theory = 1 - nu**2
    factor = (1 - nu) ** 2 / (1 - 2 * nu)
    assert rise[0.0] / rise[nu] * plate_theory == pytest.approx(factor, rel=2e-3)
    told = estimate(case, LEVEL)["left_out"]
    assert any(f"{factor:.3g} times too stiff" in line for line in told)
    assert not any("too stiff" in line for line in estimate(scene(), LEVEL)["left_out"])


def test_package_needs_numpy_and_scipy_only():
    """Everything but run.py, in a fresh interpreter: nothing else of weight is loaded."""
    code = (
        "import sys, ancf, ancf.system, ancf.integrate, ancf.outline, ancf.supports, ancf.functional;"
        "heavy = {'pydantic', 'numba', 'gmsh', 'vtk', 'pyvista', 'matplotlib', 'skfem', 'pypardiso', 'compare'};"
        "sys.exit(str(heavy & set(sys.modules)) if heavy & set(sys.modules) else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
