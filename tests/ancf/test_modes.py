"""Natural vibrations of plates: dense eigenvalues, rigid motions, beams, scaling, bounds and named failures."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg as spl

from ancf import modes
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.modes import highest, lowest, rigid_motions
from ancf.run import solve
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, Band
from ancf.supports import clamp
from ancf.system import body, system
from compare.exact import beam_frequency
from compare.result import load, save
from compare.scene import parse

E, RHO = 2.0e6, 2000.0
LENGTH, WIDTH, THICKNESS = 1.0, 0.1, 0.02  # of the strip


def matrices(plate):
    """Stiffness and mass of the undeformed plate, dense."""
    pattern = plate.assembly.pattern
    stiffness = plate.tangent(plate.body.mesh.vectors.ravel())
    return tuple(pattern.full(values).toarray() for values in (stiffness, plate.mass_values))


def free(plate):
    return system(plate, np.zeros(3 * len(plate.mesh.vectors), dtype=bool), (), 0.05)


def clamped(plate, edge="x0"):
    return system(plate, clamp(plate.mesh, edge, "tangential"), (), 0.05)


def strip(element, bands=(), elements=(10, 1), lines=None, nu=0.0, young=E, density=RHO):
    """A slender cantilever along x."""
    x = np.linspace(0, LENGTH, elements[0] + 1) if lines is None else lines
    mesh = grid(x, np.linspace(0, WIDTH, elements[1] + 1), None, FAMILY[element])
    points = (7, 7, 3)
    return clamped(body(mesh, bands, THICKNESS, from_engineering(young, nu), density, points))


def hertz(found):
    assert found.status == "ok"
    return np.sqrt(found.eigenvalues) / (2 * np.pi)


def test_a_free_plate_has_six_rigid_motions_and_no_other_mode_without_energy(plate):
    """Plain, grooved and curved: six eigenvalues are round-off (1e-10 of the first elastic one), all others positive;
    Lanczos finds the elastic ones to 1e-9, which is its tolerance and the round-off of the dense eigenvalues."""
    found = lowest(free(plate), 6, 10.0)
    expected = scipy.linalg.eigh(*matrices(free(plate)), eigvals_only=True)
    assert np.abs(expected[:6]).max() < 1e-9 * expected[6]
    assert (found.status, found.rigid) == ("ok", 6)
    np.testing.assert_allclose(found.eigenvalues, expected[6:12], rtol=1e-8)


def test_shapes_are_modes_of_unit_mass_without_momentum(plate):
    free_plate = free(plate)
    found, (K, M) = lowest(free_plate, 4, 10.0), matrices(free_plate)
    shapes = found.shapes[:, free_plate.assembly.free]
    np.testing.assert_allclose(shapes @ M @ shapes.T, np.eye(4), atol=1e-9)
    np.testing.assert_allclose(shapes @ K @ shapes.T, np.diag(found.eigenvalues), atol=1e-6 * found.eigenvalues[-1])
    rigid = rigid_motions(free_plate, M)
    np.testing.assert_allclose(rigid @ M @ shapes.T, 0, atol=1e-9)
    np.testing.assert_allclose(rigid @ M @ rigid.T, np.eye(6), atol=1e-9)
    assert np.abs(rigid @ K @ rigid.T).max() < 1e-9 * found.eigenvalues[0]


def test_only_the_motions_that_supports_allow_are_rigid(make_body):
    """Held in Z at three corners a plate slides and turns in its plane; clamped it has no rigid motion."""
    plate = make_body()
    position = plate.mesh.kinds == "r"
    corners = np.flatnonzero(position & np.isin(plate.mesh.parameters, [0.0, 0.6, 1.2]).all(axis=1))[:3]
    held = np.zeros((len(plate.mesh.vectors), 3), dtype=bool)
    held[corners, 2] = True
    assert lowest(system(plate, held.ravel(), (), 0.05), 3, 10.0).rigid == 3
    assert lowest(clamped(plate), 3, 10.0).rigid == 0


PIN = {"kind": "hold", "components": ["X", "Y", "Z"]}
TURNED = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def panel(size):
    """An arched panel with a straight edge y0, turned and moved in space."""
    arch = ((-0.4, 0.0), (0.0, 0.2), (0.4, 0.0))
    points = [[size * (TURNED @ [x, y, z] + [0.1, -0.3, 0.2]) for y, z in arch] for x in (0, 0.5, 1.1)]
    knots = [[0, 0, 0, 1, 1, 1]] * 2
    return {"kind": "nurbs", "degree": [2, 2], "knots": knots, "control_points": np.array(points).tolist()}


@pytest.mark.parametrize("size", [1.0, 1e-4])
@pytest.mark.parametrize(
    "turned, supports, count",
    [
        (False, [{**PIN, "corner": corner, "over": "middle"} for corner in ("x0y0", "x1y1")], 1),
        (False, [{**PIN, "corner": "x0y0"}], 1),
        (True, [{**PIN, "edge": "y0", "over": "middle"}], 1),
        (True, [{"kind": "clamp", "edge": "y0"}], 0),
    ],
    ids=["two corners", "the face at a corner", "a hinge", "a clamp"],
)
def test_a_plate_may_turn_about_an_oblique_axis(turned, supports, count, size):
    """What turns about such an axis is a combination of motions that each move what is held."""
    flat = {"kind": "rectangle", "length": 1.3 * size, "width": 0.7 * size}
    changes = {"supports": supports, "grooves": [], "thickness": 0.05 * size}
    scene = parse({**PLATE, **changes, "surface": panel(size) if turned else flat}, "plate")
    result = solve(scene, scene.ancf.levels[0])
    assert (result.status, result.facts["rigid_modes"]) == ("ok", count)
    assert result.frequencies[0] * size > 0.05


def test_a_strip_sounds_like_a_beam(element):
    """Shear and rotary inertia of a strip 50 times as long as thick lower the first mode by 2e-4; ten elements
    of the paper's plate, whose curvature is constant, raise it by 1/(4 n^2) at most."""
    found = hertz(lowest(strip(element), 1, 0.0))
    exact = beam_frequency(1, LENGTH, THICKNESS, E, RHO)
    np.testing.assert_allclose(found[0], exact, rtol=5e-4 if element == "enriched" else 5e-3)


def test_frequencies_scale_with_the_speed_of_sound(element):
    plain = hertz(lowest(strip(element, nu=0.3), 4, 0.0))
    np.testing.assert_allclose(hertz(lowest(strip(element, nu=0.3, young=9 * E), 4, 0.0)), 3 * plain, rtol=1e-9)
    np.testing.assert_allclose(hertz(lowest(strip(element, nu=0.3, density=4 * RHO), 4, 0.0)), plain / 2, rtol=1e-9)


def section(width, depth):
    """Area and second moment of the strip's section with a groove of this width and depth on one face."""
    areas = np.array([WIDTH * THICKNESS, -width * depth])
    centres = np.array([0.0, -(THICKNESS - depth) / 2])
    own = np.array([WIDTH * THICKNESS**3, -width * depth**3]) / 12
    centre = areas @ centres / areas.sum()
    return areas.sum(), own.sum() + areas @ (centres - centre) ** 2


def test_a_groove_along_the_strip_changes_the_section_of_the_beam(element):
    """Uniform beam: f / f_plain = sqrt(I A_plain / (I_plain A)) = 0.8225; ten elements err by 4e-4 (paper's), shear
    and rotary inertia count 2e-4 in either plate."""
    width, depth = 0.08, 0.006
    band = Band(BOTTOM, GROOVE, 0, (0.01, 0.09), depth)
    grooved, plain = (hertz(lowest(strip(element, bands, (10, 5)), 1, 0.0))[0] for bands in ((band,), ()))
    area, moment = section(width, depth)
    expected = np.sqrt(moment / area * 12 / THICKNESS**2)
    np.testing.assert_allclose(grooved / plain, expected, rtol=1e-3)


ACROSS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])


def across(depth):
    """A groove across the whole strip, x in [0.2, 0.4]."""
    return (Band(BOTTOM, GROOVE, 1, (0.2, 0.4), depth),)


def test_a_shallow_groove_lowers_the_frequency_as_rayleigh_says(element):
    """First order in the depth, 1 % of the thickness: d(omega^2)/omega^2 = -3 (d/t) part of the strain energy there
    + (d/t) part of the kinetic energy there, both of the plain beam's mode; the second order is 1 % of that."""
    depth = 0.01 * THICKNESS
    grooved, plain = (lowest(strip(element, bands), 1, 0.0).eigenvalues[0] for bands in (across(depth), ()))
    b = 1.8751040687119611
    x = (np.arange(100_000) + 0.5) / 100_000
    sigma = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    shape = np.cosh(b * x) - np.cos(b * x) - sigma * (np.sinh(b * x) - np.sin(b * x))
    curvature = np.cosh(b * x) + np.cos(b * x) - sigma * (np.sinh(b * x) + np.sin(b * x))
    there = (x > 0.2) & (x < 0.4)
    strain, kinetic = ((field[there] ** 2).sum() / (field**2).sum() for field in (curvature, shape))
    expected = (-3 * strain + kinetic) * depth / THICKNESS
    np.testing.assert_allclose(grooved / plain - 1, expected, rtol=0.02)


@pytest.mark.parametrize("depth", [0.002, 0.012])
def test_the_plain_mode_bounds_the_grooved_frequency_from_above(element, depth):
    """Rayleigh's quotient of any shape is no lower than the lowest eigenvalue."""
    plain, grooved = strip(element), strip(element, across(depth))
    shape = lowest(plain, 1, 0.0).shapes[0][plain.assembly.free]
    K, M = matrices(grooved)
    quotient = (shape @ K @ shape) / (shape @ M @ shape)
    found = lowest(grooved, 1, 0.0).eigenvalues[0]
    assert found < quotient
    assert found < lowest(plain, 1, 0.0).eigenvalues[0]


def test_the_papers_element_locks_most_in_a_bowl():
    """Bent alike both ways, w = k (x^2 + y^2) / 2, its fields are exact but for the thickness strain, so its energy is
    (1 - nu) / ((1 + nu) (1 - 2 nu)) times the plate's E t^3 k^2 A / (12 (1 - nu)): 1.346 times at nu = 0.3."""
    nu, t = 0.3, 0.05
    mesh = grid(np.linspace(0, 1, 3), np.linspace(0, 0.8, 3), None, FAMILY["conforming"])
    plate = system(
        body(mesh, (), t, from_engineering(E, nu), RHO, (7, 7, 3)), np.zeros(3 * len(mesh.vectors), bool), (), t
    )
    x, y = mesh.parameters.T
    nothing = 0 * x
    fields = {
        "r": (nothing, nothing, (x**2 + y**2) / 2),
        "r_x": (nothing, nothing, x),
        "r_y": (nothing, nothing, y),
        "r_z": (-x, -y, nothing),
    }
    bowl = np.array([np.stack(fields[kind], axis=1)[v] for v, kind in enumerate(mesh.kinds)]).ravel()
    energy = bowl @ matrices(plate)[0] @ bowl / 2
    theory = E * t**3 / (12 * (1 - nu)) * 0.8
    np.testing.assert_allclose(energy / theory, (1 - nu) / ((1 + nu) * (1 - 2 * nu)), rtol=1e-9)


def test_refinement_lowers_the_frequencies_of_the_papers_element():
    """A displacement-based element with exact integration is too stiff: what a finer mesh finds is lower."""

    def square(n):
        mesh = grid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), None, FAMILY["conforming"])
        return lowest(clamped(body(mesh, (), 0.05, from_engineering(E, 0.3), RHO, (7, 7, 3))), 4, 0.0).eigenvalues

    coarse, middle, fine = (square(n) for n in (2, 4, 8))
    assert (coarse > middle).all() and (middle > fine).all()


def test_the_highest_eigenvalue_is_the_dense_one(plate):
    expected = scipy.linalg.eigh(*matrices(clamped(plate)), eigvals_only=True)[-1]
    np.testing.assert_allclose(highest(clamped(plate)), expected, rtol=1e-5)


def test_both_of_a_pair_of_equal_frequencies_are_found(element):
    """A free square plate's fourth and fifth elastic modes are mirror images."""
    mesh = grid(np.linspace(0, 1, 7), np.linspace(0, 1, 7), None, FAMILY[element])
    found = lowest(free(body(mesh, (), 0.05, from_engineering(E, 0.3), RHO, (7, 7, 3))), 4, 3.0).eigenvalues
    five = lowest(free(body(mesh, (), 0.05, from_engineering(E, 0.3), RHO, (7, 7, 3))), 5, 3.0).eigenvalues
    np.testing.assert_allclose(five[:4], found, rtol=1e-9)
    np.testing.assert_allclose(five[4], five[3], rtol=1e-8)


def test_failures_have_names(make_body, monkeypatch):
    plate = make_body()
    assert lowest(clamped(plate), clamped(plate).unknowns, 0.0).status == "too_few_unknowns"
    assert lowest(free(plate), 3, 0.0).status == "singular_tangent"
    weightless = replace(plate, mass=0 * plate.mass)
    assert lowest(clamped(weightless), 3, 0.0).status == "mass_not_positive"
    soft = clamped(plate)
    monkeypatch.setattr(type(soft), "tangent", lambda self, q: -self.mass_values)
    assert lowest(soft, 3, 0.0).status == "stiffness_not_positive"
    monkeypatch.undo()

    def never(*arguments, **more):
        raise spl.ArpackNoConvergence("no convergence", np.empty(0), np.empty((0, 0)))

    monkeypatch.setattr(modes.spl, "eigsh", never)
    found = lowest(clamped(plate), 3, 0.0)
    assert found.status == "modes_not_converged" and len(found.eigenvalues) == 0


PLATE = {
    "name": "plate",
    "title": "a plate",
    "surface": {"kind": "rectangle", "length": 1.0, "width": 0.8},
    "thickness": 0.05,
    "material": {"kind": "svk", "youngs_modulus": E, "poissons_ratio": 0.3, "density": RHO},
    "grooves": [{"name": "g", "face": "bottom", "along": "x", "across": [0.3, 0.5], "depth": 0.02}],
    "analysis": {"kind": "modes", "count": 3},
    "ancf": {"levels": [{"mesh": [3, 3], "element": "enriched"}]},
}


def test_a_scene_of_modes_is_solved_and_kept(tmp_path):
    scene = parse(PLATE, "plate")
    result = solve(scene, scene.ancf.levels[0])
    assert (result.status, result.facts["rigid_modes"], len(result.times)) == ("ok", 6, 0)
    assert (np.diff(result.frequencies) > 0).all() and result.frequencies.shape == (3,)
    largest = np.linalg.norm(result.outline.modes, axis=2).max(axis=1)
    np.testing.assert_allclose(largest, 1, rtol=1e-12)
    save(result, tmp_path / "r.npz")
    kept = load(tmp_path / "r.npz")
    np.testing.assert_array_equal(kept.frequencies, result.frequencies)
    np.testing.assert_array_equal(kept.outline.modes, result.outline.modes)


def test_too_few_points_for_the_mass_are_a_named_failure():
    """3x3x2 points see 9 values of the 12 functions of one element's mid-surface."""
    scene = parse(
        {**PLATE, "ancf": {"levels": [{"mesh": [1, 1], "points": [3, 3, 2], "element": "conforming"}]}, "grooves": []},
        "plate",
    )
    result = solve(scene, scene.ancf.levels[0])
    assert result.status == "mass_not_positive" and "points" in result.message
    assert len(result.frequencies) == 0 and result.outline.modes is None
