"""What the page of the plate drop shows, and the figures that it is judged by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.plots import Series, history_plot, map_plot
from compare.report import Block, Column, Plots, Section, Table, Text
from compare.verdict import Figure, at_most, stated
from reports.hard_cases.chapter import Asked, Outcome
from reports.plate_drop.scenes import DEPTH, FALL

TITLE = "Plate drop"
LEAD = (
    "A grooved plate of one element falls on the ground (section 7.1 of the paper): what contact by points and by area "
    "converge to, what the solid makes of the same fall, and whether the energy adds up."
)
ASSUMED = (
    f"Not in the paper's text and chosen here: the height of the fall, {FALL:g} m, and the groove, rectangular and "
    f"{DEPTH:g} m deep. Both are varied below. The ground is Table 3's: 8,500 N/m and 20 N s/m at each contact point, "
    "friction 0.75.",
    "Heights are of the plate's mean above where its plain face touches. The energies are kinetic + strain + contact + "
    "dissipated - work of gravity; what they drift by is told in percent of the energy of the fall.",
)
LANDING = 0.3  # s: from the fall's start to the top of the first rebound
KEYS = ("lowest", "rebound", "peak_force")
WORDS = {"lowest": "lowest height", "rebound": "rebound height", "peak_force": "peak force"}
FALLS = (
    Column("case", "case", "wrap"),
    Column("unknowns", "unknowns", ",d"),
    Column("lowest", "lowest", ".5f", "m"),
    Column("rebound", "rebound", ".5f", "m"),
    Column("peak_force", "peak force", ",.0f", "N"),
    Column("apart", "path apart", ".3f", "% of the fall", "greatest difference up to the first rebound's top"),
    Column("sunk", "at rest", ".6f", "m"),
    Column("difference", "greatest difference", ".3f", "%"),
    Column(
        "floor_pressed", "groove's floor at the end", ".3g", "N or Pa", "greatest contact force by point, or pressure"
    ),
    Column("energy_residual", "energy drift", ".2e", "%"),
    Column("cpu_seconds", "CPU", ".2f", "s"),
    Column("cpu_per_step_ms", "CPU per step", ".2f", "ms"),
    Column("status", "status"),
)


def told(outcome: Outcome) -> str:
    """What a unit asked, in few words."""
    skipped = ("law", "solver", "time_step")
    words = [f"{key} {_listed(value)}" for key, value in outcome.asked.arguments.items() if key not in skipped]
    return ", ".join([outcome.asked.arguments.get("solver", "ancf"), *words])


def _listed(value: Any) -> str:
    """2x2 of whole numbers, 0.2 to 0.3 of edges, and what else it is."""
    if not isinstance(value, list):
        return str(value)
    if isinstance(value[0], list):
        return " and ".join(f"{low:g} to {high:g}" for low, high in value)
    return "x".join(map(str, value))


def row(outcome: Outcome, **more: Any) -> dict[str, Any]:
    """A fall as a row."""
    keys = (column.key for column in FALLS)
    found = {key: outcome.get(key) for key in keys} | {"case": told(outcome), "status": outcome.measured.status}
    return found | more


def falls(caption: str, table: Sequence[dict[str, Any]], notes: Sequence[str] = ()) -> Table:
    """Falls as a table; columns that none fills are left out."""
    return Table(caption, [c for c in FALLS if any(own.get(c.key) not in (None, "") for own in table)], table, notes)


def rows(found: dict[str, list[Outcome]]) -> list[dict[str, Any]]:
    """Every unit as a row of the JSON, without its histories."""
    long = ("times", "centre", "height", "force", "x", "y", "pressure", "trace")
    return [
        {"part": part, "unit": outcome.asked.name, **outcome.asked.arguments, "status": outcome.measured.status}
        | {key: value for key, value in outcome.measured.values.items() if key not in long}
        for part, outcomes in found.items()
        for outcome in outcomes
    ]


def apart(one: Outcome, other: Outcome) -> float:
    """Greatest difference of two paths up to the first rebound's top, in percent of the height of the fall."""
    first, second = (np.array(outcome.get("height")) for outcome in (one, other))
    until = np.array(one.get("times")) <= LANDING
    return float(100 * np.abs(first - second)[until].max() / FALL)


def differences(one: Outcome, other: Outcome) -> dict[str, float]:
    """(one - other) of the first landing in percent: lowest height of the fall's, the others of themselves."""
    scale = {"lowest": FALL, "rebound": other.get("rebound"), "peak_force": other.get("peak_force")}
    return {key: 100 * (one.get(key) - other.get(key)) / scale[key] for key in KEYS}


def _falls(outcomes: Sequence[Outcome], **asked: Any) -> list[Outcome]:
    own = [outcome for outcome in outcomes if outcome.asked.name.endswith(".fall")]
    return [o for o in own if all(o.asked.arguments.get(key, "ancf") == value for key, value in asked.items())]


def _worst(outcomes: Sequence[Outcome], key: str) -> float | None:
    """The greatest of all runs; None where one of them failed or has no such value."""
    values = [outcome.get(key) for outcome in outcomes if outcome.ok]
    return max(values) if values and len(values) == len(outcomes) and None not in values else None


def _by_count(outcomes: Sequence[Outcome], law: str) -> dict[int, Outcome]:
    return {outcome.asked.arguments["points"][1]: outcome for outcome in _falls(outcomes, law=law)}


def figures(found: dict[str, list[Outcome]]) -> list[Figure]:
    """The figures of the study."""
    return [
        _difference(found["compared"]),
        _energy(found),
        _converged(found, "points"),
        _converged(found, "subdomains"),
        _grooves(found),
        _hard(found["hard"]),
        _detail(found["detail"][0]),
    ]


def finest(outcomes: Sequence[Outcome], solver: str, name: str = ".fall") -> Outcome | None:
    """The last run of a solver that has numbers."""
    own = [o for o in outcomes if o.asked.arguments.get("solver", "ancf") == solver and o.asked.name.endswith(name)]
    good = [outcome for outcome in own if outcome.ok]
    return good[-1] if good else None


def _pairs(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Differences of the finest runs of both solvers in percent; none without both."""
    one, other = (finest(outcomes, solver) for solver in ("ancf", "reference"))
    if one is None or other is None:
        return {}
    values = {key: differences(one, other)[key] for key in ("rebound", "peak_force")}
    laid = [finest(outcomes, solver, ".rest") for solver in ("ancf", "reference")]
    if all(laid):
        sunk = [outcome.get("sunk") for outcome in laid]
        values["rest"] = 100 * (sunk[0] - sunk[1]) / sunk[1]
    return values


def _difference(outcomes: Sequence[Outcome]) -> Figure:
    values = _pairs(outcomes)
    worst = max(map(abs, values.values())) if len(values) == 3 else None
    note = ", ".join(f"{name.replace('_', ' ')} {value:+.2f} %" for name, value in values.items())
    return at_most(
        "drop_difference_percent",
        "ANCF against the solid, pressure form",
        worst,
        "%",
        2.0,
        against="cross-code: rebound height, peak force and rest position of the finest runs",
        note=note or "The solid was not run.",
    )


def _energy(found: dict[str, list[Outcome]]) -> Figure:
    kept = [o for part in ("points", "subdomains", "grooves", "compared") for o in _falls(found[part])]
    worst = _worst(kept, "energy_residual")
    return at_most(
        "energy_residual_percent",
        "Drift of the energy",
        worst,
        "%",
        0.5,
        against="closed form: kinetic + strain + gravity + contact + dissipated is constant",
        note="Of the energy of the fall; the worst run of every law, rule, mesh and solver. What other integrators and "
        "steps drift by is in the table of what was assumed.",
    )


def _converged(found: dict[str, list[Outcome]], part: str) -> Figure:
    if part == "points":
        counts = _by_count(found["points"], "pressure")
        one, other = counts[3], counts[5]
    else:
        one, other = found["subdomains"][1], found["subdomains"][-1]
    both = one.ok and other.ok
    words = {"points": "3 points in a subdomain against 5", "subdomains": "3 subdomains against 4"}[part]
    value = apart(one, other) if both else None
    against = "its own refinement: path up to the first rebound's top, in percent of the fall"
    note = "Pressure form. By the paper's points the ground itself changes with their number."
    return at_most(f"{part}_converged_percent", words, value, "%", 1.0, against=against, note=note)


def _grooves(found: dict[str, list[Outcome]]) -> Figure:
    own = [_by_count(found["points"], "points")[3], found["grooves"][0]]
    worst, label = _worst(own, "floor_pressed"), "Greatest contact force on a groove's floor at 1 s, the paper's plates"
    return at_most("groove_force_at_1s", label, worst, "N or Pa", 0.0, against="the paper's Figures 5 and 8: none")


def _hard(outcomes: Sequence[Outcome]) -> Figure:
    bad = [told(o) for o in outcomes if not o.ok or o.get("ended") == "not finite" or not _named(o)]
    return at_most(
        "hard_cases_failed",
        "Hard cases that crash, hang, or answer wrong in silence",
        len(bad),
        "",
        0,
        against="an energy drift below 5 %, or the failure that the case may show; stopping within 1 %, creep at rest "
        "below 1e-9 m",
        note="; ".join(bad) or "None.",
    )


def may_fail(asked: Asked) -> tuple[str, ...]:
    """Failures that a hard case may show: the trapezoidal rule gains energy on a ground of ten thousand times the
    stiffness and has to say so; every other case has to end well."""
    return ("energy_not_kept",) if asked.name.endswith(".landing") and "integrator" in asked.arguments else ()


def _named(outcome: Outcome) -> bool:
    """Whether a hard case is right, or ends with a failure that it may show."""
    if outcome.get("ended") != "ok":
        return outcome.get("ended") in may_fail(outcome.asked)
    expected, creep = outcome.get("expected"), outcome.get("creep")
    near = expected is None or abs(outcome.get("value") / expected - 1) <= 0.01
    return near and outcome.get("energy_residual") <= 5.0 and (creep is None or creep < 1e-9)


def _detail(outcome: Outcome) -> Figure:
    label, against = "CPU per step of a groove twice as detailed", "its own groove, in one process, the least of 5"
    if not outcome.ok:
        return stated("detail_step_ratio", label, None, "times", against=against)
    flight, ground, points = (outcome.get(key) for key in ("flight", "ground", "points"))
    note = f"In flight; on the ground {ground[1] / ground[0]:.2f} times, {points[1]} contact points for {points[0]}."
    return stated("detail_step_ratio", label, flight[1] / flight[0], "times", form=".3f", against=against, note=note)


def sections(found: dict[str, list[Outcome]]) -> list[Section]:
    """The page between its verdict and its commands."""
    return [
        Section("paper", "The paper's plate", [Text(ASSUMED), *_paper(found)], "Paper"),
        Section("points", "Points and subdomains", _points(found), "Points"),
        Section("compared", "Against the solid", _compared(found["compared"]), "Solid"),
        Section("sensitivity", "What was assumed, varied", _sensitivity(found), "Assumed"),
        Section("hard", "Hard cases of contact", _hard_table(found["hard"]), "Hard cases"),
        Section("detail", "What detail costs", _detail_table(found["detail"][0]), "Detail"),
    ]


def _paper(found: dict[str, list[Outcome]]) -> list[Block]:
    one, two = _by_count(found["points"], "points")[3], found["grooves"][0]
    plots = []
    for name, outcome, words in (("one", one, "one element"), ("two", two, "2 x 2 elements, two grooves")):
        if not outcome.ok:
            continue
        x, y, force = (outcome.get(key) for key in ("x", "y", "pressure"))
        plots.append(
            (
                map_plot(
                    f"face-{name}",
                    f"Contact force at 1 s, {words}",
                    "Each contact point of the face.",
                    x,
                    y,
                    force,
                    "force (N)",
                ),
                f"Contact forces over the face at t = 1 s, {words}.",
            )
        )
        middle = np.unique(np.abs(np.array(x) - 0.5))[0]
        own = np.abs(np.abs(np.array(x) - 0.5) - middle) < 1e-9
        order = np.argsort(np.array(y)[own], kind="stable")
        line = Series(words, "ancf", np.array(y)[own][order], np.array(force)[own][order])
        plots.append(
            (
                history_plot(
                    f"section-{name}",
                    f"Mid-section, {words}",
                    "Contact force along y.",
                    ("y (m)", "contact force (N)"),
                    [line],
                    None,
                ),
                f"Along the section nearest to x = 0.5 m, {words}: none in the grooves.",
            )
        )
    paths = [
        Series(words, role, o.get("times"), o.get("centre"))
        for words, role, o in (("1 element", "ancf", one), ("2 x 2, two grooves", "reference", two))
        if o.ok
    ]
    plots.insert(
        0,
        (
            history_plot("path", "Centre of the lower face", "Height over time.", ("t (s)", "height (m)"), paths, None),
            "Height of the centre of the lower face.",
        ),
    )
    return [Plots(plots), falls("The paper's two plates, force by contact point.", [row(one), row(two)])]


def _points(found: dict[str, list[Outcome]]) -> list[Block]:
    blocks: list[Block] = []
    for law, words in (("points", "Stiffness by contact point, as in the paper"), ("pressure", "Stiffness by area")):
        counts = _by_count(found["points"], law)
        table = [row(o, apart=apart(o, counts[5]) if o.ok and counts[5].ok else None) for o in counts.values()]
        blocks.append(falls(f"{words}: 2 to 5 points in each of 3 subdomains.", table))
    one = _by_count(found["points"], "points")
    roles = ("difference", "ancf", "reference", "ancf exact")
    paths = [
        Series(f"{n} points", role, o.get("times"), o.get("centre"))
        for role, (n, o) in zip(roles, one.items(), strict=True)
        if o.ok
    ]
    blocks.append(
        Plots(
            [
                (
                    history_plot(
                        "by-points",
                        "By points",
                        "Centre's height by the number of points.",
                        ("t (s)", "height (m)"),
                        paths,
                        None,
                    ),
                    "The paper's force by point: every number of points is another ground.",
                )
            ]
        )
    )
    divided = found["subdomains"]
    last = divided[-1]
    names = ("1 subdomain (one grid of 9 points over the element)", "3 subdomains", "4 subdomains")
    table = [
        row(o, case=name, apart=apart(o, last) if o.ok and last.ok else None)
        for o, name in zip(divided, names, strict=True)
    ]
    note = "Two subdomains would leave an edge of the groove inside one of them; the rule always divides there."
    blocks.append(falls("Subdomains across the plate, 3 points in each, stiffness by area.", table, [note]))
    return blocks


def _compared(outcomes: Sequence[Outcome]) -> list[Block]:
    last = finest(outcomes, "reference")
    laid = finest(outcomes, "reference", ".rest")
    sunk = {_level(o): o.get("sunk") for o in outcomes if o.asked.name.endswith(".rest")}
    table = []
    for outcome in _falls(outcomes):
        differs = None
        if outcome.ok and last is not None:
            values = [differences(outcome, last)[key] for key in ("rebound", "peak_force")]
            own = sunk.get(_level(outcome))
            if own and laid is not None:
                differs = max(map(abs, [*values, 100 * (own / laid.get("sunk") - 1)]))
        table.append(row(outcome, sunk=sunk.get(_level(outcome)), difference=differs))
    words = [
        "Greatest difference: of rebound height, peak force and rest position from the finest solid, beside the "
        "CPU time that it takes. The solid's own mesh steps are in its rows."
    ]
    best = [o for o in (finest(outcomes, "ancf"), last) if o is not None]
    paths = [
        Series(
            o.asked.arguments.get("solver", "ancf"),
            o.asked.arguments.get("solver", "ancf"),
            o.get("times"),
            o.get("height"),
        )
        for o in best
    ]
    plot = history_plot("compared-path", "Both solvers", "Height over time.", ("t (s)", "height (m)"), paths, None)
    force = [Series(s.label, s.role, o.get("times"), o.get("force")) for s, o in zip(paths, best, strict=True)]
    other = history_plot("compared-force", "Both solvers", "Force over time.", ("t (s)", "force (N)"), force, None)
    return [
        Text(words),
        falls("One ground for two solvers: stiffness by area.", table),
        Plots([(plot, "Height of the plate's mean."), (other, "Force of the ground.")]),
    ]


def _level(outcome: Outcome) -> str:
    keys = ("solver", "element", "mesh", "fit", "size")
    return str([outcome.asked.arguments.get(key) for key in keys])


def _sensitivity(found: dict[str, list[Outcome]]) -> list[Block]:
    base = _by_count(found["points"], "points")[3]
    words = "Heights of the fall, depths of the groove, time steps and integrators, force by contact point."
    table = [
        row(o, case=f"{told(o)}, step {o.asked.arguments['time_step']:g} s") for o in [base, *found["sensitivity"]]
    ]
    return [falls(words, table)]


HARD = (
    Column("case", "case", "wrap"),
    Column("ended", "ended"),
    Column("may_fail", "may end"),
    Column("iterations_per_step", "iterations per step", ".2f"),
    Column("energy_residual", "energy drift", ".2e", "%"),
    Column("peak_force", "peak force", ",.0f", "N"),
    Column("value", "value", ".5g", "m"),
    Column("expected", "expected", ".5g", "m"),
    Column("creep", "creep in 5 s", ".1e", "m"),
    Column("process_cpu_seconds", "CPU", ".1f", "s"),
    Column("status", "status"),
)


def _hard_table(outcomes: Sequence[Outcome]) -> list[Block]:
    table = [
        {column.key: o.get(column.key) for column in HARD}
        | {"status": o.measured.status, "case": _case(o), "may_fail": ", ".join(("ok", *may_fail(o.asked)))}
        for o in outcomes
    ]
    words = [
        "Landing: flat at 1 m/s, every point at once, the scene's stiffness by area times a factor. A scheme whose "
        "steps lose or make a twentieth of the energy ends under that name instead of going on."
    ]
    return [Text(words), Table("Stiffness, steps, stopping, an edge first, long rest.", HARD, table)]


def _case(outcome: Outcome) -> str:
    arguments = [
        f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in outcome.asked.arguments.items()
    ]
    return ", ".join([outcome.asked.name.rpartition(".")[2].replace("_", " "), *arguments])


def _detail_table(outcome: Outcome) -> list[Block]:
    if not outcome.ok:
        return [Text([outcome.measured.status])]
    columns = (
        Column("grooves", "grooves", "d"),
        Column("flight", "in flight", ".3f", "ms per step"),
        Column("ground", "on the ground", ".3f", "ms per step"),
        Column("points", "contact points", "d"),
    )
    lists = (outcome.get(key) for key in ("counts", "flight", "ground", "points"))
    table = [
        dict(zip(("grooves", "flight", "ground", "points"), values, strict=True)) for values in zip(*lists, strict=True)
    ]
    words = (
        "One element with as much groove in one, two or four parts; CPU time per step, the least of 5 in one process."
    )
    return [Table(words, columns, table, ["The solid would have to mesh every part."])]
