"""Revolved mid-surfaces: what is refused, and which edges lie in planes of symmetry."""

import math

import pytest

from compare.scene import SceneError, load
from compare.scene_geometry import off_plane
from tests.revolved_scenes import TURN, arc, cylinder, scene_of

SYMMETRY = {"kind": "symmetry", "edge": "x0", "normal": "X"}
HELD = {
    "supports": [{"kind": "clamp", "edge": "y0"}],
    "ancf": None,
    "reference": {"levels": [{"size": 0.4, "time_step": 1.0}]},
}
REFUSED = {
    "angles reversed": ({"angle": [1.0, 0.0]}, {}, "surface.angle = [1, 0]: the first angle must be less"),
    "more than a turn": ({"angle": [0.0, 7.0]}, {}, "surface.angle = [0, 7]: more than a full turn, 2 pi"),
    "on the axis": (
        {"section": cylinder(0.0, 1.0)},
        {},
        "surface.section.control_points.0.1 = 0: a section on the axis or beyond it",
    ),
    "too few knots": (
        {"section": {**arc(), "knots": [0, 0, 1, 1]}},
        {},
        "surface.section.knots = [0.0, 0.0, 1.0, 1.0]: 3 control points of degree 2 need 6 knots",
    ),
    "too few weights": (
        {"section": {**arc(), "weights": [1, 1]}},
        {},
        "surface.section.weights = [1.0, 1.0]: 3 control points need as many weights",
    ),
    "axis": ({"axis": "W"}, {}, "surface.axis = 'W': must be"),
    "support at the seam": ({}, {"supports": [SYMMETRY]}, "supports.0.edge = 'x0': a full turn is closed there"),
    "two elements around": (
        {},
        {"ancf": {"levels": [{"mesh": [2, 4]}]}},
        "ancf.levels.0.mesh.0 = 2: a full turn needs 3 elements at least",
    ),
    "leaning face": (
        {"angle": [0.1, 1.0]},
        {"supports": [SYMMETRY]},
        "supports.0.normal = 'X': the edge x0 does not lie in a plane of this normal",
    ),
    "load across the seam": (
        {},
        {"loads": [{"kind": "patch", "region": [[-0.3, 0.3], [0.0, 1.0]], "force": [0.0, 0.0, 1.0]}]},
        "loads.0.region.0 = [-0.3, 0.3]: reaches across the seam of a full turn from 0 to 6.28319; state surface.angle",
    ),
    "probe across the seam": (
        {"angle": [1.0, 1.0 + 2 * math.pi]},
        {"probes": [{"name": "part", "region": [[7.0, 7.5], [0.0, 1.0]]}]},
        "probes.0.region.0 = [7, 7.5]: reaches across the seam of a full turn from 1 to 7.28319",
    ),
    "groove off the ring": (
        {"angle": [0.0, 1.0]},
        {"grooves": [{"name": "far", "face": "top", "along": "y", "across": [0.9, 1.2], "depth": 0.01}]},
        "grooves.0.across = [0.9, 1.2]: off the plate, whose x runs from 0 to 1",
    ),
}


@pytest.mark.parametrize("surface, more, said", REFUSED.values(), ids=REFUSED.keys())
def test_a_wrong_ring_is_refused_by_key_value_and_reason(surface, more, said):
    words = {"kind": "revolved", "axis": "Y", "angle": TURN, "section": arc(), **surface}
    with pytest.raises(SceneError) as refused:
        scene_of(arc(), surface=words, **more)
    assert any(said in problem for problem in refused.value.problems), refused.value.problems


def test_edges_lie_in_the_planes_that_their_faces_lie_in():
    """About Y from Z: the quarter's ends have the normals X and Z; a straight section's ends the normal Y."""
    quarter = scene_of(cylinder(1.0, 0.4), [0.0, math.pi / 2])
    planes = {"x0": "X", "x1": "Z", "y0": "Y", "y1": "Y"}
    for edge, normal in planes.items():
        assert [component for component in "XYZ" if off_plane(quarter, edge, component) is None] == [normal]
    curved = scene_of(arc(), [0.0, math.pi / 2])
    assert "lean out" in off_plane(curved, "y1", "Y")


def test_a_full_turn_is_closed_and_less_is_not():
    assert scene_of(arc()).surface.closed
    assert scene_of(arc(), [1.0, 1.0 + 2 * math.pi]).surface.closed
    assert not scene_of(arc(), [0.0, 6.28]).surface.closed


def test_a_region_may_end_at_the_seam():
    for angles in ([0.0, 0.3], [6.0, 6.283185307], TURN):
        probes = [{"name": "part", "region": [angles, [0.0, 1.0]]}]
        scene_of(arc(), analysis={"kind": "static"}, probes=probes, **HELD)


BROKEN = {
    "gravity across": (
        {"loads.0.acceleration": [1.0, 0.0, -9.81]},
        "loads.0.acceleration = [1.0, 0.0, -9.81]: the symmetry at x0",
    ),
    "ground that leans": (
        {"obstacles.0.shape.normal": [0.0, 0.1, 1.0]},
        "obstacles.0.shape.normal = [0.0, 0.1, 1.0]: the symmetry at y0 mirrors Y, which makes another plane of it",
    ),
    "ball beside": (
        {"obstacles.0.shape": {"kind": "sphere", "centre": [0.1, 0.0, -2.0], "radius": 0.5}},
        "obstacles.0.shape.centre = [0.1, 0.0, -2.0]: the symmetry at x0 mirrors X, which makes two bodies of it",
    ),
    "drum across": (
        {"obstacles.0.shape": {"kind": "drum", "point": [0.0, 0.0, -2.0], "axis": [1.0, 1.0, 0.0], "radius": 0.5}},
        "obstacles.0.shape.axis = [1.0, 1.0, 0.0]: the symmetry at x0 mirrors X, which makes another drum of it",
    ),
    "spin": (
        {"initial": {"angular_velocity": [0.0, 1.0, 0.0]}},
        "initial.angular_velocity = [0.0, 1.0, 0.0]: the symmetry at x0 mirrors X; a mirrored body turns",
    ),
    "drift": ({"initial": {"velocity": [0.0, 1.0, 0.0]}}, "initial.velocity = [0.0, 1.0, 0.0]: the symmetry at y0"),
    "pull at the plane": (
        {"loads": [{"kind": "edge", "edge": "y0", "force": [0.0, 1.0, 0.0]}]},
        "loads.0.force = [0.0, 1.0, 0.0]: the symmetry at y0 mirrors Y, and the load is on that edge",
    ),
}


@pytest.mark.parametrize("changes, said", BROKEN.values(), ids=BROKEN.keys())
def test_a_scene_that_breaks_its_symmetry_is_refused(changes, said):
    with pytest.raises(SceneError) as refused:
        load("falling_tire").override(changes)
    assert [problem for problem in refused.value.problems if said in problem], refused.value.problems


def test_what_keeps_a_symmetry_is_accepted():
    """A drum along or across a plane, a ball in both planes, a fall straight down."""
    for axis in ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]):
        load("falling_tire").override(
            {"obstacles.0.shape": {"kind": "drum", "point": [0.0, 0.0, -2.0], "axis": axis, "radius": 0.5}}
        )
    load("falling_tire").override({"obstacles.0.shape": {"kind": "sphere", "centre": [0.0, 0.0, -2.0], "radius": 0.5}})
    load("falling_tire").override({"initial": {"velocity": [0.0, 0.0, -1.0]}})
