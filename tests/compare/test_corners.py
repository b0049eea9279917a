"""The largest angle that the material fills at an inner edge, against what a drawing of the section shows."""

import math

import pytest

from compare.exact import reentrant_order
from compare.scene import load, parse
from compare.scene_corners import reentrant_angle
from tests.compare.scene_changes import GONE, arched, band, changed, profile
from tests.compare.test_outlines import circle, groove, polygon
from tests.revolved_scenes import cylinder, scene_of

PLAIN = changed({"sensitivity": GONE, "published": GONE})
WALL = 1.5 * math.pi
RECTANGLE = ((0.4, 0.0), (0.4, 0.02), (0.6, 0.02), (0.6, 0.0))
VEE = ((0.4, 0.0), (0.5, 0.03), (0.6, 0.0))
FLANK = math.atan2(0.03, 0.1)  # slope of the vee's


def of(*grooves, protrusions=()):
    changes = {"grooves": list(grooves), "protrusions": list(protrusions)}
    return reentrant_angle(parse(changed(changes, PLAIN), "my.toml"))


def straight(points, **more):
    """A section of straight pieces."""
    n = len(points)
    return {**profile(points, (0, *range(n), n - 1), degree=1), **more}


def test_a_plain_plate_has_no_inner_edge():
    assert of() is None


@pytest.mark.parametrize("section", [band(), straight(RECTANGLE)], ids=["across and depth", "profile"])
def test_an_upright_wall_leaves_three_quarters_of_a_turn(section):
    assert of(section) == pytest.approx(WALL, abs=1e-12)
    assert of(protrusions=[section]) == pytest.approx(WALL, abs=1e-12)
    assert reentrant_order(of(section)) == pytest.approx(1.0890, abs=1e-4)


def test_a_vee_is_open_at_its_bottom_and_its_like_that_stands_out_at_its_feet():
    assert of(straight(VEE)) == pytest.approx(math.pi + 2 * FLANK, abs=1e-12)
    assert of(protrusions=[straight(VEE)]) == pytest.approx(math.pi + FLANK, abs=1e-12)


def test_a_smooth_groove_has_no_inner_edge_and_its_like_that_stands_out_has_feet():
    """Both pieces of the arch meet level at its middle; its ends are upright."""
    assert of(arched(0.02)) is None
    assert of(protrusions=[arched(0.02)]) == pytest.approx(WALL, abs=1e-12)


def test_control_points_that_coincide_make_a_corner_without_a_knot_for_it():
    points = ((0.4, 0.0), (0.5, 0.03), (0.5, 0.03), (0.6, 0.0))
    assert of(profile(points, (0, 0, 0, 0.5, 1, 1, 1))) == pytest.approx(math.pi + 2 * FLANK, abs=1e-12)
    apart = ((0.4, 0.0), (0.49, 0.03), (0.51, 0.03), (0.6, 0.0))
    assert of(profile(apart, (0, 0, 0, 0.5, 1, 1, 1))) is None


def test_the_ends_of_a_smooth_band_are_walls_unless_they_are_the_plates():
    assert of({**arched(0.02), "extent": [0.2, 1.0]}) == pytest.approx(WALL)
    assert of({**arched(0.02), "extent": [0.0, 1.0]}) is None


def test_what_ends_at_the_edge_of_the_plate_has_no_wall_there():
    assert of(band(across=[0.0, 1.0])) is None
    assert of(band(across=[0.0, 0.2])) == pytest.approx(WALL)
    edge = straight(((0.0, 0.0), (0.0, 0.02), (0.2, 0.0)))
    assert of(edge) is None
    assert of(protrusions=[edge]) == pytest.approx(math.pi + 0.1, abs=1e-3)


def test_the_largest_of_several_counts():
    assert of(straight(VEE), band(name="wide", across=[0.7, 0.8])) == pytest.approx(WALL)


def test_an_outline_has_walls_and_the_corners_that_are_seen_from_above():
    """An equilateral pocket leaves 5/3 pi around its corners; what stands out like it has only its walls."""
    triangle = polygon((0.4, 0.4), (0.6, 0.4), (0.5, 0.4 + 0.2 * math.sin(math.pi / 3)))
    assert of(groove(circle())) == pytest.approx(WALL)
    assert of(groove(triangle)) == pytest.approx(5 / 3 * math.pi)
    assert of(protrusions=[groove(triangle)]) == pytest.approx(WALL)
    assert of(groove(polygon(*reversed(triangle["control_points"][:-1])))) == pytest.approx(5 / 3 * math.pi)
    assert of(groove(polygon((-1.0, -1.0), (2.0, -1.0), (2.0, 2.0), (-1.0, 2.0)))) is None


def sloped(depths, knots, degree=(1, 1)):
    surface = {"degree": list(degree), "knots": knots, "depths": depths}
    return groove(polygon((0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8)), depth=None, depth_surface=surface)


def test_a_floor_that_rises_from_a_wall_closes_it_further():
    """0.02 m over the 0.6 m between x = 0.2 and 0.8."""
    floor = sloped([[0.02, 0.02], [0.0, 0.0]], [[0.2, 0.2, 0.8, 0.8], [0, 0, 1, 1]])
    assert of(floor) == pytest.approx(WALL + math.atan(0.02 / 0.6))


def test_a_floor_without_walls_has_its_creases():
    """A valley along y whose sides fall 0.02 m over 0.3 m, as a surface of depth 0 where the outline runs along y."""
    valley = sloped([[0.0, 0.0], [0.02, 0.02], [0.0, 0.0]], [[0.2, 0.2, 0.5, 0.8, 0.8], [0, 0, 1, 1]])
    wide = polygon((0.2, -0.1), (0.8, -0.1), (0.8, 1.1), (0.2, 1.1))
    assert of({**valley, "outline": wide}) == pytest.approx(math.pi + 2 * math.atan(0.02 / 0.3))


def test_slopes_on_a_curved_surface_are_measured_in_metres():
    """Across the angle of a ring of radius 2 m the vee is 0.4 m wide, across its section, 0.5 m for 1, 0.1 m."""
    vee = straight(VEE, along="y")
    ring = scene_of(cylinder(2.0, 0.5), [0.0, 1.0], grooves=[vee])
    assert reentrant_angle(ring) == pytest.approx(math.pi + 2 * math.atan2(0.03, 0.2), abs=1e-12)
    ring = scene_of(cylinder(2.0, 0.5), [0.0, 1.0], grooves=[straight(VEE)])
    assert reentrant_angle(ring) == pytest.approx(math.pi + 2 * math.atan2(0.03, 0.05), abs=1e-12)


def test_a_net_of_control_points_is_measured_too():
    """A flat rectangle, 3 m by 2 m for parameters from 0 to 1; to shear it along x leaves the width across as it is."""
    for shear in (0.0, 1.0):
        net = [[[0.0, 0.0, 0.0], [shear, 2.0, 0.0]], [[3.0, 0.0, 0.0], [3.0 + shear, 2.0, 0.0]]]
        surface = {"kind": "nurbs", "degree": [1, 1], "knots": [[0, 0, 1, 1], [0, 0, 1, 1]], "control_points": net}
        changes = {"surface": surface, "grooves": [straight(VEE)], "probes.0.at": [1.0, 1.0, 0.0]}
        scene = parse(changed(changes, PLAIN), "my.toml")
        assert reentrant_angle(scene) == pytest.approx(math.pi + 2 * math.atan2(0.03, 0.2), abs=1e-12)


def test_a_band_at_the_seam_of_a_ring_has_both_walls():
    wall = band(along="y", across=[0.0, 0.2])
    assert reentrant_angle(scene_of(cylinder(1.0, 0.5), grooves=[wall])) == pytest.approx(WALL)
    around = band(along="x", across=[0.0, 1.0])
    assert reentrant_angle(scene_of(cylinder(1.0, 0.5), grooves=[around])) is None


@pytest.mark.parametrize("name", ["cantilever", "cylinder_panel", "tread_smooth"])
def test_shipped_scenes_with_upright_walls(name):
    assert reentrant_angle(load(name)) >= WALL - 1e-12


def test_the_grooves_of_the_tire_are_wider_at_the_face():
    """Their flanks lean by 0.007 of the section's parameter, about 1.1 m, over 0.06 m."""
    assert reentrant_angle(load("falling_tire")) == pytest.approx(WALL - math.atan(0.007 * 1.1 / 0.06), abs=0.01)


def test_the_rounded_groove_has_no_inner_edge():
    assert reentrant_angle(load("rounded_groove")) is None
