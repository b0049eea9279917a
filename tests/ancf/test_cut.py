"""Elements that outlines cut anywhere: closed forms, cuts nudged through degenerate places, kept + removed = whole.

Lengths in m. Closed forms are met to 1e-10 of the removed amount (the requirement); most are at round-off.
"""

from dataclasses import replace

import numpy as np
import pytest

from ancf.arcs import crossings, divide
from ancf.nurbs import Curve, Surface, curve_derivatives
from ancf.outlined import Outlined
from ancf.recombination import fewer
from ancf.subdomain import (
    BOTTOM,
    GROOVE,
    PROTRUSION,
    TOP,
    Band,
    element_rule,
    face_rule,
    signature,
    thickness_range,
)

T = 0.05
UNIT = ((0.0, 1.0), (0.0, 1.0))
W = np.sqrt(0.5)
EXACT = 1e-10
ROUND_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
ROUND_WEIGHTS = [1, W, 1, W, 1, W, 1, W, 1]


def turned(points, centre, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points, dtype=float) @ np.array([[c, s], [-s, c]]) + centre


def ellipse(centre, a, b, angle=0.0):
    square = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    return Curve(2, ROUND_KNOTS, turned(np.array(square) * (a, b), centre, angle), ROUND_WEIGHTS)


def polygon(*points):
    n = len(points)
    return Curve(1, [0, *range(n + 1), n], [*points, points[0]])


def rectangle(x, y):
    return polygon((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))


def groove(outline, depth=0.03, face=BOTTOM, sign=GROOVE):
    return Outlined(face, sign, outline, depth)


def cells(n, m=None):
    x, y = np.linspace(0, 1, n + 1), np.linspace(0, 1, (m or n) + 1)
    return [((x[i], x[i + 1]), (y[j], y[j + 1])) for i in range(n) for j in range(len(y) - 1)]


def removed(function, bands, n=1, points=(4, 4, 2)):
    """What the bands remove of the integral of function(x, y, z), or of several, over the plate on an n x n mesh."""
    return sum(
        _integral(element_rule(cell, [], T, points), function)
        - _integral(element_rule(cell, bands, T, points), function)
        for cell in cells(n)
    )


def _integral(rule, function):
    assert np.all(rule.weights > 0)
    return rule.weights @ np.transpose(function(*rule.points.T))


def moments(*keys):
    return lambda *at: np.array([MOMENTS[key](*at) for key in keys])


MOMENTS = {
    "volume": lambda x, y, z: np.ones_like(x),
    "x": lambda x, y, z: x,
    "y": lambda x, y, z: y,
    "z": lambda x, y, z: z,
    "xx": lambda x, y, z: x * x,
    "yy": lambda x, y, z: y * y,
    "xy": lambda x, y, z: x * y,
    "zz": lambda x, y, z: z * z,
}


def elliptic(centre, a, b, angle, depth=0.03):
    """Moments of an elliptic cylinder cut into the bottom face."""
    (cx, cy), area = centre, np.pi * a * b
    c, s = np.cos(angle), np.sin(angle)
    uu, vv = a * a / 4, b * b / 4
    z0, z1 = -T / 2, -T / 2 + depth
    planar = {
        "volume": 1.0,
        "x": cx,
        "y": cy,
        "xx": cx**2 + c * c * uu + s * s * vv,
        "yy": cy**2 + s * s * uu + c * c * vv,
        "xy": cx * cy + c * s * (uu - vv),
    }
    through = {"z": (z1**2 - z0**2) / 2, "zz": (z1**3 - z0**3) / 3}
    return {key: area * depth * value for key, value in planar.items()} | {
        key: area * value for key, value in through.items()
    }


ELLIPSES = {
    "circular dimple": ((0.5, 0.45), 0.3, 0.3, 0.0),
    "elliptic pocket": ((0.5, 0.45), 0.3, 0.2, 0.0),
    "turned": ((0.5, 0.45), 0.3, 0.2, 0.3),
    "slender, turned": ((0.5, 0.5), 0.45, 0.02, 1.1),
    "small": ((0.31, 0.72), 0.01, 0.01, 0.2),
}


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("name", ELLIPSES)
def test_an_ellipse_has_its_closed_form(name, n):
    shape = ELLIPSES[name]
    exact = elliptic(*shape)
    for key, found in zip(MOMENTS, removed(moments(*MOMENTS), [groove(ellipse(*shape))], n), strict=True):
        assert abs(found - exact[key]) < EXACT * max(abs(exact[key]), 1e-3 * exact["volume"]), key


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 1.5])
def test_a_slanted_band_has_its_closed_form(angle, n):
    """A rectangle turned about the middle of the plate, wholly on it."""
    a, b, centre = 0.35, 0.06, (0.5, 0.48)
    corners = [(-a, -b), (a, -b), (a, b), (-a, b)]
    c, s = np.cos(angle), np.sin(angle)
    area, uu, vv = 4 * a * b, a * a / 3, b * b / 3
    exact = {
        "volume": 1.0,
        "x": centre[0],
        "y": centre[1],
        "xx": centre[0] ** 2 + c * c * uu + s * s * vv,
        "xy": centre[0] * centre[1] + c * s * (uu - vv),
    }
    bands = [groove(polygon(*map(tuple, turned(corners, centre, angle))))]
    found = removed(moments(*exact), bands, n)
    assert np.abs(found - area * 0.03 * np.array(list(exact.values()))).max() < EXACT * area * 0.03


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_a_band_that_leaves_the_plate_is_cut_off(angle):
    """A strip of half width b through the middle of the square, longer than it: area by the slanted sides."""
    b = 0.06
    ends = turned([(-2, -b), (2, -b), (2, b), (-2, b)], (0.5, 0.5), angle)
    found = removed(MOMENTS["volume"], [groove(polygon(*map(tuple, ends)))], 3)
    assert abs(found - 0.03 * 2 * b / np.cos(angle)) < 1e-15


@pytest.mark.parametrize("n", [2, 3, 4])
def test_four_points_are_exact_between_straight_lines(n):
    """Degree 7 in x and in y, degree 3 in z: what four points in a whole element promise, in any cut one too."""
    triangle = [(0.13, 0.21), (0.9, 0.35), (0.42, 0.83)]
    bands, points = [groove(polygon(*triangle))], (n, n, 2)
    rule = element_rule(UNIT, bands, T, points)
    assert rule.degree == min(2 * n - 1, 3)
    p, q = 2 * n - 1, 2 * n - 1
    ((xa, ya), (xb, yb), (xc, yc)), line = triangle, np.polynomial.legendre.leggauss(20)
    s = (line[0] + 1) / 2
    u, v = s[:, None], s[None] * (1 - s[:, None])  # the triangle as a collapsed square
    x, y = xa + u * (xb - xa) + v * (xc - xa), ya + u * (yb - ya) + v * (yc - ya)
    twice = abs((xb - xa) * (yc - ya) - (xc - xa) * (yb - ya))
    exact = twice * np.sum(np.outer(line[1], line[1]) / 4 * (1 - u) * x**p * y**q) * 0.03
    found = removed(lambda x, y, z: x**p * y**q, bands, 1, points)
    assert abs(found - exact) < 1e-15


HOOK = Curve(3, [0, 0, 0, 0, 1, 2, 2, 2, 2], [(0.2, 0.2), (0.9, 0.1), (0.7, 0.9), (0.1, 0.9), (0.2, 0.2)])
SLANT = polygon((0.2, 0.1), (0.3, 0.1), (0.8, 0.9), (0.7, 0.9))
EGG = ellipse((0.4, 0.5), 0.25, 0.2)


def weighted(weight):
    """A turned ellipse whose corner weights pull it to its control polygon or to a rhombus."""
    round_one = ellipse((0.5, 0.5), 0.3, 0.3, 0.4)
    return Curve(2, ROUND_KNOTS, round_one.control_points, [1, weight, 1, weight, 1, weight, 1, weight, 1])


LAYOUTS = {
    "circle": [groove(ellipse((0.5, 0.5), 0.25, 0.25))],
    "cubic": [groove(HOOK)],
    "crossing": [groove(EGG), groove(SLANT, 0.02)],
    "two circles": [groove(ellipse((0.4, 0.5), 0.25, 0.25), 0.02), groove(ellipse((0.6, 0.55), 0.25, 0.25), 0.03)],
    "both faces": [groove(EGG, 0.02), groove(HOOK, 0.02, TOP)],
    "with bands": [groove(EGG), Band(BOTTOM, GROOVE, 0, (0.4, 0.5), 0.02), Band(TOP, GROOVE, 1, (0.3, 0.7), 0.01)],
    "a lug": [groove(HOOK, 0.02, TOP, PROTRUSION)],
    "sharp": [groove(weighted(1e4))],
    "blunt": [groove(weighted(1e-4))],
}


def smooth(x, y, z):
    return 1 + x * y**3 + z * x**2 * y


@pytest.mark.parametrize("name", LAYOUTS)
def test_any_mesh_gives_the_same_integral(name):
    """A polynomial that four points integrate: only round-off of the curves' inversion differs between meshes.

    Weights of 1e4 put a curve's bend into 1e-4 of its parameter: that costs the inversion four digits.
    """
    found = [removed(smooth, LAYOUTS[name], n) for n in (1, 2)]
    assert np.ptp(found) < (EXACT if name == "sharp" else 1e-12) * abs(found[0])


@pytest.mark.parametrize("name", LAYOUTS)
def test_area_by_the_divergence_theorem(name):
    """Volume that a single outline removes = depth times 1/2 of the integral of x dy - y dx along it."""
    if len(LAYOUTS[name]) > 1:
        pytest.skip("one outline only")
    (band,), s = LAYOUTS[name], np.polynomial.legendre.leggauss(200)
    area = 0.0
    for first, last in zip(band.outline.breaks[:-1], band.outline.breaks[1:], strict=True):
        for low, high in zip(*(np.linspace(first, last, 65)[k : 64 + k] for k in (0, 1)), strict=True):
            u = (low + high) / 2 + (high - low) / 2 * s[0]
            (x, y), (x_u, y_u) = (part.T for part in curve_derivatives(band.outline, u)[:2])
            area += (high - low) / 2 * s[1] @ (x * y_u - y * x_u) / 2
    expected = -band.sign * abs(area) * band.depth
    assert abs(removed(MOMENTS["volume"], [band], 3) - expected) < EXACT * abs(expected)


@pytest.mark.parametrize("kind", ["tangent", "corner on a node", "edge on a mesh line"])
@pytest.mark.parametrize("nudge", [0, 1e-16, 1e-12, 1e-9, 1e-3])
def test_accuracy_does_not_depend_on_where_the_cut_falls(kind, nudge):
    """Shapes nudged through degenerate places of a 2 x 2 mesh keep their volume and centroid."""
    for sign in (-1, 1):
        d = sign * nudge
        if kind == "tangent":
            band, area, centre = groove(ellipse((0.7 + d, 0.7 - d), 0.2, 0.2)), np.pi * 0.04, 0.7 + d
        elif kind == "corner on a node":
            shape = [(0.5 + d, 0.5 - d), (0.8 + d, 0.6 - d), (0.7 + d, 0.9 - d)]
            band, area, centre = groove(polygon(*shape)), 0.05, 0.5 + d + 0.5 / 3
        else:
            band, area, centre = groove(polygon((0.5 + d, 0.2), (0.7, 0.2), (0.7, 0.5), (0.5 + d, 0.5))), 0, 0
            area, centre = 0.3 * (0.2 - d), 0.6 + d / 2
        volume, first = removed(moments("volume", "x"), [band], 2)
        assert abs(volume - 0.03 * area) < 1e-12 * area
        assert abs(first - 0.03 * area * centre) < 1e-12 * area


def test_two_shapes_a_micrometre_apart():
    gap = 1e-6
    bands = [groove(rectangle((0.2, 0.5), (0.2, 0.8))), groove(rectangle((0.5 + gap, 0.8), (0.2, 0.8)))]
    assert abs(removed(MOMENTS["volume"], bands, 3) - 0.03 * (0.3 + 0.3 - gap) * 0.6) < 1e-15
    circles = [groove(ellipse((0.3, 0.5), 0.2, 0.2)), groove(ellipse((0.7 + gap, 0.5), 0.2, 0.2))]
    assert abs(removed(MOMENTS["volume"], circles, 3) - 0.03 * 2 * np.pi * 0.04) < EXACT * 0.03 * np.pi * 0.04
    shared = [groove(rectangle((0.2, 0.5), (0.2, 0.8))), groove(rectangle((0.5, 0.8), (0.2, 0.8)))]
    assert abs(removed(MOMENTS["volume"], shared, 2) - 0.03 * 0.6 * 0.6) < 1e-15


def test_an_outline_larger_than_the_plate_leaves_a_thinner_plate():
    rule = element_rule(UNIT, [groove(rectangle((-1, 2), (-1, 2)))], T, (3, 3, 2))
    thinner = element_rule(UNIT, [Band(BOTTOM, GROOVE, 0, (-1, 2), 0.03)], T, (3, 3, 2))
    assert np.array_equal(rule.points, thinner.points) and np.array_equal(rule.weights, thinner.weights)


def test_of_two_that_overlap_the_deeper_counts():
    two = LAYOUTS["two circles"]
    r, d = 0.25, np.hypot(0.2, 0.05)
    lens = 2 * r * r * np.arccos(d / (2 * r)) - d / 2 * np.sqrt(4 * r * r - d * d)
    exact = np.pi * r * r * (0.02 + 0.03) - 0.02 * lens
    for n in (1, 2, 3):
        assert abs(removed(MOMENTS["volume"], two, n) - exact) < EXACT * exact


@pytest.mark.parametrize("side", [3, pytest.param(8, marks=pytest.mark.slow)])
def test_many_outlines_in_one_element(side):
    """Dimples in rows and columns."""
    at = (np.arange(side) + 0.5) / side
    dimples = [groove(ellipse((x, y), 0.05, 0.04, 0.3)) for x in at for y in at]
    rule = element_rule(UNIT, dimples, T, (4, 4, 2))
    assert abs(T - rule.weights.sum() - side**2 * 0.03 * np.pi * 0.002) < EXACT * T
    assert len(rule.weights) <= 2 * 8 * 8 * 2  # as many as two heights need, however many the outlines


def test_a_depth_that_varies_is_integrated_exactly():
    """A plane and a paraboloid over an ellipse, against their closed moments."""
    a, b, (cx, cy) = 0.3, 0.2, (0.5, 0.45)
    area = np.pi * a * b
    tilted = Surface((1, 1), ([0, 0, 1, 1], [0, 0, 1, 1]), [[[0.01], [0.01]], [[0.03], [0.03]]])
    bowl = Surface((2, 1), ([0, 0, 0, 1, 1, 1], [0, 0, 1, 1]), [[[0.01], [0.01]], [[0.01], [0.01]], [[0.03], [0.03]]])
    for depth, exact in ((tilted, area * (0.01 + 0.02 * cx)), (bowl, area * (0.01 + 0.02 * (cx**2 + a * a / 4)))):
        for n in (1, 2):
            found = removed(MOMENTS["volume"], [groove(ellipse((cx, cy), a, b), depth)], n)
            assert abs(found - exact) < EXACT * exact


def test_a_depth_with_knots_is_divided_at_them():
    """A roof: piecewise linear along y with a ridge at y = 0.4, over a disc; by a fine polar rule."""
    roof = Surface((1, 1), ([0, 0, 1, 1], [0, 0, 0.4, 1, 1]), [[[0.01], [0.03], [0.01]]] * 2)
    r, (cx, cy) = 0.3, (0.5, 0.45)
    found = [removed(MOMENTS["volume"], [groove(ellipse((cx, cy), r, r), roof)], n) for n in (1, 2)]
    # height below and above the ridge, by the chord's width 2 sqrt(r^2 - (y - cy)^2)
    s, w = np.polynomial.legendre.leggauss(60)
    exact = 0.0
    for t0, t1 in ((-np.pi / 2, np.arcsin((0.4 - cy) / r)), (np.arcsin((0.4 - cy) / r), np.pi / 2)):
        t = (t0 + t1) / 2 + (t1 - t0) / 2 * s
        y = cy + r * np.sin(t)
        height = np.where(y < 0.4, 0.01 + 0.02 * y / 0.4, 0.03 - 0.02 * (y - 0.4) / 0.6)
        exact += (t1 - t0) / 2 * w @ (2 * r * r * np.cos(t) ** 2 * height)
    assert np.abs(np.array(found) - exact).max() < EXACT * exact


@pytest.mark.slow
def test_a_section_with_vertical_walls_beside_an_outline():
    """A half-round band on one face, an ellipse on the other: each removes its own volume."""
    r = 0.02
    points = np.array([(0, 0), (0, 1), (1, 1), (2, 1), (2, 0)]) * r + (0.4, 0)
    for along in (0, 1):
        band = Band(TOP, GROOVE, along, (0.4, 0.4 + 2 * r), Curve(2, [0, 0, 0, 1, 1, 2, 2, 2], points, [1, W, 1, W, 1]))
        exact = np.pi * r * r / 2 + 0.02 * np.pi * 0.06
        found = removed(MOMENTS["volume"], [band, groove(ellipse((0.5, 0.45), 0.3, 0.2), 0.02)], 1, (4, 4, 2))
        assert abs(found - exact) < 1e-8 * exact  # lines graded toward the walls, eight points between two of them


def test_points_inside_and_their_thickness():
    band = groove(ellipse((0.5, 0.45), 0.3, 0.2, 0.3))
    rng = np.random.default_rng(0)
    x, y = rng.random((2, 500))
    u, v = turned(np.column_stack([x, y]) - (0.5, 0.45), (0, 0), -0.3).T
    z_min, z_max = thickness_range([band], T, x, y)
    inside = (u / 0.3) ** 2 + (v / 0.2) ** 2 < 1
    assert np.allclose(z_min, np.where(inside, -T / 2 + 0.03, -T / 2)) and np.allclose(z_max, T / 2)
    assert float(thickness_range([band], T, 0.5, 0.45)[0]) == pytest.approx(0.005)


def test_the_face_rule_follows_the_true_face():
    bands = [groove(ellipse((0.5, 0.45), 0.3, 0.2, 0.3)), Band(BOTTOM, GROOVE, 0, (0.8, 0.9), 0.01)]
    rule, z = face_rule(UNIT, bands, T, (3, 3), BOTTOM)
    for height, area in ((-T / 2, 1 - 0.1 - np.pi * 0.06), (-T / 2 + 0.03, np.pi * 0.06), (-T / 2 + 0.01, 0.1)):
        assert abs(rule.weights[np.abs(z - height) < 1e-12].sum() - area) < 1e-10
    rule, z = face_rule(UNIT, bands, T, (3, 3), TOP)
    assert np.all(z == T / 2) and abs(rule.weights.sum() - 1) < 1e-14
    plain, z = face_rule(UNIT, [], T, (2, 2), TOP)
    assert len(plain.weights) == 4 and np.all(z == T / 2)


def test_equal_cells_share_a_signature():
    """A pattern with the pitch of the mesh: every cell sees the same."""
    bands = [groove(ellipse(((i + 0.4) / 4, (j + 0.5) / 4), 0.05, 0.03, 0.4)) for i in range(4) for j in range(4)]
    assert len({signature(cell, bands) for cell in cells(4)}) == 1
    deeper = [replace(band, depth=0.02) for band in bands]
    assert signature(cells(4)[0], bands) != signature(cells(4)[0], deeper)


def test_elements_beside_an_outline_keep_the_plain_rule():
    plain = element_rule(((0.0, 0.2), (0.0, 0.2)), [], T, (3, 3, 2))
    rule = element_rule(((0.0, 0.2), (0.0, 0.2)), [groove(ellipse((0.5, 0.5), 0.4, 0.4))], T, (3, 3, 2))
    assert np.array_equal(rule.points, plain.points)


def test_arcs_close_and_cross_where_they_should():
    arcs, verticals = divide(ellipse((0.5, 0.5), 0.3, 0.2, 0.3))
    assert not verticals
    ends = [x for arc in arcs for x in (arc.x0, arc.x1)]
    assert all(ends.count(x) == 2 for x in ends)
    one, other = (divide(ellipse((x, 0.5), 0.25, 0.25))[0] for x in (0.4, 0.6))
    assert np.allclose(np.unique(np.round(crossings(one, other), 10)), [0.5])
    assert crossings(one, divide(ellipse((0.95, 0.5), 0.2, 0.2))[0]) == []


def test_fewer_points_have_the_same_moments():
    rng = np.random.default_rng(1)
    points, weights = rng.random((3000, 2)), rng.random(3000)
    some, new = fewer(points, weights, (7, 5))
    assert len(some) <= 8 * 6 and np.all(new > 0)
    for i in range(8):
        for j in range(6):
            full = weights @ np.prod(points ** (i, j), axis=1)
            assert abs(new @ np.prod(points[some] ** (i, j), axis=1) - full) < 1e-12 * weights.sum()
