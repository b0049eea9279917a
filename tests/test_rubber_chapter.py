"""The chapter of rubber plates: its question, its rows, and how a failure shows."""

import pytest

from reports.hard_cases import rubber
from reports.hard_cases.chapter import Outcome
from reports.hard_cases.rubber_runs import MU, bulk, heights, plate
from reports.unit import Measured


def test_the_bulk_modulus_is_that_of_poissons_ratio():
    """E = 9 k mu / (3 k + mu) = 2 mu (1 + nu)."""
    for nu in (0.3, 0.4999):
        assert 9 * bulk(nu) * MU / (3 * bulk(nu) + MU) == pytest.approx(2 * MU * (1 + nu))


def test_a_plate_of_rubber_bends_at_rest_and_keeps_its_volume():
    """Between the square's beam bound and nothing; J at one point to 1e-3: k = 1000 mu."""
    level = {"element": "enriched", "mesh": [2, 2], "time_step": 0.5}
    row = heights(rubber.NEARLY, "static", "ancf", [level])["rows"][0]
    assert row["status"] == "ok" and -0.6 < row["height"] < -0.4
    assert row["J"] == pytest.approx(1.0, abs=1e-3)


def test_both_questions_state_the_probe_of_det_f():
    for mode in ("static", "dynamic"):
        assert [p.name for p in plate(0.49, mode).probes if getattr(p, "volume_ratio", False)] == ["J"]


@pytest.mark.parametrize("budget", ["quick", "standard", "full"])
def test_a_unit_that_died_is_missed_cases_without_numbers(budget):
    dead = [Outcome(a, Measured(a.name, a.arguments, "failed: killed", {})) for a in rubber.units(budget)]
    cases = rubber.present(dead).cases
    assert cases and {(case.value, case.met) for case in cases} == {(None, False)}
    assert len({case.name for case in cases}) == len(cases)
