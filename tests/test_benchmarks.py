"""The chapter of published benchmarks: its tables, its scenes, its readings, and how a failure shows."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from ancf.run import solve
from compare.exact import elastica_end_moment, elastica_end_shear, sphere_pressure, tube_pressure
from compare.scene import AncfLevel, ReferenceLevel
from reports.hard_cases import benchmark_tables as tables
from reports.hard_cases import benchmarks
from reports.hard_cases.benchmark_rubber import MOONEY
from reports.hard_cases.benchmark_runs import RUNS, Answer
from reports.hard_cases.benchmark_scenes import SCENES
from reports.hard_cases.chapter import Outcome
from reports.unit import Measured


def answered(budget, status="ok", run=None):
    """Outcomes of the chapter's units: all of that status, or with the same answer for every run."""
    found = []
    for asked in benchmarks.units(budget):
        values = {"runs": [run] * len(asked.arguments["runs"])} if run else {}
        found.append(Outcome(asked, Measured(asked.name, asked.arguments, status, values)))
    return found


def test_szes_exact_columns_are_the_closed_form_to_the_printed_digit():
    for stage, (w, u) in tables.SZE_END_MOMENT.items():
        exact = elastica_end_moment(2 * math.pi * stage / 20)
        assert [12 * exact[0], 12 * exact[1]] == pytest.approx([w, u], abs=0.0005 + 1e-9)


def test_szes_shells_lie_where_the_tolerance_says():
    """U 0.1 % below the thin limit, W closer."""
    for alpha, (w, u) in tables.SZE_END_SHEAR.items():
        exact = elastica_end_shear(alpha)
        assert (w / 10, u / 10) == pytest.approx(exact[:2], rel=2e-3)


def test_the_princeton_beams_bend_one_way_as_the_elastica():
    """0.01 %: shear; the clamp of a beam holds no section."""
    for force in (8.896, 13.345):
        w = 0.508 * elastica_end_shear(force * 0.508**2 / benchmarks.FLAPWISE)[0]
        assert tables.PRINCETON_TIP[force, 90][0][1] == pytest.approx(w, rel=1e-4)


def test_every_run_states_a_scene_and_a_level():
    for run in RUNS:
        SCENES[run.name](**run.about)
        if run.solver != "bricks":
            (AncfLevel if run.solver == "ancf" else ReferenceLevel)(**run.level)


def test_every_benchmark_is_run_by_both_solvers_and_from_the_quick_budget_on():
    both = {(run.name, run.solver) for run in RUNS if run.solver != "bricks"}
    assert both == {(name, solver) for name in SCENES for solver in ("ancf", "reference")}
    assert {run.name for run in RUNS if run.budget == "quick"} == set(SCENES)


@pytest.mark.parametrize("budget", ["quick", "standard", "full"])
def test_a_failed_run_is_a_missed_case_with_its_name_and_no_number(budget):
    dead = benchmarks.present(answered(budget, "failed: killed")).cases
    diverged = benchmarks.present(answered(budget, run={"status": "newton_diverged"})).cases
    for cases, status in ((dead, "failed: killed"), (diverged, "newton_diverged")):
        assert {(case.value, case.status, case.met) for case in cases} == {(None, status, False)}
    named = [case.name for case in dead]
    assert len(named) == len(set(named)) and named == [case.name for case in diverged]


def test_a_path_that_stops_keeps_the_stages_that_it_reached():
    moves = {"tip": [[0.0, 0.0, 0.0], [-0.5643, 0.0, 3.0172]]}
    stopped = Answer("ancf", {}, {"element": "enriched", "mesh": [8, 1]}, "singular_tangent", moves, {})
    assert stopped.at("tip", "Z", 1) == 3.0172
    assert stopped.at("tip", "Z", 2) is None and stopped.at("tip", "Z") is None
    assert stopped.case("W", None, unit="").status == "singular_tangent"
    assert stopped.case("W", 1.0, unit="").status == "ok"


def test_the_hoop_stress_is_exact_where_v_is_odd_and_cubic():
    """V = e Y + c Y^3 along the edge through D; stress E e + nu (0 - 1 MPa)."""
    y = {"a": 0.03, "b": 0.06}
    moves = {probe: [[0.0, -2.5e-5 * at + 4e-5 * at**3, 0.0]] for probe, at in y.items()}
    places = {probe: [2.0, at, 0.3] for probe, at in y.items()}
    answer = Answer("reference", {}, {"size": 0.2}, "ok", moves, places)
    assert benchmarks._hoop_stress(answer) == pytest.approx(210e3 * -2.5e-5 - 0.3, rel=1e-12)


def test_a_small_load_is_a_linear_one():
    """Cook at its load and at a hundred times that: the tip moves in proportion to 1e-4, and not beyond 1e-9."""
    moved, level = [], AncfLevel(mesh=(2, 2), element="enriched", time_step=1.0)
    for scale in (1.0, 100.0):
        scene = SCENES["cook"](plane="stress", nu=1 / 3)
        larger = scene.override({"loads.0.force": [scale * part for part in scene.loads[0].force]})
        moved.append(solve(larger, level).displacement[-1, 0, 1] / scale)
    assert 1e-9 < abs(moved[1] / moved[0] - 1) < 1e-4


def test_a_unit_answers_and_its_cases_are_judged():
    """The elastica on 8 enriched elements as the quick budget runs it: within 0.4 %, none of it missed."""
    asked = next(a for a in benchmarks.units("quick") if a.arguments["benchmark"] == "elastica")
    assert asked.arguments["solver"] == "ancf"
    values = benchmarks.solve(**asked.arguments)
    cases = benchmarks.present([Outcome(asked, Measured(asked.name, asked.arguments, "ok", values))]).cases
    assert len(cases) == 10 and all(case.met for case in cases)
    assert max(abs(case.difference) for case in cases) > 0.01


def test_closed_forms_of_rubber_are_the_published_tables():
    """Tables of the incompressible tube and sphere with B / A = 2, p / mu, to the printed digit."""
    for stretch, p in ((1.05, 0.070131951), (1.5, 0.42822841), (3.0, 0.66041726)):
        assert tube_pressure(stretch, 2.0) == pytest.approx(p, rel=1e-7)
    for stretch, neo, mooney in (
        (1.05, 0.15808143, 0.15919588),
        (1.5, 0.75543312, 0.81292914),
        (4, 0.49125071, 0.93359034),
    ):
        assert sphere_pressure(stretch, 2.0, 0.5, 0.0) == pytest.approx(neo, rel=1e-7)
        assert sphere_pressure(stretch, 2.0, 0.4375, 0.0625) == pytest.approx(mooney, rel=1e-7)


def blown(dim, outer, pressure, mu10, mu01, bulk):
    """u(1) of a tube (dim 2) or sphere (3), walls from 1 to `outer`: dP_r/dR = (dim - 1) (P_t - P_r) / R, P = dW/dl."""

    def stress(r, t, z):
        J, squares = r * t * z, (r**2, t**2, z**2)
        I1, I2 = sum(squares), squares[0] * squares[1] + squares[1] * squares[2] + squares[2] * squares[0]
        f1, f2 = mu10 * J ** (-2 / 3), mu01 * J ** (-4 / 3)
        s = -2 / 3 * f1 * I1 - 4 / 3 * f2 * I2 + bulk * J * (J - 1)
        return [2 * l * (f1 + f2 * (I1 - l**2)) + s / l for l in (r, t)]

    def slopes(R, y):
        t = y[0] / R
        z = t if dim == 3 else 1.0
        r = 1 / (t * z)
        for _ in range(20):
            r = r - (stress(r, t, z)[0] - y[1]) * 2e-7 / (stress(r + 1e-7, t, z)[0] - stress(r - 1e-7, t, z)[0])
        return np.stack([r, (dim - 1) / R * (stress(r, t, z)[1] - y[1])])

    def ends(a, b):
        return np.array([a[1] + pressure * a[0] ** (dim - 1), b[1]])

    R = np.linspace(1, outer, 21)
    found = solve_bvp(slopes, ends, R, np.stack([(R**dim + 1) ** (1 / dim), -pressure * (outer - R)]), tol=1e-8)
    assert found.status == 0
    return found.y[0, 0] - 1


def test_what_a_finite_bulk_modulus_adds_is_the_radial_equations():
    values = (
        blown(2, 1.1, tube_pressure(1.5, 1.1), 0.5, 0.0, 1000.0),
        blown(2, 2.0, tube_pressure(1.5, 2.0), 0.5, 0.0, 1000.0),
        blown(3, 1.1, sphere_pressure(1.25, 1.1, *MOONEY), *MOONEY, 1000.0),
    )
    assert values == pytest.approx(list(tables.BLOWN.values()), abs=1e-6)
