"""The chapter on elements: what its units measure and how it judges them, without running its ladders."""

import pytest

from reports.hard_cases import elements, elements_runs
from reports.hard_cases.chapter import Outcome
from reports.hard_cases.elements_reference import REFERENCE
from reports.unit import Measured


def outcome(unit, rows, **arguments):
    asked = elements.Asked(elements.RUNS + unit, arguments)
    return Outcome(asked, Measured(asked.name, arguments, "ok", {"rows": rows}))


def test_bent_state_is_represented_on_bilinear_maps():
    """The nodal vectors of w = x^2 / 2 + x y, edge vectors included: Kirchhoff's energy to round-off."""
    assert elements_runs._patch("enriched", "trapezoids", "bend", 0.3) == pytest.approx(1, abs=1e-9)
    assert elements_runs._patch("acm", "trapezoids", "stretch", 0.3) == pytest.approx(1, abs=1e-9)


def test_a_strip_and_a_graded_plate():
    """50 times as long as wide: the exact tip. The graded plate: -8.8972e-4 m, as an independent script found."""
    assert elements_runs._strip("enriched", 0.0025, 0.005, 4)["ratio"] == pytest.approx(1, abs=1e-5)
    found = elements_runs.graded("static", 0.05, 0)["rows"][0]
    assert found["status"] == "ok" and found["height"] == pytest.approx(-8.8972e-4, abs=1e-8)


def test_figures_take_the_worst_error_and_fail_with_a_failed_run():
    limit, _ = elements._limits([])["plain", 0.0, "static"]
    rows = [{"mesh": n, "h": 1 / n, "height": limit * (1 + e), "unknowns": 1, "status": "ok", "cpu_seconds": 1.0}
            for n, e in ((4, -0.004), (8, 0.001))]  # fmt: skip
    about = {"element": "enriched", "kind": "plain", "nu": 0.0, "mode": "static", "enrich": None}
    figures = {f.name: f for f in elements.present([outcome("heights", rows, **about)]).figures}
    assert figures["plain_4x4_percent"].value == pytest.approx(0.4) and figures["plain_4x4_percent"].met
    assert figures["plain_8x8_percent"].value == pytest.approx(0.1)
    assert figures["grooved_5x5_percent"].met is None and figures["time_gain_over_conforming"].met is None
    rows[0] |= {"height": None, "status": "newton_diverged"}
    figures = {f.name: f for f in elements.present([outcome("heights", rows, **about)]).figures}
    assert figures["plain_4x4_percent"].value is None


def test_the_grooved_plate_is_judged_with_its_layers_and_shown_without():
    """Both on the same meshes: 2 % off without, 0.2 % with them."""
    limit, _ = elements._limits([])["groove", 0.3, "dynamic"]
    outcomes = []
    for enrich, error in ((None, -0.02), (0.99, -0.002)):
        rows = [{"mesh": n, "h": 1 / n, "height": limit * (1 + error), "unknowns": 7 * n * n, "status": "ok",
                 "cpu_seconds": 1.0} for n in (5, 10)]  # fmt: skip
        about = {"element": "enriched", "kind": "groove", "nu": 0.3, "mode": "dynamic", "enrich": enrich}
        outcomes.append(outcome("heights", rows, **about))
    chapter = elements.present(outcomes)
    figure = next(f for f in chapter.figures if f.name == "grooved_10x10_percent")
    assert figure.value == pytest.approx(0.2) and figure.met and "without layers" in figure.note
    assert "-2.00 %" in figure.note and "700 unknowns" in figure.note
    assert len({case.name for case in chapter.cases}) == 4


def test_every_recorded_ladder_has_a_limit():
    """Beyond its finest level, downwards, by less than 1 %."""
    for key, (limit, rest) in elements._limits([]).items():
        assert limit < min(REFERENCE[key].values()) and rest < 0.01 * abs(limit)
