"""A scene's rim is read as written, refused where it is wrong, told in words and drawn."""

import tomllib

import numpy as np
import pytest

from compare.explain import statement
from compare.result import Result, Rim, load, save
from compare.scene import SHIPPED, SceneError, parse
from compare.scene import load as shipped
from compare.sketch import sketch
from tests.compare.scene_changes import changed

STANDING = tomllib.loads((SHIPPED / "standing_tire.toml").read_text())
ROLLING = {"analysis": {"kind": "dynamic", "until": 1.0, "every": 0.1}, "rim.spin": [0.0, 5.0, 0.0]}
WHOLE = {"surface.angle": [0.0, 6.283185307179586], "supports": [STANDING["supports"][2]], "material.density": 1500.0}
CLAMP, FIRST = {"kind": "clamp", "edge": "x0"}, "supports.0"


@pytest.mark.parametrize(
    ("changes", "key", "reason"),
    [
        ({"rim": None}, "loads.0.kind = 'axle'", "the scene states none; state [rim]"),
        ({"rim.edges": []}, "rim.edges = []", "needs at least one entry"),
        ({"rim.edges": ["y1", "y1"]}, "rim.edges.1 = 'y1'", "already named"),
        ({"rim.edges": ["y0"]}, "supports.2.edge = 'y0'", "the rim already holds this edge"),
        ({"rim.free": ["Z", "Z"]}, "rim.free.1 = 'Z'", "already named"),
        ({"rim.free": ["X"]}, "rim.free = ['X']", "a symmetry mirrors X, along which its halves would part"),
        ({"rim.displacement": [0.0, 0.0, -0.1]}, "rim.displacement = [0.0, 0.0, -0.1]", "so its way is found"),
        ({"rim.displacement": [0.1, 0.0, 0.0]}, "rim.displacement = [0.1, 0.0, 0.0]", "a symmetry mirrors X"),
        ({"loads.0.force": [0.0, 1.0, 0.0]}, "loads.0.force = [0.0, 1.0, 0.0]", "a symmetry mirrors Y"),
        ({"rim.history": []}, "rim.history = []", "needs at least one pair"),
        ({"rim.history": [[0, 0], [0, 1]]}, "rim.history.1 = [0.0, 1.0]", "must be later than 0"),
        ({"rim.mass": 5.0}, "rim.mass = 5", "statics without gravity has no use for it"),
        ({"rim.mass": -5.0}, "rim.mass = -5.0", "greater than or equal to 0"),
        ({"rim.spin": [0.0, 5.0, 0.0]}, "rim.spin = [0.0, 5.0, 0.0]", "statics has no velocity"),
        (ROLLING, "rim.spin = [0.0, 5.0, 0.0]", "a surface that is revolved by a full turn"),
        (WHOLE | ROLLING | {"rim.spin": [0.0, 0.0, 5.0]}, "rim.spin = [0.0, 0.0, 5.0]", "revolved by a full turn"),
        (WHOLE | ROLLING | {"rim.edges": ["x0"]}, "rim.edges.0 = 'x0'", "a full turn is closed there"),
        ({FIRST: CLAMP}, "supports.0", "it meets the rim and holds Z, along which the rim moves"),
        (WHOLE | ROLLING | {FIRST: CLAMP | {"edge": "x0"}}, "supports.0", "it meets a rim that spins"),
        ({"ancf.enrich": 0.9}, "ancf.levels.0.enrich = 0.9", "supports that stand still"),
        ({"analysis": {"kind": "modes", "count": 3}}, "rim", "modes are those of a plate whose supports stand still"),
    ],
)  # fmt: skip
def test_a_wrong_rim_is_refused_by_key_value_and_reason(changes, key, reason):
    changes = dict(changes)
    data = changed({k: v for k, v in changes.items() if v is not None}, STANDING)
    for k in [k for k, v in changes.items() if v is None]:
        del data[k]
    with pytest.raises(SceneError) as refused:
        parse(data, "my.toml")
    told = [line for line in refused.value.problems if line.startswith(f"my.toml: {key}") and reason in line]
    assert len(told) == 1, refused.value.problems


def test_a_rolling_rim_is_allowed():
    ground = {"loads.0.force": [0.0, 0.0, -1e4], "rim.free": ["X", "Z"], "rim.mass": 50.0}
    scene = parse(changed(WHOLE | ROLLING | ground, STANDING), "my.toml")
    assert scene.rim.spin == (0.0, 5.0, 0.0)


def test_a_rim_is_told_and_drawn():
    scene = shipped("standing_tire")
    told = dict(statement(scene))
    assert told["rim"] == "y1 held rigidly, free along Z"
    assert any("on the rim" in words for about, words in statement(scene) if about == "load")
    assert "rim, free along Z" in sketch(scene)


def test_a_scene_without_a_rim_has_the_physics_that_it_had():
    """Results that are kept on disk are found again."""
    assert "rim" not in shipped("falling_tire").physics() and "rim" in shipped("standing_tire").physics()


def test_a_result_keeps_its_rim(tmp_path):
    rim = Rim(*np.arange(18.0).reshape(3, 2, 3))
    empty = np.zeros((2, 0, 3))
    result = Result({}, "ancf", "0", {}, 1.0, 3, np.arange(2.0), (), np.zeros((0, 3)), empty, {}, rim=rim)
    save(result, tmp_path / "r.npz")
    found = load(tmp_path / "r.npz").rim
    for name in ("displacement", "force", "moment"):
        np.testing.assert_array_equal(getattr(found, name), getattr(rim, name))
