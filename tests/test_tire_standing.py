"""The tire on its rim: load and way belong together, and its section of the page judges what it is given."""

import numpy as np
import pytest

from compare.report import Page, render
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import page, standing
from reports.unit import Measured

COARSE = {"mesh": [4, 2], "element": "conforming", "points": [4, 4, 2], "volumetric": "full"}


def test_a_rim_that_goes_where_its_load_had_brought_it_bears_that_load():
    """Balance of forces at every output; and what the loads do is what strain, ground and friction take."""
    found = standing.standing(**COARSE, way="moved")
    assert found["ended"] == "ok" and found["unbalanced"] < 1e-6  # Newton's tolerance
    np.testing.assert_allclose(found["loads"], np.linspace(16e3, 160e3, 11), rtol=2e-3)  # friction knows the way
    assert found["stored"] == pytest.approx(found["external"], rel=1e-3)  # twenty load steps of a tenth
    assert found["in_grooves"] == 0.0 and np.all(np.diff(found["radii"]) < 0)


def _run(error: float, **told) -> Outcome:
    """A run whose numbers differ from 1 by `error`."""
    values = {
        "ended": "ok", "h": told.get("size", 0.3), "unknowns": 9, "iterations": 9, "cpu_seconds": 1.0, "ratio": 0.99,
        "loads": [16e3, 160e3], "radii": [1.35, 1.26 * (1 + error)], "areas": [0.1, 0.4], "radius": 1 + error,
        "stiffness": 1 + error, "footprint": 1 - error, "mean_pressure": 1 + error, "length": 0.7, "width": 0.7,
        "unbalanced": 1e-9, "external": 100.0, "stored": 99.0, "x": [0.0, 0.1], "y": [0.0, 0.1], "traction": [1e5, 0.0],
    }  # fmt: skip
    return Outcome(Asked(standing.RUN, told), Measured(standing.RUN, told, "ok", values))


def _found() -> list[Outcome]:
    solids = [_run(0.1 * h**2, solver="reference", size=h) for h in (1.0, 0.5, 0.25)]
    plate = {"mesh": standing.MESH, "fit": [0.4]}
    return [*solids, _run(0.02, **plate), _run(0.0, **plate, inflation=0.0), _run(0.0, **plate, way="moved")]


def test_the_section_judges_stiffness_footprint_and_balance():
    """Errors fall with h squared, so the limit is 1."""
    judged = {figure.name: figure for figure in standing.figures(_found())}
    assert judged["standing_stiffness_percent"].value == pytest.approx(2.0, rel=1e-6)
    assert judged["standing_footprint_percent"].value == pytest.approx(2.0, rel=1e-6)
    assert judged["standing_balance_percent"].met and judged["standing_energy_percent"].value == pytest.approx(1.0)
    text = render(Page("t", "l", [standing.section(_found())], "f"))
    assert "Axle load" in text and "Footprint under the whole load: plate" in text


def test_without_a_run_nothing_is_judged():
    assert all(figure.value is None for figure in standing.figures([]))
    rows = page.rows({"standing": _found()})
    assert len(rows) == 6 and not set(rows[0]) & standing.PATHS
