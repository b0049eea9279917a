"""The gate passes what did not change and refuses what did, naming the row."""

import json

import pytest

import ancf.run
from compare import gate, study, table
from compare.scene import load
from reports.frame import BASELINES
from tests.compare.scene_changes import GONE, changed


def row(mesh="2x2", value=-0.4, status="ok", **changes):
    stated = {"solver": "ancf", "element": "conforming", "rule": "3x3x2", "groove": "none", "load": "point"}
    return {**dict.fromkeys(table.KEYS), **stated, "mesh": mesh, "value": value, "status": status, **changes}


ROWS = [row("2x2", -0.4), row("4x4", -0.5), row("h=0.2", -0.52, solver="reference", rule=None)]


@pytest.fixture
def baseline(tmp_path):
    return gate.accept(ROWS, "first", "plate", tmp_path / "plate.json")


def verdicts(rows, baseline, **here):
    found = gate.check(rows, baseline, {**gate.platform_now(), **here})
    return {margin.row: margin.verdict for margin in found.margins}, found.passed


def test_equal_rows_pass_with_full_margin(baseline):
    found = gate.check(ROWS, baseline)
    assert found.passed
    assert found.same_platform
    assert [(margin.verdict, margin.change, margin.used) for margin in found.margins] == [("ok", 0, 0)] * 3


@pytest.mark.parametrize(("factor", "passed"), [(1 + 0.9e-6, True), (1 - 0.9e-6, True), (1 + 1.1e-6, False)])
def test_the_tolerance_on_the_same_platform_is_1e_6(baseline, factor, passed):
    found = gate.check([ROWS[0], row("4x4", -0.5 * factor), ROWS[2]], baseline)
    assert found.passed is passed
    moved = [margin.row for margin in found.margins if margin.verdict == "moved"]
    assert moved == [] if passed else ["4x4" in name for name in moved] == [True]


@pytest.mark.parametrize(("factor", "passed"), [(1 + 0.9e-4, True), (1 + 1.1e-4, False)])
def test_the_tolerance_across_platforms_is_1e_4(baseline, factor, passed):
    found = gate.check([row("2x2", -0.4 * factor), *ROWS[1:]], baseline, {**gate.platform_now(), "numpy": "1.0"})
    assert found.passed is passed
    assert not found.same_platform
    assert found.differs == (f"numpy: {study.version('numpy')} -> 1.0",)


def test_a_missing_row_is_refused(baseline):
    found, passed = verdicts(ROWS[1:], baseline)
    assert not passed
    assert list(found.values()) == ["missing", "ok", "ok"]


@pytest.mark.parametrize("status", ["newton_diverged", "crashed: killed by SIGKILL"])
def test_a_failed_row_is_refused(baseline, status):
    found, passed = verdicts([row("2x2", None, status), *ROWS[1:]], baseline)
    assert not passed
    assert list(found.values()) == ["failed", "ok", "ok"]


def test_a_value_that_is_no_number_is_refused(baseline):
    assert not verdicts([row("2x2", float("nan")), *ROWS[1:]], baseline)[1]


def test_a_new_row_is_reported_and_passes_but_a_new_failure_does_not(baseline):
    found, passed = verdicts([*ROWS, row("8x8", -0.55)], baseline)
    assert passed
    assert list(found.values())[-1] == "new"
    assert not verdicts([*ROWS, row("8x8", None, "not_finite")], baseline)[1]


def test_rows_of_equal_identity_are_told_apart_by_their_order(tmp_path):
    twins = [row(value=-0.4), row(value=-0.41)]
    baseline = gate.accept(twins, "two time steps", "plate", tmp_path / "plate.json")
    assert verdicts(twins, baseline)[1]
    assert not verdicts(twins[::-1], baseline)[1]
    assert not verdicts(twins[:1], baseline)[1]


def test_a_height_of_zero_is_compared_without_dividing_by_it(tmp_path):
    baseline = gate.accept([row(value=0.0)], "flat", "plate", tmp_path / "plate.json")
    assert verdicts([row(value=1e-16)], baseline)[1]
    assert not verdicts([row(value=1e-14)], baseline)[1]


def test_accepts_keep_their_reasons_dates_and_commits(tmp_path, baseline):
    path = tmp_path / "plate.json"
    gate.accept([row("2x2", -0.45)], "  thinner clamp ", "plate", path)
    stored = gate.read(path)
    assert [entry["reason"] for entry in stored["accepts"]] == ["first", "thinner clamp"]
    assert set(stored["accepts"][1]) == {"date", "reason", "commit"}
    assert stored["rows"] == [{**{key: row()[key] for key in gate.IDENTITY}, "value": -0.45}]
    assert stored["platform"] == gate.platform_now()


def test_nothing_is_accepted_without_a_reason_or_with_a_failed_row(tmp_path):
    path = tmp_path / "plate.json"
    with pytest.raises(gate.BaselineError, match="reason"):
        gate.accept(ROWS, "  ", "plate", path)
    with pytest.raises(gate.BaselineError, match=r"no value: .*4x4"):
        gate.accept([ROWS[0], row("4x4", None, "not_finite")], "why not", "plate", path)
    assert not path.exists()


def test_a_missing_or_damaged_baseline_is_an_error_with_its_path(tmp_path):
    path = tmp_path / "plate.json"
    with pytest.raises(gate.BaselineError, match=r"plate.json: no baseline yet"):
        gate.read(path)
    for text in ("{", "[]", json.dumps({"schema": 99})):
        path.write_text(text)
        with pytest.raises(gate.BaselineError, match=r"plate.json: not a baseline"):
            gate.read(path)


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"platform": GONE}, "platform"),
        ({"platform": None, "accepts": {}}, "platform, accepts"),
        ({"tolerance.across": GONE}, "tolerance.across"),
        ({"rows.1.value": GONE, "rows.2": 3}, "rows.1.value, rows.2.value"),
    ],
)
def test_what_a_baseline_lacks_is_named(tmp_path, baseline, changes, wrong):
    path = tmp_path / "plate.json"
    path.write_text(json.dumps(changed(changes, baseline)))
    with pytest.raises(gate.BaselineError, match=rf"plate.json: missing or wrong in it: {wrong}; restore the file"):
        gate.read(path)
    with pytest.raises(gate.BaselineError, match="missing or wrong"):
        gate.accept(ROWS, "again", "plate", path)


@pytest.mark.parametrize("path", sorted(BASELINES.glob("*.json")), ids=lambda path: path.stem)
def test_the_accepted_tables_are_whole(path):
    if path.stem != "tire_solids":  # a record of solids, no table
        assert gate.read(path)["rows"]


def test_lines_show_each_rows_margin_and_the_platform(baseline):
    lines = gate.lines(gate.check([row("2x2", -0.4 * (1 + 5e-7)), row("4x4", -0.51), ROWS[2]], baseline))
    assert "50 % of tolerance" in lines[0]
    assert lines[-2].startswith("moved")
    assert "4x4" in lines[-2]
    assert "same platform" in lines[-1]


def test_a_stiffness_changed_by_a_thousandth_is_refused_with_its_rows(tmp_path):
    """With the real plate solver, and also against the wide tolerance that holds across platforms."""
    levels = [{"mesh": [n, n], "time_step": 0.02, "budget": "quick"} for n in (2, 3)]
    stated = {
        "ancf": {"element": "conforming", "points": [3, 3, 2], "levels": levels},
        "reference": None,
        "sensitivity": None,
        "published": None,
    }
    scene = load("cantilever_plain").override(stated)

    def rows(**changes):
        changed = scene.override(changes)
        results = [(level, ancf.run.solve(changed, level)) for level in changed.ladder("ancf")]
        about = (None, "ancf")
        return table.rows(
            [study.Entry(changed, *about, level, r, r.status, "", r.seconds, 1, True, "") for level, r in results]
        )

    accepted = gate.accept(rows(), "the stated stiffness", scene.name, tmp_path / "plate.json")
    assert gate.check(rows(), accepted).passed
    stiffer = rows(**{"material.youngs_modulus": 2e6 * 1.001})
    for here in (None, {**gate.platform_now(), "machine": "another"}):
        found = gate.check(stiffer, accepted, here)
        assert not found.passed
        refused = [margin.row for margin in found.margins if margin.refused]
        assert [name.rpartition("mesh ")[2] for name in refused] == ["2x2", "3x3"]
