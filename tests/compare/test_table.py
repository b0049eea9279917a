"""Rows of the table from made-up entries whose every number is known."""

import csv
import io
import json
from dataclasses import replace

import fake_solver
import numpy as np
import pytest
from rich.console import Console

from compare.formats import FORMATS, as_terminal
from compare.scene import AncfLevel, load
from compare.study import AS_STATED, Entry
from compare.table import (
    KEYS,
    convergences,
    element,
    judgements,
    rows,
    sensitivity,
)

SCENE = load("cantilever")
PLAIN = load("cantilever_plain")


def entry(scene, solver, level, value=None, status="ok", variant=None):
    """An entry with the height `value`, or one without a result where the status says crashed."""
    about = (scene, variant, solver, level)
    if status.startswith("crashed"):
        return Entry(*about, None, status, "", None, 0, True, "key")
    made = fake_solver.solve(scene, level)
    displacement = np.zeros_like(made.displacement)
    displacement[-1, :, 2] = np.nan if value is None else value
    result = replace(made, displacement=displacement, status=status, seconds=1.5, peak_mb=100.0)
    return Entry(*about, result, status, "", 1.5, 3, True, "key")


def ladder(scene, solver, values, statuses=()):
    levels = scene.ladder(solver)
    statuses = [*statuses, *["ok"] * len(values)]
    return [
        entry(scene, solver, level, value, status)
        for level, value, status in zip(levels, values, statuses, strict=False)
    ]


def squares(count, limit=-0.55, factor=0.4):
    """Values of a second-order ladder on the first ANCF meshes of the scene."""
    return [limit + factor / level.mesh[0] ** 2 for level in SCENE.ladder("ancf")[:count]]


def test_every_row_has_exactly_the_keys():
    found = rows(ladder(SCENE, "ancf", squares(4)) + ladder(SCENE, "reference", [-0.5, -0.54]))
    assert [tuple(row) for row in found] == [KEYS] * 6
    assert len(KEYS) == 22


def test_an_ancf_row_names_what_was_computed():
    row = rows(ladder(SCENE, "ancf", squares(1)))[0]
    named = {key: row[key] for key in ("solver", "element", "rule", "groove", "load", "mesh", "level", "status")}
    assert named == {
        "solver": "ancf",
        "element": "conforming",
        "rule": "3x3x2",
        "groove": "left+right",
        "load": "point",
        "mesh": "2x2",
        "level": 0,
        "status": "ok",
    }
    assert (row["unknowns"], row["h"], row["newton_iterations"]) == (48, 0.5, 7)
    assert (row["wall_seconds"], row["peak_mb"]) == (1.5, 100.0)


def test_a_reference_row_names_what_was_computed():
    row = rows(ladder(PLAIN, "reference", [-0.49, -0.5]))[0]
    assert (row["element"], row["rule"], row["groove"]) == ("P2 tetrahedron", None, "none")
    assert row["mesh"] == f"h={PLAIN.reference.levels[0].size:g}"


def test_value_is_the_height_of_the_first_probe_at_the_end():
    row = rows([entry(SCENE, "ancf", SCENE.ancf.levels[0], -0.4)])[0]
    assert row["value"] == -0.4
    high = SCENE.override({"probes.0.at": [1.0, 1.0, 0.01], "sensitivity": None})
    assert rows([entry(high, "ancf", SCENE.ancf.levels[0], -0.4)])[0]["value"] == pytest.approx(-0.39)


def test_paper_is_the_printed_row_or_the_converged_value():
    found = rows(ladder(SCENE, "ancf", [-0.4, -0.5]) + ladder(SCENE, "reference", [-0.56]))
    assert [row["paper"] for row in found] == [-0.4098, -0.4649, -0.5669]
    assert found[0]["error_paper_percent"] == pytest.approx(100 * (-0.4 + 0.4098) / -0.4098)
    assert found[2]["error_paper_percent"] == pytest.approx(100 * (0.5669 - 0.56) / -0.5669)


def test_reference_is_the_finest_successful_one_of_the_same_scene():
    failed = ladder(SCENE, "reference", [-0.5, -0.56, None], ["ok", "ok", "newton_diverged"])
    found = rows(ladder(SCENE, "ancf", [-0.42]) + failed + ladder(PLAIN, "reference", [-0.3]))
    assert found[0]["error_reference_percent"] == pytest.approx(100 * (-0.42 + 0.56) / -0.56)
    assert found[1]["error_reference_percent"] == pytest.approx(100 * (-0.5 + 0.56) / -0.56)
    assert found[2]["error_reference_percent"] is None  # itself
    assert found[3]["error_reference_percent"] is None  # failed
    assert found[4]["error_reference_percent"] is None  # the only one of its scene


def test_convergence_uses_the_rows_up_to_each_row():
    found = rows(ladder(SCENE, "ancf", squares(5)))
    assert [row["sequence"] for row in found] == [None, None, "monotone", "monotone", "monotone"]
    for row in found[2:]:
        assert row["order"] == pytest.approx(2.0, rel=1e-6)
        assert row["extrapolated"] == pytest.approx(-0.55, rel=1e-8)
        assert row["gci_percent"] == pytest.approx(100 * 1.25 * 0.4 * row["h"] ** 2 / -row["value"], rel=1e-6)


def test_series_of_other_rules_do_not_mix():
    level = SCENE.ancf.levels[0]
    levels = [level.model_copy(update={"mesh": (n, n), "points": p}) for n in (2, 4, 8) for p in ((3, 3, 2), (7, 7, 3))]
    scene = SCENE.model_copy(update={"ancf": SCENE.ancf.model_copy(update={"levels": tuple(levels)})})
    values = [-0.5 - (0.1 if lv.points == (3, 3, 2) else 0.2) / lv.mesh[0] ** 2 for lv in levels]
    found = rows([entry(scene, "ancf", lv, v) for lv, v in zip(levels, values, strict=True)])
    assert [row["level"] for row in found] == [0, 0, 1, 1, 2, 2]
    assert [row["order"] for row in found[4:]] == pytest.approx([2, 2], rel=1e-6)


def test_levels_with_and_without_an_allowed_error_are_two_series():
    first = SCENE.reference.levels[0]
    levels = [
        first.model_copy(update={"size": h, "error_per_step": e}) for h in (0.4, 0.2, 0.1) for e in (None, 1e-5, 1e-6)
    ]
    scene = SCENE.model_copy(update={"reference": SCENE.reference.model_copy(update={"levels": tuple(levels)})})
    factor = {None: 0.1, 1e-5: 0.2, 1e-6: 0.3}
    values = [-0.5 - factor[level.error_per_step] * level.size**2 for level in levels]
    found = rows([entry(scene, "reference", level, v) for level, v in zip(levels, values, strict=True)])
    assert [row["level"] for row in found] == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert [row["extrapolated"] is not None for row in found] == [False] * 6 + [True] * 3


@pytest.mark.parametrize("status", ["newton_diverged", "crashed: killed by SIGKILL"])
def test_a_failed_level_is_a_row_without_numbers_and_refuses_later_bands(status):
    entries = ladder(SCENE, "ancf", squares(5), ["ok", status])
    found = rows(entries)
    assert found[1]["status"] == status
    assert [found[1][key] for key in ("value", "error_paper_percent", "order", "gci_percent")] == [None] * 4
    assert [row["gci_percent"] for row in found] == [None] * 5
    assert convergences(entries)[4].refused == f"failed level: 3x3 {status}"
    assert convergences(entries)[0].refused.startswith("fewer than three levels")


def test_an_oscillating_ladder_shows_its_type_and_no_number():
    row = rows(ladder(SCENE, "ancf", [-0.5, -0.6, -0.55]))[2]
    assert (row["sequence"], row["order"], row["extrapolated"], row["gci_percent"]) == ("oscillating", *[None] * 3)


def test_level_index_does_not_depend_on_the_budget():
    last = SCENE.ladder("ancf")[-1]
    assert rows([entry(SCENE, "ancf", last, -0.5)])[0]["level"] == len(SCENE.ladder("ancf")) - 1


def test_judgements_trace_each_number_to_its_source():
    entries = ladder(SCENE, "ancf", squares(3)) + ladder(SCENE, "reference", [-0.5, -0.56])
    found = judgements(entries)
    assert len(found) == len(rows(entries))
    assert found[1]["paper"]["kind"] == "published"
    assert (found[1]["paper"]["cell"], found[1]["paper"]["value"]) == (SCENE.published.rows[1].cell, -0.4649)
    assert found[1]["reference"]["kind"] == "cross-code"
    assert found[1]["reference"]["value"] == -0.56
    assert found[1]["band_refused"] == "fewer than three levels: 2"
    assert found[2]["band_refused"] is None
    assert {value["kind"] for value in found[0]["cross_code"]} == {"cross-code"}


def test_whether_the_rule_is_the_one_of_the_printed_row_is_said():
    level = PLAIN.ladder("ancf")[0]
    entries = [entry(PLAIN, "ancf", level.model_copy(update={"points": p}), -0.3) for p in ((3, 3, 2), (4, 4, 4))]
    scene = PLAIN.override({"ancf": {"levels": [e.level.model_dump() for e in entries]}, "sensitivity": None})
    found = judgements([replace(e, scene=scene) for e in entries])
    stated = PLAIN.published.rows[0].points
    assert [one["paper"]["rule_agrees"] for one in found] == [stated and p == stated for p in ((3, 3, 2), (4, 4, 4))]


def test_variants_are_no_rows_but_a_list_of_their_own():
    level = SCENE.sensitivity.ancf
    entries = [
        entry(SCENE, "ancf", SCENE.ancf.levels[0], -0.4),
        entry(SCENE, "ancf", level, -0.5, variant=AS_STATED),
        entry(SCENE, "ancf", level, -0.49, variant="top face"),
        entry(SCENE, "ancf", level, None, "newton_diverged", "deeper"),
    ]
    assert len(rows(entries)) == 1
    found = sensitivity(entries)
    assert [one["variant"] for one in found] == [AS_STATED, "top face", "deeper"]
    assert found[1]["change"] == pytest.approx(0.01)
    assert found[1]["change_percent"] == pytest.approx(-2.0)
    assert (found[2]["value"], found[2]["change"], found[2]["status"]) == (None, None, "newton_diverged")


MADE = rows(ladder(SCENE, "ancf", squares(4), ["ok", "crashed: a | b"]) + ladder(SCENE, "reference", [-0.5]))


def test_json_is_the_list_of_rows():
    assert json.loads(FORMATS["json"](MADE)) == MADE


def test_csv_has_every_number_in_full():
    found = list(csv.DictReader(io.StringIO(FORMATS["csv"](MADE))))
    assert tuple(found[0]) == KEYS
    assert [float(row["value"] or "nan") for row in found] == pytest.approx(
        [np.nan if row["value"] is None else row["value"] for row in MADE], rel=0, abs=0, nan_ok=True
    )
    assert found[-1]["rule"] == ""


def test_markdown_has_one_cell_per_key():
    lines = FORMATS["md"](MADE).splitlines()
    assert len(lines) == len(MADE) + 2
    assert {line.replace("\\|", "").count("|") for line in lines} == {len(KEYS) + 1}


def test_terminal_tables_show_solver_value_and_failure():
    console = Console(width=160, file=io.StringIO())
    for drawn in as_terminal(MADE):
        console.print(drawn)
    text = console.file.getvalue()
    assert all(word in text for word in ("ancf (conforming)", "left+right", "-0.45000", "crashed", "P2 tetrahedron"))


def test_levels_that_spend_on_grooves_are_rows_of_their_own():
    even = AncfLevel(mesh=(4, 4), element="enriched", time_step=0.1)
    spent = [
        even,
        even.model_copy(update={"fit": ()}),
        even.model_copy(update={"fit": (0.8,), "enrich": 0.9}),
    ]
    assert [element(level) for level in spent] == [
        "enriched",
        "enriched, fitted",
        "enriched, fitted 0.8, layers to 0.9",
    ]
