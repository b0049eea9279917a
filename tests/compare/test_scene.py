"""A scene is read as written and says the same physics in any spelling; shipped ones are whole."""

import copy
import json
import re
from pathlib import Path

import pytest

from compare import index, scene_checks
from compare.scene import BUDGETS, SceneError, load, names, parse
from reports import sweep
from tests.compare.scene_changes import CANTILEVER, GROOVED, RUBBER, changed

CONFORMING = {"ancf.levels.0.element": "conforming"}


@pytest.mark.parametrize("name", names())
def test_shipped_scenes_load_and_state_their_source(name):
    scene = load(name)
    assert scene.name == name and scene.source and scene.assumed


@pytest.mark.parametrize("name", names())
def test_reading_what_was_written_gives_the_same_scene(name):
    scene = load(name)
    for written in (scene.model_dump(mode="json"), scene.model_dump(mode="json", exclude_defaults=True)):
        assert parse(json.loads(json.dumps(written)), name) == scene


@pytest.mark.parametrize("name", names())
def test_budgets_nest(name):
    scene = load(name)
    for solver in ("ancf", "reference") if scene.reference else ("ancf",):
        ladders = [scene.ladder(solver, budget) for budget in BUDGETS]
        assert ladders[0] and set(ladders[0]) <= set(ladders[1]) <= set(ladders[2]) == set(scene.ladder(solver))


def test_published_table_is_complete():
    plain, grooved = load("cantilever_plain").published, load("cantilever").published
    assert [row.mesh[0] for row in plain.rows] == [row.mesh[0] for row in grooved.rows] == [2, 3, 4, 5, 6, 8, 12, 16]
    assert (plain.converged.value, grooved.converged.value) == (-0.5022, -0.5669)
    levels = {(level.mesh, level.points) for level in load("cantilever_plain").ladder("ancf")}
    assert all((row.mesh, row.points) in levels for row in plain.rows if row.points)


def test_a_file_of_the_user_is_read_by_its_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(CANTILEVER.replace("depth = 0.03\n", "depth = 0.02\n"))
    assert [groove.depth for groove in load(path).grooves] == [0.02, 0.02]
    path.write_text(CANTILEVER.replace("depth = 0.03\n", "depth = -0.03\n", 1))
    with pytest.raises(SceneError, match=r"mine\.toml: grooves\.0\.depth = -0\.03: must be greater than 0"):
        load(path)
    path.write_text("thickness = ")
    with pytest.raises(SceneError, match=r"mine\.toml: not a TOML file"):
        load(path)
    with pytest.raises(SceneError, match="no such scene"):
        load(tmp_path / "other.toml")


def test_override_changes_only_what_it_names():
    scene = load("cantilever")
    deeper = scene.override({"grooves.0.depth": 0.02, "surface.length": 2}, "deeper")
    assert deeper.grooves[0].depth == 0.02 and deeper.surface.length == 2 and deeper.name == "deeper"
    back = deeper.override({"grooves.0.depth": 0.03, "surface.length": 1.0}, "cantilever")
    assert back == scene


def test_override_replaces_a_whole_table_and_removes_a_key():
    scene = load("cantilever")
    variant = {variant.name: variant for variant in scene.sensitivity.variants}[
        "walls rounded to quarter circles of 0.03 m"
    ]
    rounded = scene.override(variant.set)
    assert all(groove.profile is not None and groove.depth is None for groove in rounded.grooves)
    assert [groove.edges for groove in rounded.grooves] == [(0.2, 0.3), (0.7, 0.8)]
    assert scene.override({"reference": None}).reference is None


def test_override_of_a_ladder_reaches_every_level():
    scene = load("cantilever").override({"ancf.time_step": 0.02, "ancf.points": [2, 2, 2]})
    assert {(level.time_step, level.points) for level in scene.ladder("ancf")} == {(0.02, (2, 2, 2))}


@pytest.mark.parametrize("key", ["groove.0.depth", "grooves.5.depth", "grooves.left.depth", "thickness.a", "thikness"])
def test_override_of_a_missing_key_is_refused(key):
    with pytest.raises(SceneError, match=key.split(".")[0]):
        load("cantilever").override({key: 0.02})


def test_variants_differ_in_physics():
    scene = load("cantilever")
    spelled = {json.dumps(scene.override(v.set).physics(), sort_keys=True) for v in scene.sensitivity.variants}
    assert len(spelled | {json.dumps(scene.physics(), sort_keys=True)}) == len(scene.sensitivity.variants) + 1


def test_physics_does_not_depend_on_the_spelling():
    """Order of keys, 1 or 1.0, stated defaults, another title or ladder: the same JSON, byte for byte."""
    other = {key: copy.deepcopy(GROOVED[key]) for key in reversed(GROOVED)}
    other |= {"title": "another", "assumed": [], "schema_version": 1, "protrusions": []}
    other["surface"] = {"width": 1, "length": 1, "kind": "rectangle"}
    other["material"] |= {"youngs_modulus": 2_000_000, "poissons_ratio": -0.0}
    other["loads"][0] |= {"at": [1, 1], "force": [-0.0, 0, -50]}
    other["probes"][0] = {"at": [1, 1, 0], "name": "P"}
    other["ancf"]["levels"] = [{"mesh": [2, 2], "time_step": 0.01}]
    other["published"] = {"source": "another"}
    del other["sensitivity"], other["reference"]
    assert json.dumps(parse(other, "other").physics()) == json.dumps(load("cantilever").physics())


@pytest.mark.parametrize(
    "changes",
    [{"grooves.0.depth": 0.031}, {"analysis.every": 0.1}, {"supports.0.gradients": "tangential"}, {"thickness": 0.06}],
)
def test_physics_tells_different_scenes_apart(changes):
    scene = load("cantilever")
    assert scene.override(changes).physics() != scene.physics()


def test_elements_and_their_least_points_are_those_of_the_solver():
    """compare imports no solver, so it states both again."""
    from typing import get_args

    from ancf.shape import FAMILY
    from compare.scene import AncfLevel
    from compare.scene_checks import LEAST_POINTS

    assert set(get_args(AncfLevel.model_fields["element"].annotation)) == set(FAMILY)
    least = {name: shape.least_points for name, shape in FAMILY.items() if shape.least_points != (1, 1, 1)}
    assert least == LEAST_POINTS


def test_no_scene_takes_the_name_of_a_page_or_of_an_accepted_table_that_is_not_its_own():
    """Those that make and its gates write, the index's and the sweep's."""
    root = Path(__file__).parents[2]
    pages = set(re.findall(r"reports/build/(\w+)\.html", (root / "Makefile").read_text()))
    tables = {path.stem for path in (root / "reports" / "baselines").glob("*.json")} - set(names())
    assert {"index", "sweep", "tire"} < pages | tables | {Path(index.NAME).stem, sweep.NAME} <= set(scene_checks.TAKEN)


@pytest.mark.parametrize(
    "changes",
    [
        {"supports.0.edge": "x1"},
        {"supports": [{"kind": "clamp", "edge": "y0"}, {"kind": "symmetry", "edge": "x0", "normal": "X"}]},
        {"supports": [{"kind": "hold", "whole": True, "components": ["Y"]}, {"kind": "clamp", "edge": "y1"}]},
        {"supports.0.edge": "y0", "ancf.levels.0.fit": [0.5], "grooves.0.extent": [0.3, 1.0]},
        {"supports.0.edge": "y0", "ancf.levels.0.integration": "global"},
        {"supports.0.edge": "y0", "material": RUBBER, "ancf.levels.0.integrator": "trapezoidal"},
        {"supports.0.edge": "y0", "ancf.levels.0.points": [5, 4, 3]},
        {"material": RUBBER, **CONFORMING, "ancf.levels.0.points": [2, 2, 2], "ancf.levels.0.volumetric": "reduced"},
    ],
)
def test_levels_with_just_enough_points_are_taken_by_the_solver(changes):
    """One element across from x0 to x1; what the scene's checks let pass, `ancf.system` does too."""
    from ancf.unpack import build

    own = {f"ancf.levels.0.{key}": value for key, value in {"mesh": [1, 2], "points": [4, 4, 3]}.items()}
    data = changed({**own, "ancf.levels.0.element": "enriched", **changes})
    data["ancf"]["levels"] = data["ancf"]["levels"][:1]
    scene = parse({key: value for key, value in data.items() if key not in ("published", "sensitivity")}, "my.toml")
    assert build(scene, scene.ancf.levels[0]).system.unknowns > 0
