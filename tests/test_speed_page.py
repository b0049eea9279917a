"""The speed exhibit: costs read off curves, units in processes of their own, the page of what was measured."""

import doctest
import json
from unittest import mock

import pytest

from reports import speed, speed_curves, speed_runs
from reports.speed_curves import NAMES, Curves, cheapest, cost_to
from reports.unit import Measured, command, measure


def test_the_doctests_hold():
    assert doctest.testmod(speed_curves).failed == 0


def test_a_cost_on_a_power_law_is_exact():
    """error = 8 / seconds^0.75: 1 % costs 16 s wherever the levels lie."""
    seconds = [1.0, 5.0, 40.0]
    assert cost_to([8 / t**0.75 for t in seconds], seconds, 1.0)[0] == pytest.approx(16.0, rel=1e-12)


def test_a_cost_is_read_where_the_error_stays_below():
    """An error that passes through zero and comes back is not yet below."""
    seconds, why = cost_to([5.0, 0.01, 2.0, 0.5], [1.0, 2.0, 4.0, 16.0], 1.0)
    assert seconds == pytest.approx(8.0) and why == ""


@pytest.mark.parametrize(
    ("errors", "why"), [([9.0, 3.0], "3 % away"), ([0.4, 0.1], "already within"), ([], "no level")]
)
def test_no_cost_is_extrapolated(errors, why):
    seconds, words = cost_to(errors, [1.0] * len(errors), 1.0)
    assert seconds is None and why in words


def test_a_unit_runs_alone_with_one_thread():
    measured = measure("speed_kernels.growth", mesh=3, seconds=0.01)
    assert measured.ok, measured.status
    assert [row["distinct"] for row in measured.get("rows")] == [1, 2]  # five grooves: the outer columns are images
    assert measured.get("peak_mb") > 0
    assert measured.command.endswith("-m reports.unit speed_kernels.growth mesh=3 seconds=0.01")


def test_a_failed_unit_says_why():
    measured = measure("speed_runs.ancf", scene="no_such_scene", mesh=2, time_step=0.1)
    assert measured.status.startswith("failed") and "no_such_scene" in measured.status
    assert measured.get("cpu_seconds") is None


def test_a_command_survives_the_shell():
    words = command("speed_runs.curve", {"sizes": [2, 4], "scene": "plain"})
    assert words.endswith("unit speed_runs.curve 'sizes=[2, 4]' scene=plain")


def row(series, mesh, h, height, seconds):
    known = {"unknowns": 10, "cpu_seconds": seconds, "peak_mb": 100.0, "status": "ok"}
    known |= {"steps": 50, "newton_iterations": 200, "factorisations": 20}
    return {"series": series, "mesh": mesh, "h": h, "height": height, "wall_seconds": seconds, **known}


@pytest.fixture
def curve():
    """All tend to -1 m with order 2; for the same error the reference takes ten times as long as the enriched
    element, and the conforming one twice as long."""
    meshes = (4, 8, 16, 32)
    rows = [row("conforming", f"{n}x{n}", 1 / n, -1 + n**-2.0, n**2 / 50) for n in meshes]
    rows += [row("enriched", f"{n}x{n}", 1 / n, -1 + n**-2.0, n**2 / 100) for n in meshes]
    rows += [row("reference", f"h={1 / n}", 1 / n, -1 + n**-2.0, n**2 / 10) for n in meshes]
    return Measured("curve", {"conforming": [4], "sizes": [0.5]}, "ok", {"rows": rows})


@pytest.fixture
def calculix():
    """CalculiX at the error of the reference in five times its time, both wall and CPU."""
    known = {"unknowns": 10, "steps": 50}
    return [
        Measured(
            "calculix",
            {"size": 1 / n},
            "ok",
            {"height": -1 + n**-2.0, "wall_seconds": n**2 / 2, "cpu_seconds": n**2 / 2, **known},
        )
        for n in (4, 8, 16)
    ]


def test_the_ratio_of_known_curves(curve, calculix):
    """1 % at n = 10: 1 s with the cheaper element, against 10 s and 50 s."""
    curves = Curves.of(curve, calculix)
    assert curves.target == pytest.approx(-1.0)
    assert curves.cost("enriched", 1.0)[0] == pytest.approx(1.0)
    assert curves.cost("conforming", 1.0)[0] == pytest.approx(2.0)
    assert curves.ratio(1.0)[0] == pytest.approx(10.0)
    assert curves.ratio(1.0, peer="calculix")[0] == pytest.approx(50.0)
    assert curves.ratio(0.01)[0] is None
    assert [words.partition(":")[0] for words in curves.why(1.0)] == [NAMES[name] for name in NAMES]
    assert all("within 1 % from" in words and ": 10 unknowns" in words for words in curves.why(1.0))
    assert Curves.of(curve).ratio(1.0, peer="calculix") == (None, mock.ANY)


def test_a_curve_keeps_the_least_of_its_rounds_and_has_more_of_those_that_costs_are_read_from(monkeypatch):
    """Every level twice, those that are looked at closer four times more; a round that failed changes nothing."""
    asked, times = [], iter([3.0, 2.5, 2.0, 2.0, 1.9, None])

    def one(conforming, enriched, sizes, time_step):
        asked.append((conforming, enriched, sizes))
        least = next(times)
        found = [row("enriched", f"{n}x{n}", 1 / n, -1.0, least or 0.1) for n in enriched]
        return [own | {"status": "ok" if least else "newton_diverged"} for own in found]

    monkeypatch.setattr(speed_runs, "_round", one)
    closer = {"enriched": [3], "sizes": [0.2]}
    rows = speed_runs.curve([4], [2, 3], [0.3, 0.2], closer=closer)["rows"]
    assert asked == [([4], [2, 3], [0.3, 0.2])] * 2 + [([], [3], [0.2])] * 4
    assert [(own["mesh"], own["wall_seconds"], own["status"]) for own in rows] == [
        ("2x2", 2.5, "ok"),
        ("3x3", 1.9, "ok"),
    ]


def test_the_cheapest_level_within_an_error():
    rows = [row("enriched", "2x2", 1, -0.98, 1.0), row("enriched", "4x4", 1, -0.995, 3.0)]
    rows += [row("enriched", "8x8", 1, -1.0, 2.0), row("reference", "h=1", 1, -1.0, 0.5)]
    assert cheapest(rows, "enriched", -1.0, 1.0)["mesh"] == "8x8"
    assert cheapest(rows, "conforming", -1.0, 1.0) is None


COSTS = {"enriched": 0.5, "reference": 4.0}


@pytest.fixture
def found(curve):
    """Everything a budget could measure, made up; CalculiX absent, the large mesh failed."""
    us = {f"{what}_us": 2.0 for what in ("force", "tangent", "assembled_force", "assembled_tangent")}
    plates = ("plain", "one groove", "five grooves")
    rows = [{"plate": name, "elements": 256, "distinct": 1, "setup_seconds": 0.1, **us} for name in plates]
    run = {
        "unknowns": 10,
        "steps": 100,
        "cpu_seconds": 1.5,
        "wall_seconds": 2.0,
        "split": {"force": 1.0},
        "height": -0.5,
    }
    rubber = {
        "element": "conforming",
        "volumetric": "relaxed",
        "plate": "four grooves",
        "elements": 240,
        "points": 32.4,
    }
    rubber |= {"force_us": 8.0, "tangent_us": 70.0}
    runs = [Measured("ancf", {"mesh": 16}, "ok", run)]
    paid = {"calls": {"force": 4}, "gflop": {"force": 0.5, "set-up": 0.4}, "bare": {"force": 0.03, "solve": 0.02}}
    paid |= {"split": {"set-up": 0.1, "force": 0.9}, "setup_seconds": 0.1}
    own_steps = [row(name, "m", 1, -1.0, cost) | {"time_step": 0.1} for name, cost in COSTS.items()]
    return {
        "load": 0.5,
        "kernels": Measured("kernels", {}, "ok", {"rows": rows, "tangent_groove_ratio": 1.25, "product_gflops": 9}),
        "growth": [Measured("growth", {"mesh": 16}, "ok", {"rows": rows})],
        "rubber": Measured("rubber", {}, "ok", {"rows": [rubber]}),
        "ancf": runs,
        "table5": None,
        "reference": [Measured("reference", {"size": 0.1}, "ok", {**run, "tetrahedra": 5})],
        "calculix": [Measured("calculix", {}, "absent: ccx is not on the path")],
        "exudyn": None,
        "many": Measured("newton", {"size": 0.01}, "failed: out of memory"),
        "curve": curve,
        "one_percent": [
            Measured("ancf", {"mesh": 4}, "ok", {**run, **paid}),
            Measured("reference", {"size": 0.2}, "ok", run),
        ],
        "curve_calculix": [Measured("calculix_run", {"size": 0.5}, "absent: ccx is not on the path")],
        "own_steps": Measured("own_steps", {}, "ok", {"rows": own_steps, "time_shift": -0.001}),
    }


def test_the_page_says_what_was_met_missed_absent_and_failed(found, tmp_path):
    path = speed.publish(found, "standard", tmp_path)
    page, content = path.read_text(encoding="utf-8"), json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    figures = content["figures"]
    assert set(figures) >= {
        *(
            "tangent_us",
            "force_us",
            "tangent_groove_ratio",
            "cantilever16_cpu_s",
            "table5_wall_s",
            "cost_ratio_1_percent",
        ),
        *("reference_5532_cpu_s", "calculix_cpu_ratio", "reference_100k_step_s", "reference_100k_newton_s"),
    }
    assert figures["tangent_us"] == {"value": 2.0, "unit": "µs", "bar": 15, "met": True}
    assert figures["tangent_groove_ratio"]["met"] is False
    assert figures["cost_ratio_1_percent"]["met"] is False
    assert figures["rubber_force_us"]["met"] is True and figures["rubber_tangent_us"]["met"] is False
    assert figures["cost_ratio_1_percent_calculix"]["value"] is None
    assert figures["cost_ratio_1_percent_own_steps"]["value"] == pytest.approx(8.0)
    assert figures["calculix_cpu_ratio"]["value"] is None and figures["table5_wall_s"]["met"] is None
    assert "ccx is not on the path" in page and "out of memory" in page
    assert "0.9 GFlop, set-up included, would take 0.1 s and the ratio would be 15." in page
    assert "set-up the ratio would be 30, with the present set-up 10." in page  # 1.5 s over 0.05 s, and over 0.15 s
    bound = figures["cost_ratio_1_percent_bound"]  # 0.5 GFlop at 9 GFlop/s
    assert bound["value"] == pytest.approx(1.5 / (0.5 / 9)) and bound["bar"] is None
    assert all(f"reports.unit {name}" in page for name in ("kernels", "ancf", "reference", "curve"))


@pytest.mark.slow
def test_the_quick_budget_measures_all_it_pays_for(tmp_path):
    found = speed.gather("quick")
    values = {figure.name: figure.value for figure in speed.figures(found)}
    assert values["tangent_us"] and values["force_us"] and values["cantilever16_cpu_s"]
    assert speed.publish(found, "quick", tmp_path).exists()
