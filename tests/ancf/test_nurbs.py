"""NURBS against closed forms: conics are exact, so 1e-12 leaves only round-off."""

import numpy as np
import pytest

from ancf.nurbs import Curve, Surface, crease, curve_derivatives, invert, surface_derivatives, unit_normal

EXACT = 1e-12
W = np.sqrt(0.5)
QUARTER = [0, 0, 0, 1, 1, 1]
LINE = [0, 0, 1, 1]
U = np.linspace(0, 1, 41)
RANDOM = np.random.default_rng(1).uniform(0, 1, (200, 2))


def arc(radius=1.0, centre=(0.0, 0.0)):
    """Quarter circle from angle 0 to 90 degrees."""
    points = np.array([(1, 0), (1, 1), (0, 1)]) * radius + centre
    return Curve(2, QUARTER, points, [1, W, 1])


def wall(radius=0.03, edge=0.2):
    """Quarter-circle wall of a groove: vertical at (edge, 0), level at (edge + radius, radius)."""
    return Curve(2, QUARTER, [(edge, 0), (edge, radius), (edge + radius, radius)], [1, W, 1])


def semicircle(radius=0.03, edge=0.2):
    """Half a circle as the section of a groove: vertical at both edges."""
    r, points = radius, [(0, 0), (0, 1), (1, 1), (2, 1), (2, 0)]
    return Curve(2, [0, 0, 0, 1, 1, 2, 2, 2], np.array(points) * r + (edge, 0), [1, W, 1, W, 1])


def revolved(generator, weights):
    """Quarter turn about Z of a curve (X, Z) that starts in the plane Y = 0."""
    x, z = np.array(generator, dtype=float).T
    points = np.stack([np.stack([x, 0 * x, z], -1), np.stack([x, x, z], -1), np.stack([0 * x, x, z], -1)])
    weights = np.outer([1, W, 1], weights)
    knots = QUARTER, (LINE if len(x) == 2 else QUARTER)
    return Surface((2, len(x) - 1), knots, points, weights)


SURFACES = {
    "annulus": revolved([(0.5, 0), (2, 0)], [1, 1]),
    "cylinder": revolved([(2, 0), (2, 3)], [1, 1]),
    "cone": revolved([(2, 0), (1, 3)], [1, 1]),
    "sphere": revolved([(2, 0), (2, 2), (0, 2)], [1, W, 1]),
    "torus": revolved([(3, -1), (4, -1), (4, 0)], [1, W, 1]),
}

# no symmetry, so that no term of a derivative drops out
UNEVEN = Surface(
    (2, 1),
    (QUARTER, LINE),
    [[(0, 0, 0), (0, 1, 0.2)], [(1, 0, 0.5), (1.2, 1, 0)], [(2, 0.1, 0), (2, 1.3, 1)]],
    [[1, 2], [1.5, 1], [0.7, 1.2]],
)


def closed_form_normal(name, s):
    """Outward unit normal at the points s, from the surface's equation in closed form."""
    x, y, z = s.T
    rho = np.hypot(x, y)
    radial, axial = {
        "annulus": (0 * rho, 1 + 0 * rho),
        "cylinder": (1 + 0 * rho, 0 * rho),
        "cone": (3 + 0 * rho, 1 + 0 * rho),
        "sphere": (rho, z),
        "torus": (rho - 3, z),
    }[name]
    length = np.hypot(radial, axial)
    return np.stack([radial * x / rho, radial * y / rho, axial], -1) / length[:, None]


def implicit(name, s):
    """Zero on the surface."""
    x, y, z = s.T
    rho = np.hypot(x, y)
    return {
        "annulus": z,
        "cylinder": rho - 2,
        "cone": rho - 2 + z / 3,
        "sphere": np.hypot(rho, z) - 2,
        "torus": np.hypot(rho - 3, z) - 1,
    }[name]


def test_arc_is_an_exact_circle():
    c, c_u, c_uu = curve_derivatives(arc(2.0, (0.3, -0.1)), U)
    d = c - (0.3, -0.1)
    assert np.abs(np.hypot(*d.T) - 2).max() < EXACT
    assert np.abs(np.sum(d * c_u, axis=-1)).max() < EXACT  # the tangent is perpendicular to the radius
    assert np.abs(np.sum(d * c_uu, axis=-1) + np.sum(c_u * c_u, axis=-1)).max() < EXACT  # and so at second order


def test_arc_against_its_rational_form():
    """Bernstein polynomials with the weights (1, sqrt(1/2), 1), by hand."""
    w = (1 - U) ** 2 + 2 * W * U * (1 - U) + U**2
    x = ((1 - U) ** 2 + 2 * W * U * (1 - U)) / w
    assert np.abs(curve_derivatives(arc(), U)[0][:, 0] - x).max() < EXACT


def test_curvature_of_an_arc():
    _, c_u, c_uu = curve_derivatives(arc(2.0), U)
    cross = c_u[:, 0] * c_uu[:, 1] - c_u[:, 1] * c_uu[:, 0]
    assert np.abs(cross / np.linalg.norm(c_u, axis=-1) ** 3 - 0.5).max() < EXACT


def test_curve_derivatives_equal_differences():
    """Central differences of step 1e-5 of a cubic with uneven weights: truncation stays below 1e-8."""
    points = [(0, 0, 1), (1, 2, 0), (3, -1, 1), (4, 0, 0), (5, 2, 2)]
    curve, step = Curve(3, [0, 0, 0, 0, 0.4, 1, 1, 1, 1], points, [1, 2, 0.5, 1, 3]), 1e-5
    u = np.array([0.1, 0.2, 0.3, 0.5, 0.7, 0.9])
    _, c_u, c_uu = curve_derivatives(curve, u)
    plus, minus = curve_derivatives(curve, u + step), curve_derivatives(curve, u - step)
    assert np.abs((plus[0] - minus[0]) / (2 * step) - c_u).max() < 1e-7
    assert np.abs((plus[1] - minus[1]) / (2 * step) - c_uu).max() < 1e-6


def test_straight_line_has_no_second_derivative():
    c, c_u, c_uu = curve_derivatives(Curve(1, LINE, [(0, 1), (2, 5)]), U)
    assert np.abs(c - np.stack([2 * U, 1 + 4 * U], -1)).max() < EXACT
    assert np.abs(c_u - [2, 4]).max() < EXACT and np.abs(c_uu).max() == 0


def test_values_at_inner_knots_and_both_ends():
    c, _, _ = curve_derivatives(semicircle(0.5, 0.0), [0.0, 1.0, 2.0])
    assert np.abs(c - [(0, 0), (0.5, 0.5), (1, 0)]).max() < EXACT


@pytest.mark.parametrize("name", SURFACES)
def test_surface_lies_on_its_closed_form(name):
    values = surface_derivatives(SURFACES[name], *RANDOM.T)
    assert np.abs(implicit(name, values.s)).max() < EXACT


@pytest.mark.parametrize("name", SURFACES)
def test_normal_equals_its_closed_form(name):
    values = surface_derivatives(SURFACES[name], *RANDOM.T)
    n = unit_normal(values).n
    sign = np.sign(np.sum(n[0] * closed_form_normal(name, values.s)[0]))
    assert (
        np.abs(sign * n - closed_form_normal(name, values.s)).max() < 10 * EXACT
    )  # near the sphere's pole s_u is small


@pytest.mark.parametrize("name", SURFACES)
def test_curvatures_equal_their_closed_form(name):
    """The normal curvatures -n_u . s_u etc. solve det(II - k I) = 0 for the two known principal curvatures."""
    uv = 0.05 + 0.9 * RANDOM
    values = surface_derivatives(SURFACES[name], *uv.T)
    normal = unit_normal(values)

    def dot(a, b):
        return np.sum(a * b, axis=-1)

    first = np.stack([dot(values.s_u, values.s_u), dot(values.s_u, values.s_v), dot(values.s_v, values.s_v)])
    second = -np.stack([dot(normal.n_u, values.s_u), dot(normal.n_u, values.s_v), dot(normal.n_v, values.s_v)])
    area = first[0] * first[2] - first[1] ** 2
    gauss = (second[0] * second[2] - second[1] ** 2) / area
    mean = (first[0] * second[2] + first[2] * second[0] - 2 * first[1] * second[1]) / (2 * area)
    rho = np.hypot(values.s[:, 0], values.s[:, 1])
    cone = 3 / np.sqrt(10) / rho
    k1, k2 = {
        "annulus": (0, 0),
        "cylinder": (0.5, 0),
        "cone": (cone, 0),
        "sphere": (0.5, 0.5),
        "torus": (1, (rho - 3) / rho),
    }[name]
    assert np.abs(gauss - k1 * k2).max() < 1e3 * EXACT  # second derivatives are divided by small s_u near the pole
    assert np.abs(np.abs(mean) - np.abs(k1 + k2) / 2).max() < 1e3 * EXACT


@pytest.mark.parametrize("surface", [*SURFACES.values(), UNEVEN], ids=[*SURFACES, "uneven"])
def test_derivatives_equal_differences(surface):
    """Central differences of step 1e-5: truncation and round-off both stay below 1e-8 here."""
    (u, v), step = (0.1 + 0.8 * RANDOM).T, 1e-5
    values = surface_derivatives(surface, u, v)
    plus_u, minus_u = surface_derivatives(surface, u + step, v), surface_derivatives(surface, u - step, v)
    plus_v, minus_v = surface_derivatives(surface, u, v + step), surface_derivatives(surface, u, v - step)
    pairs = [("s", "s_u", "s_v"), ("s_u", "s_uu", "s_uv"), ("s_v", "s_uv", "s_vv")]
    for of, by_u, by_v in pairs:
        difference_u = (getattr(plus_u, of) - getattr(minus_u, of)) / (2 * step)
        difference_v = (getattr(plus_v, of) - getattr(minus_v, of)) / (2 * step)
        assert np.abs(difference_u - getattr(values, by_u)).max() < 1e-7
        assert np.abs(difference_v - getattr(values, by_v)).max() < 1e-7
    n_u = (unit_normal(plus_u).n - unit_normal(minus_u).n) / (2 * step)
    n_v = (unit_normal(plus_v).n - unit_normal(minus_v).n) / (2 * step)
    normal = unit_normal(values)
    assert np.abs(n_u - normal.n_u).max() < 1e-7 and np.abs(n_v - normal.n_v).max() < 1e-7


def test_degenerate_surface_is_refused():
    values = surface_derivatives(SURFACES["sphere"], 0.5, 1.0)  # the pole: all u meet in one point
    with pytest.raises(ValueError, match="no normal"):
        unit_normal(values)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("knot", "weight", "found"), [(0.5, 1.0, None), (0.3, 1.0, 0.3), (0.5, 1.2, 0.5)])
def test_a_crease_is_where_the_tangent_jumps(axis, knot, weight, found):
    """Two arcs of 45 degrees make one smooth half of a cap, unless their parameters run at different speeds."""
    half = np.pi / 8
    angles, radii = np.arange(5) * half, np.array([1, 1 / np.cos(half)] * 2 + [1])
    arcs = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    net = np.array([[[*(scale * xy), scale] for scale in (1.0, 1.5, 3.0)] for xy in arcs])
    weights = np.outer([1, np.cos(half), 1, weight * np.cos(half), 1], [1.0, 2.0, 0.5])
    knots = ([0, 0, 0, knot, knot, 1, 1, 1], [0, 0, 0, 1, 1, 1])
    if axis == 1:
        net, weights, knots = net.swapaxes(0, 1), weights.T, knots[::-1]
    surface = Surface((2, 2), knots, net, weights)
    assert crease(surface, axis) == found and crease(surface, 1 - axis) is None
    at = [(knot + step, 0.4)[:: 1 - 2 * axis] for step in (-1e-9, 1e-9)]
    before, after = (surface_derivatives(surface, *uv)[1 + axis] for uv in at)
    assert np.allclose(before, after, atol=1e-6) == (found is None)


def test_inversion_of_a_wall_equals_the_circle():
    """Depth at a distance y from the vertical edge of a quarter circle: sqrt(2 R y - y^2)."""
    y = np.concatenate([np.linspace(0, 0.03, 50), np.logspace(-12, -2, 40)])
    c = curve_derivatives(wall(edge=0.0), invert(wall(edge=0.0), y))[0]
    assert np.abs(c[:, 0] - y).max() < EXACT * 0.03
    assert np.abs(c[:, 1] - np.sqrt(2 * 0.03 * y - y**2)).max() < 1e-10  # square root of round-off in y near the edge


def test_inversion_undoes_evaluation():
    u = np.linspace(0, 2, 301)
    y = curve_derivatives(semicircle(), u)[0][:, 0]
    assert np.abs(invert(semicircle(), y) - u).max() < 1e-7  # the slope vanishes at both ends: square root of round-off
    assert np.abs(curve_derivatives(semicircle(), invert(semicircle(), y))[0][:, 0] - y).max() < 1e-15


def test_inversion_beyond_the_ends_returns_the_ends():
    assert np.allclose(invert(wall(), [-1.0, 0.2, 0.23, 9.0]), [0, 0, 1, 1], atol=1e-7)


def test_inversion_across_a_step():
    """A vertical wall inside a profile: both sides are found, the wall itself returns one of its points."""
    step = Curve(1, [0, 0, 1, 2, 3, 3], [(0, 0), (1, 0), (1, 2), (3, 2)])
    u = invert(step, [0.5, 0.999999, 1.0, 1.000001, 2.0])
    assert np.abs(u[[0, 1, 3, 4]] - [0.5, 0.999999, 2.0000005, 2.5]).max() < EXACT
    assert 1 <= u[2] <= 2


def test_inversion_where_newton_alone_would_be_thrown_far_off():
    """y(u) = (1 - (1 - u)^19 + u^19) / 2 leaves 1/2 only near the ends: in the middle its slope is 7e-5."""
    y = [0.0, *[0.5] * 18, 1.0]
    curve = Curve(19, [0] * 20 + [1] * 20, np.column_stack([y, y]))
    values = np.array([0.01, 0.1, 0.4, 0.6, 0.9, 0.99])
    power = np.abs(1 - 2 * values) ** (1 / 19)
    exact = np.where(values < 0.5, 1 - power, power)  # the other end's power is below round-off
    assert np.abs(invert(curve, values) - exact).max() < 1e-10


def test_inversion_keeps_the_shape():
    values = np.linspace(0.2, 0.26, 12).reshape(3, 4)
    assert np.array_equal(invert(semicircle(), values).ravel(), invert(semicircle(), values.ravel()))
    assert invert(semicircle(), 0.21).shape == ()


@pytest.mark.parametrize(
    "change",
    [{"knots": [0, 0, 1, 1, 1]}, {"knots": [0, 0, 0, 1, 0, 1]}, {"weights": [1, 1]}, {"control_points": [1, 2, 3]}],
)
def test_wrong_shapes_are_refused(change):
    right = {"degree": 2, "knots": QUARTER, "control_points": [(1, 0), (1, 1), (0, 1)], "weights": [1, W, 1]}
    with pytest.raises(ValueError):
        Curve(**{**right, **change})
