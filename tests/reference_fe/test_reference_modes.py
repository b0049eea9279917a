"""Natural vibrations of solids: dense eigenvalues, rigid motions, beams, scaling and named failures."""

import numpy as np
import pytest
import scipy.linalg
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import ArpackNoConvergence

from compare.exact import beam_frequency
from compare.result import load, save
from compare.scene import ReferenceLevel, parse
from reference_fe import modes
from reference_fe.geometry import Band, Plate
from reference_fe.linear_solver import direct_solver
from reference_fe.modes import ModesFailure, rigid_motions, vibration
from reference_fe.run import solve

LENGTH, WIDTH, THICKNESS = 1.0, 0.1, 0.02
E, RHO = 2.0e6, 2000.0


def found(system, points, count=4, shift=1.0):
    where = system.pattern
    return vibration(system, direct_solver(where.indptr, where.indices), points, count, shift)


def dense(system):
    """Stiffness and mass (3 f, 3 f)."""
    where, size = system.pattern, 3 * system.pattern.free.size
    pair = []
    for values in (system.tangent(np.zeros((where.free.size, 3))), system.mass_values):
        upper = csr_matrix((values, where.indices, where.indptr), shape=(size, size)).toarray()
        pair.append(upper + np.triu(upper, 1).T)
    return pair


@pytest.mark.parametrize("curved", [False, True])
def test_a_free_solid_has_six_rigid_motions_and_no_other_mode_without_energy(build, curved):
    """Dense eigenvalues: six are round-off, all others positive and those that Lanczos finds."""
    solid = build.curved(0.4) if curved else build.solid(build.grooved, 0.5)
    system = build.system(solid)
    points = solid.mesh.doflocs.T
    expected = scipy.linalg.eigh(*dense(system), eigvals_only=True)
    vibrating = found(system, points, 6)
    assert np.abs(expected[:6]).max() < 1e-8 * expected[6]
    assert vibrating.rigid == 6
    np.testing.assert_allclose((2 * np.pi * vibrating.frequencies) ** 2, expected[6:12], rtol=1e-8)


def test_rigid_motions_have_unit_mass_and_no_energy(build):
    solid = build.solid(build.grooved, 0.5)
    system = build.system(solid)
    K, M = dense(system)
    rigid = rigid_motions(system, solid.mesh.doflocs.T)
    np.testing.assert_allclose(rigid @ M @ rigid.T, np.eye(6), atol=1e-10)
    assert (
        np.abs(rigid @ K @ rigid.T).max() < 1e-8 * (2 * np.pi * found(system, solid.mesh.doflocs.T).frequencies[0]) ** 2
    )


def strip(build, grooves=(), size=0.05, **more):
    solid = build.solid(Plate(LENGTH, WIDTH, THICKNESS, grooves=grooves), size)
    points = solid.mesh.doflocs.T
    return build.system(solid, np.abs(points[:, 0]) < 1e-9, young=E, density=RHO, **{"poisson": 0.0, **more}), points


def test_a_strip_sounds_like_a_beam(build):
    """Shear and rotary inertia lower the first mode, out of the plane, by 2e-4, and the second, in the plane of a
    strip ten times as long as wide, by 1 %; the mesh raises the first by 2e-3."""
    vibrating = found(*strip(build))
    assert vibrating.rigid == 0
    expected = [beam_frequency(1, LENGTH, size, E, RHO) for size in (THICKNESS, WIDTH)]
    np.testing.assert_allclose(vibrating.frequencies[0], expected[0], rtol=3e-3)
    np.testing.assert_allclose(vibrating.frequencies[1], expected[1], rtol=2e-2)


def test_frequencies_scale_with_the_speed_of_sound(build):
    solid = build.solid(build.grooved, 0.5)
    points = solid.mesh.doflocs.T
    held = np.abs(points[:, 0]) < 1e-9
    plain = found(build.system(solid, held), points).frequencies
    np.testing.assert_allclose(found(build.system(solid, held, young=9e6), points).frequencies, 3 * plain, rtol=1e-8)
    np.testing.assert_allclose(found(build.system(solid, held, density=4e3), points).frequencies, plain / 2, rtol=1e-8)


def test_a_groove_along_the_strip_changes_the_section_of_the_beam(build):
    """Uniform beam: f / f_plain = sqrt(I A_plain / (I_plain A)) = 0.8225; the two meshes err by up to 3e-3."""
    width, depth = 0.08, 0.006
    areas, own = np.array([WIDTH * THICKNESS, -width * depth]), np.array([WIDTH * THICKNESS**3, -width * depth**3]) / 12
    centres = np.array([0.0, -(THICKNESS - depth) / 2])
    moment = own.sum() + areas @ (centres - areas @ centres / areas.sum()) ** 2
    band = Band(-1, 0, (0.01, 0.09), (0.0, LENGTH), depth)
    grooved, plain = (found(*strip(build, bands)).frequencies[0] for bands in ((band,), ()))
    np.testing.assert_allclose(grooved / plain, np.sqrt(moment / areas.sum() * 12 / THICKNESS**2), rtol=4e-3)


def test_refinement_lowers_the_frequencies(build):
    """Every mesh is too stiff, and a mesh of half the size far less so."""
    coarse, fine = (found(*strip(build, size=size, poisson=0.3)).frequencies for size in (0.1, 0.05))
    assert (coarse > fine).all()


def test_failures_have_names(build, monkeypatch):
    system, points = strip(build, size=0.1)
    size = 3 * system.pattern.free.size

    def status(shift=1.0, count=3, solid=system):
        with pytest.raises(ModesFailure) as failed:
            found(solid, points, count, shift)
        return failed.value.status

    assert status(count=size) == "too_few_unknowns"
    free = build.system(build.solid(Plate(LENGTH, WIDTH, THICKNESS), 0.1))
    assert status(shift=0.0, solid=free) == "singular_tangent"
    monkeypatch.setattr(type(system), "tangent", lambda self, u, mass=0.0: -self.mass_values)
    assert status() == "stiffness_not_positive"
    monkeypatch.undo()

    def never(*arguments, **more):
        raise ArpackNoConvergence("no convergence", np.empty(0), np.empty((0, 0)))

    monkeypatch.setattr(modes, "eigsh", never)
    assert status() == "modes_not_converged"


PLATE = {
    "name": "plate",
    "title": "a plate",
    "surface": {"kind": "rectangle", "length": 1.0, "width": 0.8},
    "thickness": 0.1,
    "material": {"kind": "svk", "youngs_modulus": E, "poissons_ratio": 0.3, "density": RHO},
    "analysis": {"kind": "modes", "count": 3},
    "reference": {"levels": [{"size": 0.5}]},
}


def test_a_scene_of_modes_is_solved_and_kept(tmp_path):
    result = solve(parse(PLATE, "plate"), ReferenceLevel(size=0.5))
    assert (result.status, result.facts["rigid_modes"], len(result.times)) == ("ok", 6, 0)
    assert (np.diff(result.frequencies) > 0).all() and result.frequencies.shape == (3,)
    np.testing.assert_allclose(np.linalg.norm(result.outline.modes, axis=2).max(axis=1), 1, rtol=1e-12)
    save(result, tmp_path / "r.npz")
    np.testing.assert_array_equal(load(tmp_path / "r.npz").frequencies, result.frequencies)


def test_a_failed_scene_has_no_frequencies():
    result = solve(parse({**PLATE, "analysis": {"kind": "modes", "count": 100_000}}, "plate"), ReferenceLevel(size=0.5))
    assert result.status == "too_few_unknowns" and len(result.frequencies) == 0 and result.outline.modes is None
