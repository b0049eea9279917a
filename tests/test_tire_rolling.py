"""The tire that rolls, slides, bounces, and what is left out of it: the page judges what it is given."""

import numpy as np
import pytest

from compare.report import Page, render
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import bounces, page, rolling, savings
from reports.tire.scenes import stated
from reports.unit import Measured

T = np.linspace(0.0, 1.0, 11)
COARSE = {"mesh": [6, 2], "element": "conforming", "points": [4, 4, 2], "volumetric": "full"}


def test_a_locked_wheel_rubs_with_mu_times_its_load():
    """Coulomb's law at every output, on a mesh that is far too coarse for anything else; and the energy is kept."""
    found = rolling.rolling(way="locked", **COARSE)
    assert found["ended"] == "ok" and found["slides"] < 0.1  # %
    assert found["drift"] < 0.5 and found["stopped"] < 5.0  # m/s, of 5.2
    assert max(found["load"]) > 2e4


def _outcome(name: str, values: dict, **told) -> Outcome:
    return Outcome(Asked(name, told), Measured(name, told, "ok", values))


def _rolled(radius: float, **told) -> Outcome:
    values = {
        "ended": "ok", "unknowns": 9, "steps": 9, "iterations": 9, "cpu_seconds": 1.0, "loaded_radius": 1.26,
        "effective_radius": radius, "free_radius": 1.38, "mean_load": 1.5e5, "ripple": 0.01, "mean_forward": 0.0,
        "resistance": 600.0, "coefficient": 0.004, "drift": 0.4, "steady_drift": 0.3, "times": T.tolist(),
        "speed": T.tolist(), "load": T.tolist(),
        "energies": dict.fromkeys(("external", "strain", "dissipated"), [0.0] * 11),
    }  # fmt: skip
    return _outcome(rolling.RUN, values, **told)


def test_a_radius_beyond_the_free_one_is_no_rolling():
    locked = _outcome(rolling.RUN, {"slides": 0.01, "ended": "ok"}, mesh=[16, 4], way="locked")
    plates, solid = [_rolled(1.31, mesh=[16, 4]), locked], _rolled(1.30, solver="reference", size=0.4)
    judged = {figure.name: figure for figure in rolling.figures([*plates, solid])}
    assert judged["rolling_radius_percent"].met and judged["rolling_slide_percent"].met
    assert judged["rolling_agree_percent"].value == pytest.approx(100 * 0.01 / 1.30)
    assert "rolling_agree_percent" not in {figure.name for figure in rolling.figures(plates)}  # no solid was asked for
    beyond = {figure.name: figure for figure in rolling.figures([_rolled(1.40, mesh=[16, 4])])}
    assert beyond["rolling_radius_percent"].value == pytest.approx(100 * 0.02 / 1.38)
    assert not beyond["rolling_radius_percent"].met and beyond["rolling_slide_percent"].value is None
    text = render(Page("t", "l", [rolling.section([*plates, solid])], "f"))
    assert "Load on the ground" in text and "locked" in text
    assert not set(page.rows({"rolling": plates})[0]) & rolling.PATHS


def test_a_long_run_counts_its_bounces_and_misses_no_joule():
    """Three touches of which two end; 100 J fallen, 40 in the ground's dampers, 2 nowhere."""
    kinds = {"kinetic": [0.0, 58.0], "strain": [0.0, 0.0], "contact": [0.0, 0.0], "dissipated": [0.0, 40.0]}
    values = {
        "times": [0.0, 2.0], "reached": 2.0, "energy_gain": 0.1, "dissipated": 40.0,
        "force": [0, 1, 0, 2, 2, 0, 3], "energies": kinds | {"external": [0.0, 100.0]},
    }  # fmt: skip
    judged = {figure.name: figure for figure in bounces.figures([_outcome("tire.runs.drop", values)])}
    assert judged["long_bounces"].value == 2 and not judged["long_bounces"].met
    assert judged["long_lost_percent"].value == pytest.approx(5.0) and judged["long_seconds"].met


def test_grooves_without_depth_divide_every_row_that_has_none():
    lines = np.linspace(0.0, 1.0, 6)
    own = [points[0] for groove in stated()["grooves"] for points in groove["profile"]["control_points"]]
    rows = {int(np.searchsorted(lines, y)) for y in own}
    added = savings._everywhere([12, 5])
    assert {int(np.searchsorted(lines, g["profile"]["control_points"][0][0])) for g in added} | rows == set(range(1, 6))
    assert max(depth for g in added for _, depth in g["profile"]["control_points"]) == savings.SEAM


@pytest.mark.parametrize("unit", [savings.divided, savings.repeated, savings.searched])
def test_a_saving_is_measured_both_ways(unit):
    found = unit([4, 3])
    assert found["without"] > 0 and found["with"] > 0  # which is less is a matter of the machine's other work too
    outcome = _outcome("tire.savings", found)
    (table,) = savings.blocks([outcome])
    assert table.rows[0]["saved"] == pytest.approx(100 * (1 - found["with"] / found["without"]))


def test_the_tangent_of_a_saving_is_computed():
    """The elements' products take milliseconds; iterators that nobody follows took 4 us."""
    assert min(savings.divided([4, 3])[way] for way in ("with", "without")) > 2e-4
