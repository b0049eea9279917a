"""Outlined grooves and treads in a scene: read as stated, refused where they are wrong."""

import pytest

from compare.scene import SceneError, load, parse
from compare.scene_geometry import material_range
from compare.sketch import sketch
from compare.treads import title

W = 0.5**0.5
SQUARE = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]


def circle(x=0.5, y=0.5, r=0.2, **more):
    points = [[x + r * p, y + r * q] for p, q in SQUARE]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    return {"degree": 2, "knots": knots, "control_points": points, "weights": [1.0, W] * 4 + [1.0], **more}


def polygon(*points):
    n = len(points)
    return {"degree": 1, "knots": [0, *range(n + 1), n], "control_points": [*map(list, points), list(points[0])]}


def groove(outline=None, **more):
    stated = {"name": "new", "face": "bottom", "depth": 0.02, "outline": outline or circle(), **more}
    return {key: value for key, value in stated.items() if value is not None}


def stated(**changes):
    data = load("tread_smooth").model_dump(mode="json", exclude_defaults=True)
    for key in ("tread", "grooves"):
        data.pop(key)
    return {**data, **changes}


def refusals(**changes):
    with pytest.raises(SceneError) as refused:
        parse(stated(**changes), "my.toml")
    return "\n".join(refused.value.problems)


PLANE = {"degree": [1, 1], "knots": [[0, 0, 1, 1]] * 2, "depths": [[0.01, 0.01], [0.03, 0.03]]}
BOW = polygon((0.2, 0.2), (0.8, 0.8), (0.8, 0.2), (0.2, 0.8))
REFUSED = {
    "open": (groove(circle(control_points=[[0, 0]] * 8 + [[1, 1]])), "its last point must be its first"),
    "crossing itself": (groove(BOW), "crosses itself"),
    "off the plate": (groove(circle(x=2.0)), "off the plate"),
    "no area": (groove(polygon((0.2, 0.2), (0.5, 0.5), (0.8, 0.8))), "encloses no area"),
    "no depth": (groove(depth=None), "this key is missing; an outline needs depth, or depth_surface"),
    "two depths": (groove(depth_surface=PLANE), "state either depth or depth_surface"),
    "too deep": (groove(depth=0.05), "as deep as the plate"),
    "too deep somewhere": (
        groove(depth=None, depth_surface={**PLANE, "depths": [[0.01, 0.01], [0.09, 0.09]]}),
        "as deep as the plate",
    ),
    "negative depth": (
        groove(depth=None, depth_surface={**PLANE, "depths": [[-0.03, -0.03], [0.03, 0.03]]}),
        "must not be negative",
    ),
    "depth surface too small": (
        groove(depth=None, depth_surface={**PLANE, "knots": [[0, 0, 0.5, 0.5], [0, 0, 1, 1]]}),
        "from 0 to 0.5, but the outline has x from 0.3 to 0.7",
    ),
    "knots": (groove(circle(knots=[0, 0, 1])), "9 control points of degree 2 need 12 knots"),
    "weights": (groove(circle(weights=[1.0])), "9 control points need as many weights"),
    "unknown key": (groove(along="x"), "grooves.0.along = 'x': unknown key"),
    "degree as text": (groove(circle(degree="two")), "grooves.0.outline.degree = 'two'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_wrong_outline_is_refused_by_key_and_reason(name):
    shape, words = REFUSED[name]
    found = refusals(grooves=[shape])
    assert found.startswith("my.toml: grooves.0.") and words in found


def test_overlaps_that_are_not_modelled_are_refused():
    curved = groove(name="bowl", depth=None, depth_surface=PLANE)
    assert "only those of constant depth may overlap" in refusals(grooves=[groove(), curved])
    both = refusals(grooves=[groove(depth=0.03), groove(name="top", face="top", depth=0.02)])
    assert "on the other face: together 0.05 m deep" in both
    lug = groove(circle(x=0.6), name="lug")
    assert "a groove and a protrusion on the same place" in refusals(grooves=[groove()], protrusions=[lug])
    parse(stated(grooves=[groove(), groove(circle(x=0.6), name="deeper", depth=0.03)]), "overlapping")
    left, right = polygon((0.1, 0.1), (0.5, 0.1), (0.5, 0.9)), polygon((0.5, 0.1), (0.9, 0.1), (0.5, 0.9))
    beside = groove(right, name="beside", depth=None, depth_surface=PLANE)
    parse(stated(grooves=[groove(left), beside]), "touching")


def test_the_material_ends_at_the_floor():
    scene = parse(stated(grooves=[groove()], probes=[{"name": "P", "at": [0.5, 0.5, 0.0]}]), "disc")
    assert material_range(scene, 0.5, 0.5) == pytest.approx((-0.005, 0.025))
    assert material_range(scene, 0.5, 0.71) == pytest.approx((-0.025, 0.025))
    assert "outside the material" in refusals(grooves=[groove()], probes=[{"name": "P", "at": [0.5, 0.5, -0.02]}])
    beyond = parse(stated(grooves=[groove(polygon((-1, -1), (2, -1), (2, 2), (-1, 2)))]), "whole")
    assert material_range(beyond, 1.0, 1.0) == pytest.approx((-0.005, 0.025))


@pytest.mark.parametrize("kind", ["rock", "traction", "block", "rib", "smooth"])
def test_a_tread_expands_into_its_grooves(kind):
    scene = load(f"tread_{kind}")
    assert scene.grooves and {title(groove.name) for groove in scene.grooves} == {f"tread {kind}"}
    assert all(groove.depth == scene.tread.depth for groove in scene.grooves)
    assert "tread" not in scene.physics() and len(scene.physics()["grooves"]) == len(scene.grooves)
    assert "<svg" in sketch(scene)
    deeper = scene.override({"tread.depth": 0.01})
    assert len(deeper.grooves) == len(scene.grooves) and deeper.grooves[0].depth == 0.01
    other = scene.override({"tread.along": "y"})
    assert len(other.grooves) == len(scene.grooves)


def test_a_tread_keeps_the_grooves_that_are_stated():
    tread = {"kind": "rib", "face": "bottom", "depth": 0.01, "void": 0.2}
    scene = parse(stated(grooves=[groove(face="top")], tread=tread), "both")
    assert [groove.name for groove in scene.grooves] == ["new", "tread rib 1", "tread rib 2", "tread rib 3"]
    assert scene.override({"grooves.0.depth": 0.01}).grooves[0].depth == 0.01
    with pytest.raises(SceneError, match="no such key"):
        scene.override({"grooves.1.depth": 0.01})
    assert "a tread's grooves have such names" in refusals(grooves=[groove(name="tread rib 1")], tread=tread)
    assert "tread.void = 1.5: must be less than 1" in refusals(tread={**tread, "void": 1.5})
