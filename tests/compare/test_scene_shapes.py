"""Wrong grooves and mid-surfaces are refused; unusual ones, and other unusual scenes, are allowed."""

import numpy as np
import pytest

from compare.scene import load, parse
from compare.scene_geometry import sides, too_thick
from tests.compare.scene_changes import CURVED, GONE, MOMENT, arched, band, changed, profile, refusals

BANDS = {
    "as deep as the plate": ({"grooves.0.depth": 0.05}, "grooves.0.depth = 0.05: the groove is as deep as the plate"),
    "deeper than the plate": ({"grooves.0.depth": 0.06}, "grooves.0.depth = 0.06: the groove is as deep as the plate"),
    "profile as deep": ({"grooves.end": arched(0.05)}, "grooves.2.profile = 0.05 m deep: the groove is as deep"),
    "two faces together": (
        {"grooves.end": band(face="top", across=[0.25, 0.5], depth=0.02)},
        "grooves.2 overlaps grooves.0 ('left') on the other face: together 0.05 m deep",
    ),
    "two faces together, crossing": (
        {"grooves.end": band(face="top", along="y", depth=0.025)},
        "grooves.2 overlaps grooves.0 ('left') on the other face: together 0.055 m deep",
    ),
    "two faces together, curved": (
        {"grooves": [arched(0.03), {**arched(0.03), "name": "other", "face": "top"}]},
        "grooves.1 overlaps grooves.0 ('new') on the other face: together 0.06 m deep",
    ),
    "off the plate": (
        {"grooves.1.across": [0.95, 1.05]},
        "grooves.1.across = [0.95, 1.05]: off the plate, whose y runs",
    ),
    "far off the plate": ({"grooves.1.across": [2.0, 3.0]}, "grooves.1.across = [2.0, 3.0]: off the plate"),
    "extent off the plate": (
        {"grooves.0.extent": [0.5, 1.5]},
        "grooves.0.extent = [0.5, 1.5]: off the plate, whose x runs",
    ),
    "edges reversed": (
        {"grooves.0.across": [0.3, 0.2]},
        "grooves.0.across = [0.3, 0.2]: the first coordinate must be less",
    ),
    "extent empty": (
        {"grooves.0.extent": [0.3, 0.3]},
        "grooves.0.extent = [0.3, 0.3]: the first coordinate must be less",
    ),
    "no section": ({"grooves.0.depth": GONE, "grooves.0.across": GONE}, "grooves.0.across: this key is missing"),
    "no depth": ({"grooves.0.depth": GONE}, "grooves.0.depth: this key is missing; a band needs across and depth, or"),
    "both sections": (
        {"grooves.0.profile": profile()["profile"]},
        "grooves.0.profile: state either profile, or across and",
    ),
    "repeated name": (
        {"grooves.1.name": "left"},
        "grooves.1.name = 'left': this name is already taken by grooves.0.name",
    ),
    "name of a groove": (
        {"protrusions": [band(name="left")]},
        "protrusions.0.name = 'left': this name is already taken by",
    ),
    "curved over curved": (
        {"grooves": [arched(0.02), {**arched(0.02), "name": "b", "along": "y"}]},
        "grooves.1 overlaps grooves.0 ('new'): only rectangular sections may overlap on one face",
    ),
    "curved over rectangular": (
        {"grooves.end": {**arched(0.02), "along": "y"}},
        "grooves.2 overlaps grooves.0 ('left'): only rectangular sections may overlap on one face",
    ),
    "groove in protrusion": (
        {"protrusions": [band(across=[0.25, 0.4])]},
        "protrusions.0 overlaps grooves.0 ('left'): a groove",
    ),
}
CURVES = {
    "across decreasing": (
        {"grooves.end": profile([(0.4, 0), (0.7, 0.02), (0.6, 0)])},
        "grooves.2.profile.control_points.2 = [0.6, 0.0]: the coordinate across must not decrease",
    ),
    "begins in the plate": (
        {"grooves.end": profile([(0.4, 0.01), (0.5, 0.02), (0.6, 0)])},
        "grooves.2.profile.control_points.0 = [0.4, 0.01]: a profile begins and ends on the face",
    ),
    "negative depth": (
        {"grooves.end": profile([(0.4, 0), (0.5, -0.02), (0.6, 0)])},
        "grooves.2.profile.control_points.1 = [0.5, -0.02]: a depth must not be negative",
    ),
    "profile off the plate": (
        {"grooves.end": profile([(0.9, 0), (0.95, 0.02), (1.1, 0)])},
        "grooves.2.profile.control_points = [0.9, 1.1]: off the plate",
    ),
    "knots too few": (
        {"grooves.end": profile(knots=[0, 0, 1, 1])},
        "grooves.2.profile.knots = [0.0, 0.0, 1.0, 1.0]: 3 control points of degree 2 need 6 knots, not 4",
    ),
    "knots decreasing": ({"grooves.end": profile(knots=[0, 0, 0, 2, 1, 1])}, "knots must not decrease"),
    "knots not clamped": ({"grooves.end": profile(knots=[0, 0, 0.1, 1, 1, 1])}, "must each stand 3 times (degree + 1)"),
    "knots all equal": ({"grooves.end": profile(knots=[1] * 6)}, "the first and the last knot must differ"),
    "points too few": ({"grooves.end": profile([(0.4, 0), (0.6, 0)])}, "degree 2 needs at least 3 control points"),
    "torn curve": (
        {"grooves.end": profile([(0.4, 0), *[(0.5, 0.01)] * 4, (0.6, 0)], [0, 0, 0, 1, 1, 1, 2, 2, 2])},
        "an inner knot may stand 2 times at most (degree)",
    ),
    "weights too few": ({"grooves.end": profile(weights=[1, 1])}, "3 control points need as many weights"),
    "weight of zero": (
        {"grooves.end": profile(weights=[1, 0, 1])},
        "grooves.2.profile.weights.1 = 0: must be greater than 0",
    ),
}
SURFACES = {
    "knots too many": (
        {"surface.knots.0": [0, 0, 0.2, 0.5, 0.5]},
        "surface.knots.0 = [0.0, 0.0, 0.2, 0.5, 0.5]: 2 control points",
    ),
    "no knots": ({"surface.knots.1": []}, "surface.knots.1 = []: 3 control points of degree 2 need 6 knots, not 0"),
    "knots not clamped": (
        {"surface.knots.1": [0, 0, 0.5, 1, 1, 1]},
        "surface.knots.1 = [0.0, 0.0, 0.5, 1.0, 1.0, 1.0]: the first",
    ),
    "ragged net": (
        {"surface.control_points.0.0": GONE},
        "surface.control_points = rows of [2, 3] points: each row needs",
    ),
    "empty net": ({"surface.control_points": []}, "surface.control_points = rows of [] points"),
    "flat point": (
        {"surface.control_points.0.0": [0.0, 0.0]},
        "surface.control_points.0.0 = [0.0, 0.0]: needs 3 numbers",
    ),
    "weights of another shape": (
        {"surface.weights.0": [1, 1]},
        "surface.weights = rows of [2, 3] weights: the net of control points is 2 x 3",
    ),
    "symmetry of an arc across its chord": (
        {"supports.end": {"kind": "symmetry", "edge": "x1", "normal": "Z"}},
        "supports.1.normal = 'Z': the edge x1 does not lie in a plane of this normal",
    ),
    "symmetry of an edge whose directors lean": (
        {"supports.end": {"kind": "symmetry", "edge": "y1", "normal": "Y"}},
        "supports.1.normal = 'Y': the directors of the edge y1 lean out of the plane",
    ),
    "off the patch": (
        {"grooves.0.across": [0.4, 1.6]},
        "grooves.0.across = [0.4, 1.6]: off the plate, whose y runs from 0 to 1",
    ),
}


@pytest.mark.parametrize(
    "changes, expected",
    [pytest.param(*case, id=name) for name, case in (BANDS | CURVES).items()],
)
def test_a_wrong_groove_is_refused(changes, expected):
    """One line for one mistake: file, key, value, reason."""
    found = refusals(changes)
    assert any(expected in problem for problem in found), found
    assert all(problem.startswith("my.toml: ") for problem in found)
    assert len(found) <= 2, found


@pytest.mark.parametrize("changes, expected", [pytest.param(*case, id=name) for name, case in SURFACES.items()])
def test_a_wrong_surface_is_refused(changes, expected):
    found = refusals(changes, CURVED)
    assert len(found) == 1 and expected in found[0], found


ALLOWED = {
    "grooves that cross": {"grooves.end": band(along="y")},
    "grooves that touch": {"grooves.end": band(across=[0.3, 0.5])},
    "groove to the plate's edge": {"grooves.end": band(across=[0.9, 1.0])},
    "groove over the whole plate": {"grooves": [band(across=[0.0, 1.0])]},
    "grooves one above the other": {"grooves.end": band(face="top", across=[0.2, 0.3], depth=0.019)},
    "curved groove beside": {"grooves.end": arched(0.04)},
    "protrusion above a groove": {"protrusions": [band(face="top", across=[0.2, 0.3], depth=0.2)]},
    "probe on a groove's floor": {"probes.0.at": [1.0, 0.25, 0.005]},
    "probe on a groove's wall": {"probes.0.at": [1.0, 0.2, -0.02]},
    "short grooves that do not meet": {
        "grooves.0.extent": [0.0, 0.5],
        "grooves.end": band(face="top", across=[0.2, 0.3], depth=0.04, extent=[0.5, 0.9]),
    },
    "probe beyond a groove's end": {"grooves.0.extent": [0.0, 0.5], "probes.0.at": [0.6, 0.25, -0.025]},
    "probe on a protrusion": {"protrusions": [band()], "probes.0.at": [1.0, 0.5, -0.035]},
    "region partly outside": {"probes.0": {"name": "P", "region": [[0.9, 1.1], [0.9, 1.1]]}},
    "nearly incompressible": {"material.poissons_ratio": 0.499},
    "hold over a plane of symmetry": {
        "supports.end": {"kind": "symmetry", "edge": "y0", "normal": "Y"},
        "loads.end": {"kind": "pressure", "face": "top", "pressure": -3.0},
    },
    "corner held": {"supports.end": {"kind": "hold", "corner": "x1y1", "components": ["X", "Z"], "over": "middle"}},
    "bottom of a solid held": {
        "supports.end": {"kind": "hold", "edge": "y0", "components": ["Z"], "over": "bottom"},
        "ancf": GONE,
    },
    "moment in statics": {"analysis.kind": "static", "loads.end": MOMENT},
    "auxetic": {"material.poissons_ratio": -0.9},
    "statics without mass": {"material.density": GONE, "analysis.kind": "static"},
    "free flight": {"supports": [], "initial": {"velocity": [1, 0, 0]}},
    "one solver": {"reference": GONE},
    "three tenths": {"analysis.until": 0.3, "analysis.every": 0.1},
}


@pytest.mark.parametrize("changes", [pytest.param(case, id=name) for name, case in ALLOWED.items()])
def test_an_unusual_scene_is_allowed(changes):
    parse(changed(changes | {"sensitivity": GONE}), "my.toml")


def test_an_arc_lies_in_the_plane_of_its_ends():
    parse(changed({"supports.end": {"kind": "symmetry", "edge": "x1", "normal": "X"}}, CURVED), "my.toml")


def test_opposite_curved_grooves_may_be_deep_at_different_places():
    """Two ellipses of 0.03 m whose edges cross: only where they overlap their depths add up."""
    beside = [
        [y + 0.15 if i == 0 else y for i, y in enumerate(point)] for point in arched(0.03)["profile"]["control_points"]
    ]
    other = {**arched(0.03), "name": "other", "face": "top"}
    other["profile"] = {**other["profile"], "control_points": beside}
    parse(changed({"grooves": [arched(0.03), other], "sensitivity": GONE}), "my.toml")


def test_a_thickness_is_measured_by_the_lengths_of_a_curved_plate():
    """A quarter of a cylinder of radius 1 m, 0.5 m long; half a tire whose beads have a radius of 1.2545 m."""
    assert sides(load("cylinder_panel")) == pytest.approx((0.5, np.pi / 2), rel=1e-5)
    assert sides(load("falling_tire"))[0] == pytest.approx(1.2545 * np.pi, rel=1e-5)
    thick = parse(changed({"thickness": 0.3, "grooves": []}, CURVED), "my.toml")
    assert too_thick(thick) == "thickness = 0.3: above 0.5 of the shorter side, 0.5 m; lengths are in metres"
    assert too_thick(load("cylinder_panel")) is None
