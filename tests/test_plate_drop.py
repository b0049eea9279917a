"""The plate drop's frame: its scenes, what its figures make of runs, a page from few of them, and two runs for real."""

import importlib
import inspect
import json

import numpy as np
import pytest

from compare import gate
from compare.scene import BUDGETS
from reports.hard_cases.chapter import Asked, Outcome
from reports.plate_drop import hard, page, runs, study
from reports.plate_drop.scenes import FALL, drop, resting
from reports.unit import Measured


def test_scenes_state_the_papers_tables_and_one_ground_for_both_laws():
    by_point, level = drop("points", {"mesh": [1, 1], "time_step": 5e-3})
    by_area, _ = drop("pressure", {"mesh": [1, 1], "time_step": 5e-3})
    ground, other = by_point.obstacles[0], by_area.obstacles[0]
    assert (ground.stiffness, ground.damping, ground.friction) == (8500.0, 20.0, 0.75)
    assert (other.stiffness, other.damping) == (63 * 8500.0, 63 * 20.0)
    assert ground.shape.point[2] == pytest.approx(-0.025 - FALL)
    assert level.points == (7, 3, 3) and level.element == "conforming"
    rest, _ = resting("pressure", {"mesh": [1, 1], "time_step": 0.5})
    assert rest.analysis.kind == "static" and rest.obstacles[0].damping == 0


@pytest.mark.parametrize("budget", BUDGETS)
def test_every_unit_is_a_function_that_takes_what_it_is_asked(budget):
    for _, asked in study.units(budget):
        module, _, name = asked.name.rpartition(".")
        function = getattr(importlib.import_module(f"reports.{module}"), name)
        inspect.signature(function).bind(**asked.arguments)


def made_up(asked, rebound=0.03, peak=1000.0):
    """Numbers of a unit's kind without a solve."""
    t = np.linspace(0, 1, 21)
    values = {
        "lowest": -0.03,
        "rebound": rebound,
        "peak_force": peak,
        "energy_residual": 0.01,
        "floor_pressed": 0.0,
        "times": t.tolist(),
        "centre": t.tolist(),
        "height": (rebound * t).tolist(),
        "force": t.tolist(),
        "x": [0.4, 0.6],
        "y": [0.2, 0.4],
        "pressure": [0.0, 3.0],
        "sunk": 0.01,
        "reaction": 1.0,
        "pressed": 0.2,
        "value": 1.0,
        "expected": 1.0,
        "ended": "ok",
        "creep": 0.0,
        "counts": [1, 2],
        "flight": [1.0, 1.1],
        "ground": [2.0, 3.0],
        "points": [10, 20],
    }
    return Outcome(asked, Measured(asked.name, asked.arguments, "ok", values))


def all_made_up(**solid):
    found = {}
    for part, asked in study.units("quick"):
        is_solid = asked.arguments.get("solver") == "reference"
        found.setdefault(part, []).append(made_up(asked, **(solid if is_solid else {})))
    return found


def figure(found, name):
    return next(figure for figure in page.figures(found) if figure.name == name)


def test_the_difference_is_the_worst_of_three_and_none_without_the_solid():
    found = all_made_up(rebound=0.03, peak=1000.0 / 1.03)
    assert figure(found, "drop_difference_percent").value == pytest.approx(3.0)
    assert figure(found, "drop_difference_percent").met is False
    found["compared"] = [o for o in found["compared"] if o.asked.arguments.get("solver") != "reference"]
    assert figure(found, "drop_difference_percent").met is None


def test_no_force_on_a_floor_without_contact_points_is_no_evidence():
    found = all_made_up()
    assert figure(found, "groove_force_at_1s").met
    found["grooves"][0].measured.values["floor_pressed"] = None
    assert figure(found, "groove_force_at_1s").met is None


def test_the_energy_is_that_of_every_rule_too():
    found = all_made_up()
    found["subdomains"][0].measured.values["energy_residual"] = 0.6
    assert figure(found, "energy_residual_percent").met is False


def test_a_study_whose_units_failed_does_not_end_well(tmp_path, monkeypatch, capsys):
    """Status 0 where all is met, 1 where a figure has no value because its unit failed."""
    for broken, status in ((False, 0), (True, 1)):
        found = all_made_up()
        if broken:
            first = found["subdomains"][-1].asked
            found["subdomains"][-1] = Outcome(first, Measured(first.name, first.arguments, "failed: it broke"))
        monkeypatch.setattr(study, "run", lambda budget, jobs, take, found=found: found)
        monkeypatch.setattr(study, "publish", lambda *_: tmp_path)
        assert study.main(["--budget", "quick"]) == status
    assert "not judged" in capsys.readouterr().out


def test_a_hard_case_that_is_wrong_in_silence_or_fails_as_it_may_not_counts():
    """Only the trapezoidal rule on a stiff ground may say that it lost the energy, and nothing else."""
    told = {"stiffness": 1.0, "step": 0.01}
    stiff = told | {"integrator": "trapezoidal"}
    right, named, wrong, lost, other, unnamed = (
        Outcome(
            Asked("plate_drop.hard.landing", asked),
            Measured("plate_drop.hard.landing", asked, "ok", {"ended": ended, "energy_residual": drift, **more}),
        )
        for asked, ended, drift, more in (
            (told, "ok", 0.1, {}),
            (stiff, "energy_not_kept", 50.0, {}),
            (told, "ok", 0.1, {"value": 1.02, "expected": 1.0}),
            (told, "ok", 50.0, {}),
            (stiff, "newton_diverged", 0.1, {}),
            (told, "energy_not_kept", 50.0, {}),
        )
    )
    crashed = Outcome(right.asked, Measured(right.asked.name, {}, "failed: ValueError"))
    found = all_made_up() | {"hard": [right, named]}
    assert figure(found, "hard_cases_failed").value == 0
    found["hard"] += [wrong, lost, other, unnamed, crashed]
    assert figure(found, "hard_cases_failed").value == 5


def test_the_gate_knows_every_run_by_its_own_name_and_refuses_one_that_failed(tmp_path):
    found = all_made_up()
    rows = study.gate_rows(found)
    assert len({row["case"] for row in rows}) == len(rows) > 60
    assert not any("integrator trapezoidal" in row["case"] for row in rows if row["case"].startswith("hard"))
    accepted = gate.accept(rows, "a test", "plate_drop", tmp_path / "plate_drop.json")
    assert gate.check(rows, accepted).passed
    first = found["compared"][0].asked
    found["compared"][0] = Outcome(first, Measured(first.name, first.arguments, "failed: it broke"))
    verdict = gate.check(study.gate_rows(found), accepted)
    assert [margin.verdict for margin in verdict.margins if margin.refused] == ["failed"] * 3


def test_the_page_has_every_part_and_a_failed_unit_is_a_row_of_it(tmp_path):
    found = all_made_up()
    for outcomes in found.values():
        first = outcomes[0].asked
        outcomes[0] = Outcome(first, Measured(first.name, first.arguments, "failed: it broke"))
    text = study.publish(found, "quick", tmp_path).read_text(encoding="utf-8")
    for title in ("Points and subdomains", "Against the solid", "Hard cases of contact", "it broke"):
        assert title in text
    content = json.loads((tmp_path / "plate_drop.json").read_text(encoding="utf-8"))
    assert len(content["rows"]) == len(study.units("quick"))
    assert "times" not in content["rows"][0]


def test_the_papers_plate_falls_and_keeps_its_energy():
    """Coarsely: the floor of the groove is free at 1 s, the rebound lower than the fall."""
    found = runs.fall("points", element="conforming", mesh=[1, 1], points=[7, 3, 3], time_step=5e-3)
    assert found["status"] == "ok"
    assert found["floor_pressed"] == 0  # of points that are there: None without any
    assert 0 < found["rebound"] < FALL
    assert found["energy_residual"] < 1e-6
    assert max(found["pressure"]) > 0


def test_a_laid_plate_presses_with_its_weight():
    assert runs.rest("pressure", element="conforming", mesh=[1, 1])["reaction"] == pytest.approx(1.0, abs=1e-9)


def test_a_stiff_plate_stops_where_it_should():
    found = hard.stopping(step=4e-3)
    assert found["value"] == pytest.approx(found["expected"], rel=0.01)
