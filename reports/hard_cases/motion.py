"""Motion: free flight for many steps, time steps from 0.1 ms to 0.25 s, loads and Poisson's ratios far out.

A free plate keeps its energy, its linear and its angular momentum. The energy-momentum scheme does so to round-off;
trapezoidal rule and generalized-alpha do so for small displacements only, and are shown failing at its step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ancf.integrate import SCHEMES, State, advance, initial_state
from ancf.linear_solver import LinearSolver
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.run import solve
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, Band
from ancf.system import System, body, system
from compare.plots import Series, log_plot
from compare.report import Column, Plots, Table, Text
from compare.scene import AncfLevel, load
from compare.verdict import Figure, at_most
from reports.hard_cases.chapter import OK, Asked, Case, Chapter, Outcome, case_table

TITLE = "Long and violent motion"
CONSERVING = "energy-momentum"
# Steps and their length (s) by budget; the others fly as the first of them: a step turns the plate by 0.2 rad.
FLIGHTS = {"quick": ((200, 0.05),), "standard": ((300, 0.05), (2000, 0.02))}
FLIGHTS["full"] = (*FLIGHTS["standard"], (100_000, 0.01))
KEPT = 1e-8  # percent: 1e5 steps of round-off, each at most 1e-13 of the energy, add up like a random walk to 3e-11
FAILS = {"trapezoidal": ("energy_gained", "inverted_element"), "generalized-alpha": ("energy_lost",)}
LOST = 5e-3  # part of the energy beyond which it counts as not kept
ROLES = {CONSERVING: "ancf", "trapezoidal": "reference", "generalized-alpha": "difference"}

PLAIN, NEARLY = (50.0, 0.0), (50.0, 0.4999)
SWINGS = {
    "quick": ((PLAIN, (0.25, 0.05, 0.01)),),
    "standard": (
        (PLAIN, (0.25, 0.05, 0.01, 0.001)),
        ((50.0, 0.3), (0.05, 0.01)),
        (NEARLY, (0.25, 0.05, 0.01)),
        ((500.0, 0.0), (0.25, 0.05, 0.01, 0.001)),
    ),
    "full": (
        (PLAIN, (0.25, 0.05, 0.01, 0.001, 0.0001)),
        ((50.0, 0.3), (0.25, 0.05, 0.01, 0.001)),
        ((50.0, 0.49), (0.25, 0.05, 0.01, 0.001)),
        (NEARLY, (0.25, 0.05, 0.01, 0.001)),
        ((500.0, 0.0), (0.25, 0.05, 0.01, 0.001)),
        ((500.0, 0.4999), (0.25, 0.05, 0.01, 0.001)),
        ((5000.0, 0.0), (0.25, 0.05, 0.01, 0.001)),
        ((5000.0, 0.4999), (0.25, 0.05, 0.01)),
    ),
}
# Percent of the height at 1 s by time step. The swing lasts about 1 s at 50 N: (2 pi dt)^2 / 12 is 20 % of the phase
# at 0.25 s, 0.8 % at 0.05 s and 0.03 % at 0.01 s, and the height at 1 s lies near its turning point.
ALLOWED = {0.25: 5.0, 0.05: 1.0, 0.01: 0.1, 0.001: 0.01}
VIOLENT = ("newton_diverged", "singular_tangent", "inverted_element")  # how a run under such a load may end
WILD = 1000.0  # N: from here on the plate whirls, and the height at 1 s hangs on modes that no step here resolves


def units(budget: str) -> list[Asked]:
    """Flights by each scheme at one step, and the cantilever at each force, Poisson's ratio and step."""
    asked = [Asked(f"{__name__.removeprefix('reports.')}.flight", flown) for flown in _flights(budget)]
    for (force, nu), steps in SWINGS[budget]:
        for step in steps:
            for integrator in ("trapezoidal", CONSERVING):
                arguments = {"force": force, "nu": nu, "time_step": step, "integrator": integrator}
                asked.append(Asked(f"{__name__.removeprefix('reports.')}.swing", arguments))
    return asked


def _flights(budget: str) -> list[dict[str, Any]]:
    steps, step = FLIGHTS[budget][0]
    flights = [{"integrator": CONSERVING, "time_step": dt, "steps": count} for count, dt in FLIGHTS[budget]]
    return flights + [{"integrator": name, "time_step": step, "steps": steps} for name in list(ROLES)[1:]]


def grooved_plate(mesh: int = 2) -> tuple[System, np.ndarray, np.ndarray]:
    """A free square plate with one groove; its components at rest and a velocity (3 v,): it drifts, spins and twists.

    1 m by 1 m by 0.05 m, groove y in [0.4, 0.6], 0.02 m deep, material of Table 4; spin 4 rad/s about a slanted
    axis through its middle, and a twist of 1 m/s at its corners.
    """
    lines = np.linspace(0.0, 1.0, mesh + 1)
    groove = Band(BOTTOM, GROOVE, 0, (0.4, 0.6), 0.02)
    material = from_engineering(2.0e6, 0.0)
    plate = body(grid(lines, lines, None, FAMILY["conforming"]), (groove,), 0.05, material, 2000.0, (7, 7, 3))
    vectors, kinds = plate.mesh.vectors, plate.mesh.kinds
    acting = system(plate, np.zeros(vectors.size, dtype=bool), (), 0.05)
    middle = plate.mass_row @ vectors / plate.total_mass
    is_position = (kinds == "r")[:, None]
    v = np.cross([1.0, 3.0, 2.4], vectors - is_position * middle) + is_position * [0.03, -0.02, 0.01]
    x, y, _ = 2 * vectors.T - 1
    v[:, 2] += np.select([kinds == "r", kinds == "r_x", kinds == "r_y"], [x * y, 2 * y, 2 * x], 0.0)
    return acting, vectors.ravel().copy(), v.ravel()


def flight(integrator: str, time_step: float, steps: int) -> dict[str, Any]:
    """Free flight: largest relative change of energy and momenta up to each of some steps, and how it ended."""
    acting, q, v = grooved_plate()
    solver, scheme, factor = LinearSolver(acting.assembly.pattern), SCHEMES[integrator], None
    state = initial_state(acting, solver, q, v)
    start, changed, ended = _invariants(acting, state), {}, OK
    for stop in np.unique(np.geomspace(1, steps, 60).astype(int)).tolist():
        motion = advance(acting, solver, scheme, state, stop * time_step, time_step, factor)
        state, factor, ended = motion.state, motion.factor, motion.status
        if ended != OK:
            break
        now = _invariants(acting, state)
        changed[stop] = [float(np.abs(b - a).max() / np.linalg.norm(a)) for a, b in zip(start, now, strict=True)]
        if not changed[stop][0] < LOST:
            ended = "energy_gained" if now[0] > start[0] else "energy_lost"
    energy, linear, angular = np.array(list(changed.values())).T.tolist()
    return {
        "ended": ended,
        "time": state.t,
        "step": list(changed),
        "energy": energy,
        "linear": linear,
        "angular": angular,
    }


def _invariants(acting: System, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Energy (1,) in J, linear momentum (3,) in N s, angular momentum (3,) about the origin in N m s."""
    q, v = state.q.reshape(-1, 3), state.v.reshape(-1, 3)
    spin = np.cross(q, acting.body.mass @ v).sum(axis=0)
    return np.array([sum(acting.energies(state.q, state.v))]), acting.body.mass_row @ v, spin


def swing(force: float, nu: float, time_step: float, integrator: str) -> dict[str, Any]:
    """Height of the plain patch-loaded cantilever at 1 s on 4 x 4 enriched elements, and how the run ended."""
    changes = {"loads.0.force": [0.0, 0.0, -force], "material.poissons_ratio": nu, "analysis.every": 0.25}
    level = AncfLevel(mesh=(4, 4), element="enriched", time_step=time_step, integrator=integrator)
    levels = {"levels": [level.model_dump(mode="json")]}
    scene = load("cantilever_plain_patch").override({**changes, "ancf": levels, "reference": None})
    result = solve(scene, level)
    value = float(result.position("P")[-1, 2]) if result.status == OK else None
    return {"ended": result.status, "value": value, "steps": result.steps, "asked": round(1 / time_step)}


def present(outcomes: Sequence[Outcome]) -> Chapter:
    """Cases of both parts, the figures of the flight and the plot of what each scheme loses."""
    flights = [outcome for outcome in outcomes if "steps" in outcome.asked.arguments]
    swings = [outcome for outcome in outcomes if "force" in outcome.asked.arguments]
    flown = [case for outcome in flights for case in _flight_cases(outcome)]
    swung = _swing_cases(swings)
    blocks = [
        Text([
            "A free plate with one groove drifts, spins at 4 rad/s and twists. What is kept is compared with its value "
            "at the start; 1 means kept. The trapezoidal rule gains energy until elements fold, generalized-alpha "
            "damps it away: at this step neither is a scheme for free flight, and each is named as a failure. The "
            "energy-momentum scheme takes the mean stress of both ends of a step, whose work is exactly the change of "
            "strain energy; what is left is the residual at which Newton's method ends, round-off. 100,000 steps are "
            "flown in the full budget, fewer in the others.",
        ]),
        case_table("Free flight", flown),
        Plots([_plot(flights)]),
        case_table("The cantilever swung up to 1 s", swung, [
            "Expected: the same question by the energy-momentum scheme at the least time step of this budget, itself "
            "not judged. A step that finds no equilibrium is cut and made in parts.",
        ]),
        *_cuts(swings),
    ]  # fmt: skip
    return Chapter([*flown, *swung], _figures(flights), blocks)


def _flight_cases(outcome: Outcome) -> list[Case]:
    """One case for each invariant of the scheme that keeps them, one failure for the others."""
    asked = outcome.asked.arguments
    name, level = asked["integrator"], f"2x2, {asked['steps']} steps of {asked['time_step']:g} s"
    ended = outcome.get("ended") or outcome.measured.status
    against = "exact: kept; tolerance: round-off of each step's residual, as a random walk"
    if name != CONSERVING:
        what = f"flight by {name} (allowed to fail)"
        return [Case(what, "ancf", level, None, "of the start", 1.0, None, "exact: kept", ended, may_fail=FAILS[name])]
    return [
        Case(f"{what} kept by {name}, {asked['time_step']:g} s", "ancf", level, _kept(outcome, key), "of the start",
             1.0, KEPT, against, ended)
        for what, key in (("energy", "energy"), ("linear momentum", "linear"), ("angular momentum", "angular"))
    ]  # fmt: skip


def _kept(outcome: Outcome, key: str) -> float | None:
    return 1.0 + max(outcome.get(key)) if outcome.get(key) else None


def _swing_cases(swings: Sequence[Outcome]) -> list[Case]:
    cases = []
    for question in dict.fromkeys((o.asked.arguments["force"], o.asked.arguments["nu"]) for o in swings):
        asked = [o for o in swings if (o.asked.arguments["force"], o.asked.arguments["nu"]) == question]
        finest = min(o.asked.arguments["time_step"] for o in asked)
        best = next(o for o in asked if o.asked.arguments | {"time_step": finest} == o.asked.arguments
                    and o.asked.arguments["integrator"] == CONSERVING)  # fmt: skip
        cases += [_swing_case(o, best) for o in asked]
    return cases


def _swing_case(outcome: Outcome, best: Outcome) -> Case:
    force, nu, step, integrator = (outcome.asked.arguments[k] for k in ("force", "nu", "time_step", "integrator"))
    name = f"{force:g} N, nu = {nu:g}, dt = {step:g} s, {integrator}"
    wild, finest = force >= WILD, best.asked.arguments["time_step"]
    judged = not wild and step > finest
    against = f"self-convergence: dt = {finest:g} s; tolerance: the rule's phase error" if judged else ""
    ended = outcome.get("ended") or outcome.measured.status
    return Case(name, "ancf", "4x4 enriched", outcome.get("value"), "m", best.get("value") if judged else None,
                ALLOWED[step] if judged else None, against, ended, may_fail=VIOLENT if wild else ())  # fmt: skip


def _cuts(swings: Sequence[Outcome]) -> list[Table]:
    """Runs whose steps had to be cut, if there are any."""
    columns = (
        Column("force", "force", "g", "N"),
        Column("nu", "nu", "g"),
        Column("time_step", "time step", "g", "s"),
        Column("integrator", "scheme"),
        Column("asked", "steps asked", "d"),
        Column("steps", "steps made", "d"),
        Column("ended", "ended"),
    )
    rows = [{**o.asked.arguments, **{key: o.get(key) for key in ("asked", "steps", "ended")}} for o in swings if o.ok]
    cut = [row for row in rows if row["steps"] != row["asked"]]
    return [Table("Runs whose steps had to be cut", columns, cut)] if cut else []


def _figures(flights: Sequence[Outcome]) -> list[Figure]:
    longest = max(flights, key=lambda o: (o.asked.arguments["integrator"] == CONSERVING, o.asked.arguments["steps"]))
    steps = longest.asked.arguments["steps"]
    note = f"Largest of energy, linear and angular momentum over {steps} steps of a grooved plate in free flight."
    parts = [max(longest.get(key)) for key in ("energy", "linear", "angular")] if longest.ok else []
    value = max(parts) if parts and longest.get("ended") == OK else None
    bar, words = KEPT / 100, "exact: kept"
    return [at_most("free_flight_drift", "Drift in free flight", value, "of the start", bar, against=words, note=note)]


def _plot(flights: Sequence[Outcome]) -> tuple[str, str]:
    lines = []
    for o in flights:
        if not o.ok:
            continue
        name, step = o.asked.arguments["integrator"], o.asked.arguments["time_step"]
        lines.append(Series(f"{name}, {step:g} s", ROLES[name], o.get("step"), np.maximum.accumulate(o.get("energy"))))
    caption = "Largest relative change of energy so far, over the number of steps."
    return log_plot("flight-energy", "Energy in free flight", caption, lines, "steps", "relative change"), caption
