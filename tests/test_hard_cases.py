"""The hard cases' frame: what a case is worth, what a failed unit does, what the page and the gate see of it."""

import importlib
import json
import math
import sys
from types import SimpleNamespace

import pytest

from compare import gate
from reports import frame
from reports.hard_cases import study
from reports.hard_cases.chapter import Asked, Case, Chapter, case_table

CASE = dict(name="strip", solver="ancf", level="4x4", unit="N", against="exact: a line")


@pytest.mark.parametrize(
    ("value", "expected", "allowed", "met"),
    [
        (1.009, 1.0, 1.0, True),
        (-1.009, -1.0, 1.0, True),
        (1.011, 1.0, 1.0, False),
        (5.0, 1.0, None, None),
        (None, 1.0, 1.0, False),
        (math.nan, 1.0, 1.0, False),
        (math.nan, 1.0, None, False),
        (1.0, None, 1.0, False),
    ],
)
def test_a_case_is_met_within_its_tolerance_and_a_missing_number_never(value, expected, allowed, met):
    assert Case(**CASE, value=value, expected=expected, allowed=allowed).met is met


def test_a_failure_is_met_only_where_failing_is_what_the_case_shows():
    failed = dict(CASE, value=None, expected=1.0, allowed=1.0, status="newton_diverged")
    assert Case(**failed).met is False
    shown = ("newton_diverged",)
    assert Case(**failed, may_fail=shown).met is True
    assert Case(**dict(failed, status="failed: killed"), may_fail=shown).met is False
    assert Case(**dict(failed, value=math.nan, status="ok"), may_fail=shown).met is False


def test_the_table_leaves_out_columns_that_no_case_fills():
    table = case_table("Strips", [Case(**CASE, value=1.0)])
    keys = [column.key for column in table.columns]
    assert "value" in keys and "expected" not in keys and "margin" not in keys


def unit_line(slope):
    """A unit of the made-up chapter."""
    return {"value": 2.0 * slope}


def present(outcomes):
    cases = [
        Case(**dict(CASE, name=f"slope {o.asked.arguments['slope']}", status=o.measured.status), value=o.get("value"))
        for o in outcomes
    ]
    return Chapter(cases, [], [case_table("Lines", cases)])


@pytest.fixture
def line(monkeypatch):
    """A chapter of two units, one of which fails; units run here instead of in processes."""
    from reports.unit import Measured

    def measure(name, **arguments):
        if isinstance(arguments["slope"], str):
            return Measured(name, arguments, "failed: not a number")
        return Measured(name, arguments, "ok", unit_line(**arguments))

    asked = [Asked("hard_cases.line.unit_line", {"slope": slope}) for slope in (3.0, "steep")]
    monkeypatch.setitem(
        sys.modules,
        "reports.hard_cases.line",
        SimpleNamespace(TITLE="Lines", units=lambda budget: asked, present=present),
    )
    monkeypatch.setattr(frame, "measure", measure)
    return study.run(["line"], "quick")


def test_a_failed_unit_is_a_row_with_its_name_and_loses_nothing(line, tmp_path):
    assert [case.value for case in line["line"].cases] == [6.0, None]
    page = study.publish(line, "quick", tmp_path)
    content = json.loads(page.with_suffix(".json").read_text(encoding="utf-8"))
    assert content["figures"]["benchmarks_failed"] == {"value": 1, "unit": "", "bar": 0, "met": False}
    assert "failed: not a number" in content["notes"]["benchmarks_failed"]["note"]
    assert [row["verdict"] for row in content["rows"]] == ["shown", "missed"]
    assert "failed: not a number" in page.read_text(encoding="utf-8")


def test_the_gate_knows_a_case_by_chapter_name_solver_and_level(line, tmp_path):
    rows = [row for row in study.gate_rows(line) if row["status"] == "ok"]
    baseline = gate.accept(rows, "made up", "hard_cases", tmp_path / "hard_cases.json")
    assert gate.check(rows, baseline).passed
    moved = [{**row, "value": row["value"] * 1.001} for row in rows]
    verdict = gate.check(moved, baseline)
    assert not verdict.passed and "line: slope 3.0" in verdict.margins[0].row and verdict.margins[0].unit == "N"


@pytest.mark.parametrize("name", study.CHAPTERS)
def test_every_chapter_says_what_it_asks_at_each_budget(name):
    part = study.chapter(name)
    asked = {budget: part.units(budget) for budget in ("quick", "standard", "full")}
    assert part.TITLE and 0 < len(asked["quick"]) <= len(asked["standard"]) <= len(asked["full"])
    for unit in asked["full"]:
        module, _, function = unit.name.rpartition(".")
        assert callable(getattr(importlib.import_module(f"reports.{module}"), function))
        json.dumps(unit.arguments)


def test_a_measurement_is_kept_until_anything_changes(tmp_path, monkeypatch):
    """Read the second time; measured again for other arguments, other sources, a damaged file, and after a crash."""
    from reports import keep
    from reports.unit import Measured

    made = []

    def measure(name, **arguments):
        made.append(arguments)
        return Measured(name, arguments, "failed: oh" if arguments["a"] == 3 else "ok", {"value": arguments["a"]})

    monkeypatch.setattr(keep, "measure", measure)
    monkeypatch.setattr(keep, "sources", lambda: "one")
    folder = keep.tidy(tmp_path / "units")
    for a, count in ((1, 1), (1, 1), (2, 2), (3, 3), (3, 4)):
        assert keep.kept(folder, "x.y", {"a": a}).get("value") == a
        assert len(made) == count
    monkeypatch.setattr(keep, "sources", lambda: "two")
    keep.kept(folder, "x.y", {"a": 1})
    assert len(made) == 5
    for path in folder.iterdir():
        path.write_text("{")
    assert keep.kept(folder, "x.y", {"a": 1}).ok and len(made) == 6


def test_the_sources_of_a_measurement_are_the_whole_project():
    """An edit of any file that a unit might import changes the key."""
    from reports import keep

    assert set(keep.PACKAGES) == {"ancf", "reference_fe", "compare", "reports"} and len(keep.sources()) == 64


@pytest.mark.parametrize("name", study.CHAPTERS)
def test_a_chapter_whose_units_all_failed_is_still_presented(name):
    """Nothing of it is met: each case is missed, or shown without a number, and no figure passes."""
    from reports.hard_cases.chapter import Outcome
    from reports.unit import Measured

    part = study.chapter(name)
    lost = [Outcome(unit, Measured(unit.name, unit.arguments, "failed: it broke")) for unit in part.units("quick")]
    found = part.present(lost)
    assert found.cases and not any(case.met for case in found.cases if not case.may_fail)
    assert not any(figure.met for figure in found.figures)
