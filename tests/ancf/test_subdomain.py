"""Cut elements prove themselves: volumes, the divergence theorem, and cuts nudged either side of degenerate.

Lengths in m. Tolerances are round-off of the plate's volume, 0.05 m3, unless a test says otherwise.
"""

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ancf.nurbs import Curve
from ancf.quadrature import NO_PROMISE, gauss, onto_cell, tensor
from ancf.subdomain import BOTTOM, GROOVE, PROTRUSION, TOP, Band, division, element_rule, signature, thickness_range

T = 0.05
UNIT = ((0.0, 1.0), (0.0, 1.0))
POINTS = (3, 3, 2)
EXACT = 1e-14
W = np.sqrt(0.5)
KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 3]


def groove(low, high, depth=0.03, along=0, **more):
    return Band(BOTTOM, GROOVE, along, (low, high), depth, **more)


def rounded(low, high, depth=0.03, radius=0.03):
    """Walls of quarter circles (ellipses where depth and radius differ), vertical at the face; a level floor."""
    across = [low, low, low + radius, (low + high) / 2, high - radius, high, high]
    points = np.column_stack([across, np.array([0, 1, 1, 1, 1, 1, 0]) * depth])
    return Curve(2, KNOTS, points, [1, W, 1, 1, 1, W, 1])


def semicircle(low, radius=0.03):
    points = np.array([(0, 0), (0, 1), (1, 1), (2, 1), (2, 0)]) * radius + (low, 0)
    return Curve(2, [0, 0, 0, 1, 1, 2, 2, 2], points, [1, W, 1, W, 1])


def stepped(low, high):
    """Two floors, 0.01 and 0.03 deep, with a vertical wall between them that is part of the curve."""
    middle = (low + high) / 2
    points = [(low, 0), (low, 0.01), (middle, 0.01), (middle, 0.03), (high, 0.03), (high, 0)]
    return Curve(1, [0, 0, 1, 2, 3, 4, 5, 5], points)


def trapezium(low, high, depth=0.03, wall=0.01):
    return Curve(1, [0, 0, 1, 2, 3, 3], [(low, 0), (low + wall, depth), (high - wall, depth), (high, 0)])


TWO = (groove(0.2, 0.3), groove(0.7, 0.8))
LAYOUTS = {
    "two": TWO,
    "on mesh lines": (groove(0.25, 0.5),),
    "across elements": (groove(0.2, 0.6),),
    "narrower than an element": (groove(0.31, 0.32),),
    "both faces": (groove(0.2, 0.4, 0.02), replace(groove(0.3, 0.6, 0.02), face=TOP)),
    "crossing": (groove(0.2, 0.3), groove(0.5, 0.8, 0.02, along=1)),
    "overlapping": (groove(0.2, 0.4, 0.01), groove(0.3, 0.5, 0.03)),
    "touching": (groove(0.2, 0.3, 0.01), groove(0.3, 0.5, 0.03)),
    "short": (groove(0.2, 0.3, extent=(0.1, 0.6)),),
    "protrusion": (replace(groove(0.2, 0.3), sign=PROTRUSION), groove(0.7, 0.8)),
    "trapezium": (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), trapezium(0.2, 0.3)),),
    "stepped": (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), stepped(0.2, 0.3)),),
    "rounded": (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), rounded(0.2, 0.3)),),
    "rounded, along y, on top": (Band(TOP, GROOVE, 1, (0.2, 0.3), rounded(0.2, 0.3)),),
    "rounded ridge": (Band(TOP, PROTRUSION, 0, (0.2, 0.3), rounded(0.2, 0.3)),),
    "rounded on both faces": (
        Band(BOTTOM, GROOVE, 0, (0.2, 0.4), rounded(0.2, 0.4, 0.02)),
        Band(TOP, GROOVE, 0, (0.3, 0.5), rounded(0.3, 0.5, 0.02)),
    ),
    "rounded crossing on the other face": (
        Band(BOTTOM, GROOVE, 0, (0.2, 0.4), rounded(0.2, 0.4, 0.02)),
        Band(TOP, GROOVE, 1, (0.3, 0.5), rounded(0.3, 0.5, 0.02)),
    ),
}
QUARTERS = (1 - np.pi / 4) * 0.03**2  # what two rounded corners leave of a rectangular section, each
REMOVED = {
    "two": 2 * 0.1 * 0.03,
    "on mesh lines": 0.25 * 0.03,
    "across elements": 0.4 * 0.03,
    "narrower than an element": 0.01 * 0.03,
    "both faces": 0.2 * 0.02 + 0.3 * 0.02,
    "crossing": 0.1 * 0.03 + 0.3 * 0.02 - 0.1 * 0.3 * 0.02,
    "overlapping": 0.1 * 0.01 + 0.2 * 0.03,
    "touching": 0.1 * 0.01 + 0.2 * 0.03,
    "short": 0.5 * 0.1 * 0.03,
    "protrusion": 0.0,
    "trapezium": 0.09 * 0.03,
    "stepped": 0.05 * 0.01 + 0.05 * 0.03,
    "rounded": 0.1 * 0.03 - 2 * QUARTERS,
    "rounded, along y, on top": 0.1 * 0.03 - 2 * QUARTERS,
    "rounded ridge": -(0.1 * 0.03 - 2 * QUARTERS),
    "rounded on both faces": 2 * (0.2 * 0.02 - 2 * (1 - np.pi / 4) * 0.03 * 0.02),
    "rounded crossing on the other face": 2 * (0.2 * 0.02 - 2 * (1 - np.pi / 4) * 0.03 * 0.02),
}
POLYGONAL = [name for name in LAYOUTS if "rounded" not in name]
RECTANGULAR = [name for name in POLYGONAL if name not in ("trapezium", "stepped")]


def cells(n, m=None, origin=(0.0, 0.0)):
    x, y = np.linspace(0, 1, n + 1) + origin[0], np.linspace(0, 1, (m or n) + 1) + origin[1]
    return [((x[i], x[i + 1]), (y[j], y[j + 1])) for i in range(n) for j in range(len(y) - 1)]


def plate_integral(function, bands, n=1, points=POINTS, **more):
    """Sum over the cells of an n x n mesh of the integral of function(x, y, z)."""
    rules = [element_rule(cell, bands, T, points, **more) for cell in cells(n)]
    return sum(rule.weights @ function(*rule.points.T) for rule in rules)


WAYS = ("subdomain", "sparing")


def one(x, y, z):
    return np.ones_like(x)


def wavy(x, y, z):
    return np.exp(x - 0.5 * y) * np.cos(20 * z) + x * y**2 * z


def counts(name):
    """Points that integrate volume to round-off: 2 for flat walls, 12 over a quarter circle."""
    return (2, 2, 1) if name in POLYGONAL else (12, 12, 1)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7])
@pytest.mark.parametrize("name", LAYOUTS)
def test_kept_and_removed_make_the_whole(name, n):
    assert abs(plate_integral(one, LAYOUTS[name], n, counts(name)) + REMOVED[name] - T) < 10 * EXACT


@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("name", LAYOUTS)
def test_any_mesh_gives_the_same_integral(name, n):
    """A smooth function over the kept part does not know the mesh: 8 points per subdomain reach round-off."""
    points = (8, 12, 8) if name in POLYGONAL else (14, 14, 8)
    assert abs(plate_integral(wavy, LAYOUTS[name], n, points) - plate_integral(wavy, LAYOUTS[name], 1, points)) < 1e-12


@pytest.mark.parametrize("name", LAYOUTS)
def test_divergence_theorem_on_the_kept_part(name):
    """Volume integral of div F = flux through the faces, F = (0, 0, f): f is taken at z_max and z_min.

    The faces are integrated plainly, with many midpoints and the mapping of section 4.2: an
    independent way whose own error (midpoints beside vertical tangents) sets the tolerance.
    """
    volume = plate_integral(lambda x, y, z: x * (1 + y) * 3 * z**2, LAYOUTS[name], 3, (8, 12, 4))
    n = 1200
    middle = (np.arange(n) + 0.5) / n
    x, y = middle[:, None], middle
    z_min, z_max = thickness_range(LAYOUTS[name], T, x, y)
    assert abs(volume - np.mean(x * (1 + y) * (z_max**3 - z_min**3))) < 1e-4 * abs(volume)


@pytest.mark.parametrize("name", RECTANGULAR)
def test_rule_keeps_its_promise(name):
    """Every monomial up to the degree, against the boxes that are left, found by a fine plain division."""
    bands, rule = LAYOUTS[name], element_rule(UNIT, LAYOUTS[name], T, POINTS)
    assert rule.degree == 3
    lines = [np.unique([0, 1, *(v for b in bands for v in np.clip(b.limits(axis), 0, 1))]) for axis in (0, 1)]
    for powers in np.ndindex(4, 4, 4):
        exact = 0.0
        for x in pairwise(lines[0]):
            for y in pairwise(lines[1]):
                z = [float(v) for v in thickness_range(bands, T, np.mean(x), np.mean(y))]
                sides = zip((x, y, z), powers, strict=True)
                exact += np.prod([(b ** (p + 1) - a ** (p + 1)) / (p + 1) for (a, b), p in sides])
        assert abs(rule.weights @ np.prod(rule.points**powers, axis=1) - exact) < EXACT


def test_elements_without_a_band_keep_the_plain_rule():
    plain = onto_cell(tensor(*map(gauss, POINTS)), ((0.0, 1.0), (0.0, 0.2), (-T / 2, T / 2)))
    for integration in (*WAYS, "global"):
        rule = element_rule(((0.0, 1.0), (0.0, 0.2)), TWO, T, POINTS, integration)  # ends where the groove begins
        assert np.array_equal(rule.points, plain.points) and np.array_equal(rule.weights, plain.weights)


@pytest.mark.parametrize("name", LAYOUTS)
def test_sparing_rules_have_fewer_points_and_the_same_integral(name):
    """Volume to round-off (a profile's degree is kept); a field like exp(x) cos(20 z) as the whole rule does.

    4 points in an element err by 4e-5 of a field that varies by exp(4) there. This one varies by exp(0.5), and on a
    leaning wall with the depth, of which two points keep z and z^2: 20 z = 0.5 on a face, of which z^4 is left.
    """
    rules = [[element_rule(cell, LAYOUTS[name], T, (4, 4, 3), way) for cell in cells(2)] for way in WAYS]
    whole, sparing = ([(sum(rule.weights @ f(*rule.points.T) for rule in own)) for f in (one, wavy)] for own in rules)
    least = EXACT if name in POLYGONAL else 1e-3  # a quarter circle needs 12 points for its volume
    assert abs(sparing[0] - whole[0]) < least and abs(sparing[1] - whole[1]) < max(1e-6, least)
    counts = [sum(len(rule.weights) for rule in own) for own in rules]
    assert counts[1] < counts[0] and min(len(rule.weights) for rule in rules[1]) >= 4 * 4 * 3


def test_a_groove_over_a_whole_element_leaves_a_thinner_element():
    cell = (0.0, 0.5), (0.25, 0.5)
    rule = element_rule(cell, LAYOUTS["on mesh lines"], T, POINTS)
    thinner = onto_cell(tensor(*map(gauss, POINTS)), (*cell, (-T / 2 + 0.03, T / 2)))
    assert np.abs(rule.points - thinner.points).max() < EXACT
    assert np.abs(rule.weights - thinner.weights).max() < EXACT


@pytest.mark.parametrize("section", [1e-15, rounded(0.2, 0.3, 1e-15), trapezium(0.2, 0.3, 1e-15)])
def test_a_depth_of_nothing_is_the_plain_plate(section):
    band = Band(BOTTOM, GROOVE, 0, (0.2, 0.3), section)
    points = (8, 12, 8)
    assert abs(plate_integral(wavy, [band], 3, points) - plate_integral(wavy, [], 3, points)) < 1e-12
    assert abs(plate_integral(one, [band], 3) - plate_integral(one, [], 3)) < EXACT  # at any number of points


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_shift_changes_nothing(name):
    """The plate moved by (10, -3): round-off grows with the coordinates, 1e-15 of 10 m."""
    moved = tuple(_moved(band, (10.0, -3.0)) for band in LAYOUTS[name])
    for cell, there in zip(cells(4), cells(4, origin=(10.0, -3.0)), strict=True):
        rule, shifted = element_rule(cell, LAYOUTS[name], T, POINTS), element_rule(there, moved, T, POINTS)
        assert rule.points.shape == shifted.points.shape
        # a depth near a vertical tangent follows the square root of round-off
        assert np.abs(rule.points + np.array([10, -3, 0]) - shifted.points).max() < 1e-7
        assert abs(rule.weights.sum() - shifted.weights.sum()) < 1e-9


def _moved(band, by):
    section = band.section
    if band.is_curved:
        section = replace(section, control_points=section.control_points + np.array([by[band.across], 0]))
    edges, extent = (tuple(v + by[axis] for v in band.limits(axis)) for axis in (band.across, band.along))
    return replace(band, edges=edges, extent=extent, section=section)


@pytest.mark.parametrize("name", ["on mesh lines", "rounded"])
@pytest.mark.parametrize("nudge", [0, 1e-17, 1e-15, 1e-13, 1e-12, 1e-11, 1e-9, 1e-6])
@pytest.mark.parametrize("sign", [-1, 1])
def test_edges_nudged_off_a_mesh_line_are_harmless(name, nudge, sign):
    """The mesh line at 0.25 (here the edge of a groove) moves by less than a hair: so does the volume."""
    low, high = 0.25 + sign * nudge, 0.5 + sign * nudge
    section = 0.03 if name == "on mesh lines" else rounded(low, high)
    band = Band(BOTTOM, GROOVE, 0, (low, high), section)
    removed = 0.25 * 0.03 - (0 if name == "on mesh lines" else 2 * QUARTERS)
    total = 0.0
    for cell in cells(4):
        rule = element_rule(cell, [band], T, (2, 12, 1))
        total += rule.weights.sum()
        assert np.all(rule.weights > 0) and np.all(np.isfinite(rule.points))
    assert abs(total + removed - T) < 1e-12


def test_round_off_makes_no_slivers():
    """0.1 * 3 is not 0.3: the edge and the mesh line are one line."""
    x, y = division(((0.0, 1.0), (0.1 * 3, 0.6)), TWO)
    assert np.array_equal(x, [0.0, 1.0]) and np.array_equal(y, [0.1 * 3, 0.6])
    _, y = division(UNIT, [groove(0.2, 0.1 * 3), groove(0.3, 0.4)])
    assert len(y) == 5


def test_a_line_that_is_not_round_off_is_kept():
    cell = (0.0, 1.0), (0.25, 0.5)
    for nudge, lines in ((1e-9, 3), (1e-11, 3), (1e-14, 2)):
        assert len(division(cell, [groove(0.25 + nudge, 0.6)])[1]) == lines
        assert len(division(cell, [groove(0.1, 0.5 - nudge)])[1]) == lines


def test_a_stepped_section_equals_two_rectangular_ones():
    """The wall between the floors is a stretch of the curve without width: it takes no points."""
    curved = [Band(BOTTOM, GROOVE, 0, (0.2, 0.3), stepped(0.2, 0.3))]
    plain = [groove(0.2, 0.25, 0.01), groove(0.25, 0.3, 0.03)]
    for cell in cells(3):
        rule, twin = element_rule(cell, curved, T, POINTS), element_rule(cell, plain, T, POINTS)
        assert np.abs(rule.points - twin.points).max() < EXACT and np.abs(rule.weights - twin.weights).max() < EXACT


def test_division_finds_edges_ends_and_knots():
    bands = [groove(0.2, 0.3, extent=(0.1, 2.0)), Band(TOP, GROOVE, 1, (0.4, 0.6), rounded(0.4, 0.6))]
    x, y = division(UNIT, bands)
    assert np.allclose(x, [0, 0.1, 0.4, 0.43, 0.57, 0.6, 1]) and np.allclose(y, [0, 0.2, 0.3, 1])


def test_three_points_in_three_subdomains():
    """The paper's division: 3 subdomains in y with 3 points each, 3 points along x, 2 through the thickness."""
    rule = element_rule(((0.0, 0.5), (0.0, 0.5)), TWO, T, POINTS)
    assert len(rule.weights) == 3 * (3 * 3) * 2


def closed_form_semicircle(low, radius):
    """Volume, and first moments about y = 0 and about the mid-surface, of a unit length of a half-round groove."""
    area, centroid = np.pi * radius**2 / 2, 4 * radius / (3 * np.pi)
    return area, area * (low + radius), area * (-T / 2 + centroid)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_circular_arc_volume_and_centroid(n):
    bands = [Band(BOTTOM, GROOVE, 0, (0.2, 0.26), semicircle(0.2))]
    removed = closed_form_semicircle(0.2, 0.03)
    moments = [plate_integral(f, bands, n, (2, 12, 2)) for f in (one, lambda x, y, z: y, lambda x, y, z: z)]
    assert np.abs(np.add(moments, removed) - (T, T / 2, 0)).max() < 1e-12


def test_a_cell_edge_through_an_arc():
    """Circular segment of the half-round groove left of a cell edge, in closed form."""
    radius, cut = 0.03, 0.215
    s = cut - 0.2 - radius
    segment = (s * np.sqrt(radius**2 - s**2) + radius**2 * np.arcsin(s / radius)) / 2 + np.pi * radius**2 / 4
    bands = [Band(BOTTOM, GROOVE, 0, (0.2, 0.26), semicircle(0.2))]
    rule = element_rule(((0.0, 1.0), (0.0, cut)), bands, T, (1, 12, 1))
    assert abs(rule.weights.sum() - (T * cut - segment)) < 1e-14


def test_subdomain_converges_fast_and_global_slowly():
    """The comparison of section 5.2, on volume: a half-round groove against its closed form."""
    bands = [Band(BOTTOM, GROOVE, 0, (0.4, 0.46), semicircle(0.4))]
    exact = T - closed_form_semicircle(0.4, 0.03)[0]
    error = {
        kind: [abs(plate_integral(one, bands, 1, (1, n, 1), integration=kind) - exact) for n in (3, 6, 40)]
        for kind in ("subdomain", "global")
    }
    assert error["subdomain"][0] < 1e-6 and error["subdomain"][1] < 1e-9
    assert error["global"][2] > 1e-6


def test_global_rule_follows_the_mapping():
    """Plain twin: one point after the other, z between what the mapping gives there."""
    bands = LAYOUTS["rounded"]
    rule = element_rule(UNIT, bands, T, POINTS, "global")
    assert rule.degree == NO_PROMISE
    expected = []
    plane = onto_cell(tensor(gauss(3), gauss(3)), UNIT)
    for (x, y), w in zip(plane.points, plane.weights, strict=True):
        low, high = (float(v) for v in thickness_range(bands, T, x, y))
        line = onto_cell(gauss(2), [(low, high)])
        expected += [(x, y, z, w * v) for (z,), v in zip(line.points, line.weights, strict=True)]
    assert np.abs(np.column_stack([rule.points, rule.weights]) - expected).max() < EXACT


def test_thickness_range_by_hand():
    bands = [
        groove(0.2, 0.3, 0.03),
        groove(0.25, 0.4, 0.01),
        replace(groove(0.2, 0.3, 0.002), face=TOP, sign=PROTRUSION),
    ]
    z_min, z_max = thickness_range(bands, T, 0.5, [0.1, 0.22, 0.27, 0.35, 0.9])
    assert np.allclose(z_min, [-0.025, 0.005, 0.005, -0.015, -0.025])
    assert np.allclose(z_max, [0.025, 0.027, 0.027, 0.025, 0.025])


def test_a_groove_cuts_a_protrusion_down_to_its_floor():
    bands = [groove(0.2, 0.3, 0.03), replace(groove(0.4, 0.6, 0.01, along=1), sign=PROTRUSION)]
    z_min, _ = thickness_range(bands, T, [0.5, 0.5, 0.1], [0.25, 0.5, 0.25])
    assert np.allclose(z_min, [0.005, -0.035, 0.005])


def test_nothing_left_is_refused():
    with pytest.raises(ValueError, match="no material"):
        element_rule(UNIT, [groove(0.2, 0.3, 0.03), replace(groove(0.2, 0.3, 0.02), face=TOP)], T, POINTS)


@pytest.mark.parametrize("name", LAYOUTS)
def test_equal_signatures_share_a_rule(name):
    """Cells of one key have the same rule relative to their origins; so one rule serves them all."""
    kept = {}
    for cell in cells(10):
        rule = element_rule(cell, LAYOUTS[name], T, POINTS)
        local = rule.points - (cell[0][0], cell[1][0], 0)
        first = kept.setdefault(signature(cell, LAYOUTS[name]), (local, rule.weights))
        assert first[0].shape == local.shape
        assert np.abs(first[0] - local).max() < 1e-9 and np.abs(first[1] - rule.weights).max() < 1e-12
    assert len(kept) <= 36


def test_signatures_tell_different_cells_apart():
    keys = {signature(cell, TWO) for cell in cells(5)}
    assert len(keys) == 3  # plain, groove at the upper half of the cell, groove at its lower half
    assert signature(UNIT, TWO) != signature(UNIT, [replace(band, section=0.02) for band in TWO])
    assert signature(UNIT, TWO) != signature(UNIT, [replace(band, face=TOP) for band in TWO])
    shifted = [Band(BOTTOM, GROOVE, 0, (low, low + 0.1), rounded(low, low + 0.1)) for low in (0.2, 0.7)]
    assert signature(((0, 1), (0, 0.5)), shifted) == signature(((0, 1), (0.5, 1)), shifted)


def test_hundreds_of_elements_take_milliseconds():
    """256 elements: every signature, and one rule per distinct key. Measured 12 ms; the bar allows a slow machine."""
    start = time.perf_counter()
    keys = {}
    for cell in cells(16):
        key = signature(cell, TWO)
        if key not in keys:
            keys[key] = element_rule(cell, TWO, T, POINTS)
    assert len(keys) == 3
    assert time.perf_counter() - start < 0.2


def test_sparing_rules_have_fewer_points_on_both_sides_of_a_kink():
    """Two and two in place of three and three where it halves the thickness; three in a part that is most of it, and
    none in a part that no column reaches.

    Three points in the whole thickness err by 1e-3 of a field that varies by exp(4) there: what is allowed in a part.
    """
    cell, levels = ((0.0, 1.0), (0.0, 1.0)), [0.0]

    def heights(bands=(), levels=levels, **more):
        rule = element_rule(cell, bands, T, (4, 4, 3), levels=levels, **more)
        return rule, len(np.unique(rule.points[:, 2]))

    def kinked(rule):
        z = rule.points[:, 2]
        return rule.weights @ (np.maximum(z, 0) * np.exp(z / T))

    spared = {"integration": "sparing", "through": True}
    (whole, many), (sparing, few) = heights(), heights(**spared)
    assert (many, few) == (6, 4)
    assert kinked(sparing) == pytest.approx(kinked(whole), rel=1e-3)
    assert heights(levels=[0.4 * T], **spared)[1] == 3 + 2
    deep = heights((Band(TOP, GROOVE, 0, (-1.0, 2.0), 0.7 * T),), **spared)
    assert deep[0].weights.sum() == pytest.approx(0.3 * T, rel=1e-14) and deep[1] == 2
    assert heights(integration="sparing")[1] == 6
