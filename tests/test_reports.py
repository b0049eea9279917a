"""Every exhibit, run coarsely from the solvers to the page."""

import json
import re
from dataclasses import replace

import pytest

from compare import study, table
from compare.scene import load
from reports import cantilever, scene, sections

SOLVERS = {"ancf": "ancf.run", "reference": "reference_fe.run"}
COARSE = {
    "ancf.levels": [
        {"element": "conforming", "mesh": [2, 2], "points": [3, 3, 2], "time_step": 0.01},
        {"element": "conforming", "mesh": [3, 3], "points": [3, 3, 2], "time_step": 0.01},
    ],
    "reference.levels": [{"size": 0.3, "time_step": 0.02}],
    "sensitivity": None,
}


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """Entries of the grooved and the plain plate on the coarsest meshes."""
    scenes = [load(name).override(COARSE) for name in ("cantilever", "cantilever_plain")]
    return scenes, study.run(scenes, SOLVERS, "standard", tmp_path_factory.mktemp("results"), 2)


def publish(module, stated, entries, folder):
    """The page's text and its JSON."""
    path = module.publish(stated, entries, table.rows(entries), folder)
    return path.read_text(encoding="utf-8"), json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def published(solved, tmp_path_factory):
    """The cantilever's page and JSON."""
    scenes, entries = solved
    assert [entry.status for entry in entries] == ["ok"] * len(entries)
    return publish(cantilever, scenes[0], entries, tmp_path_factory.mktemp("page"))


def test_the_cantilever_says_what_the_solvers_found(published):
    """Printed rows 2 and 3 without grooves to 2e-4 m (they are rounded to 1e-4 m), with grooves to 1 %."""
    page, content = published
    figures = content["figures"]
    assert figures["table5_plain_max_difference"]["met"] and figures["table5_grooved_max_percent"]["met"]
    assert figures["reference_plain_error_percent"]["value"] is None  # one level has no band of its own
    assert 1.05 < figures["softening_ratio_reference"]["value"] < 1.2  # printed: 1.129
    for row in content["rows"]:
        assert f'<data value="{json.dumps(row["value"])}">' in page


def test_solved_surfaces_are_drawn(published):
    """Both solvers hand over a surface; the page has six pictures of them or says why not."""
    page = published[0]
    assert len(re.findall("<img src=", page)) == 6 or "Pictures missing." in page


def test_modes_from_the_scene_to_the_page(tmp_path, monkeypatch):
    """Both solvers on a thick steel plate: coarse meshes agree to 3 % on three frequencies, and each is on the page."""
    stated = {
        "ancf.levels": [{"mesh": [n, n], "element": "enriched"} for n in (2, 4)],
        "reference.levels": [{"size": 0.2}],
        "analysis.count": 3,
        "thickness": 0.1,
    }
    steel = load("plate_modes").override(stated)
    entries = study.run([steel], SOLVERS, "standard", tmp_path / "results", 2)
    assert [entry.status for entry in entries] == ["ok"] * 3
    drawn = []
    monkeypatch.setattr(sections.figures, "render", lambda jobs: (drawn.extend(jobs), ([], "not drawn"))[1])
    page, content = publish(scene, steel, entries, tmp_path)
    assert [row["mode"] for row in content["rows"]] == [1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert all(abs(row["error_reference_percent"]) < 3 for row in content["rows"][1::3])
    for row in content["rows"]:
        assert f'<data value="{json.dumps(row["value"])}">' in page
    assert [job.view for job in drawn] == ["mesh"] * 2 + ["mode"] * 6


def test_any_scene_is_published(solved, tmp_path):
    """The generic page of the plain plate."""
    scenes, entries = solved
    alone = [entry for entry in entries if entry.scene.name == "cantilever_plain"]
    page, content = publish(scene, scenes[1], alone, tmp_path)
    assert "Cantilever plate without grooves" in page
    assert len(content["rows"]) == 3 and len(content["convergence"]) == 2
    assert "groovecheck run cantilever_plain<" in page


def test_the_commands_of_a_page_name_the_budget_that_its_runs_need(solved):
    stated, entries = solved
    levels = [entry for entry in entries if entry.variant is None]
    quick = [replace(entry, level=entry.level.model_copy(update={"budget": "quick"})) for entry in levels]
    assert scene.paid(quick) == "quick" and scene.paid([*quick, *levels]) == "standard"
    varied = replace(quick[0], variant=study.AS_STATED, scene=load("cantilever"))
    assert scene.paid([*quick, varied]) == load("cantilever").sensitivity.budget == "standard"
    assert [typed for typed, _ in scene.commands(stated[0], "quick")] == [
        "groovecheck run cantilever --budget quick",
        "groovecheck table cantilever --budget quick --format json",
        "groovecheck explain cantilever --budget quick",
    ]
