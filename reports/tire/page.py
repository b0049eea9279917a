"""What the page of the tire shows, and the figures that it is judged by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.plots import Series, history_plot, log_plot, map_plot
from compare.report import Block, Bullets, Column, Plots, Section, Table, Text
from compare.verdict import Figure, at_least, at_most, stated
from reports.hard_cases.chapter import Outcome
from reports.tire import bounces, kernels, limits, recorded, rolling, savings, standing, treads
from reports.tire.scenes import stated as scene_words

TITLE = "Tire on the ground"
LEAD = (
    "A tire with four grooves of nearly incompressible rubber falls on the ground (section 7.3 of the paper): a "
    "quarter of it by both solvers, until it has bounced."
)
MESH = [12, 5]  # of the quarter: 24 x 10 elements of the whole tire, its lines on the section's knots
OFF_KNOTS = [12, 6]  # 24 x 12 of the whole tire: more elements, and lines beside the knots
LIMIT = "the reference's extrapolated ladder"
NUMBERS = ("travel", "peak_force", "footprint")


def figures(found: dict[str, list[Outcome]]) -> list[Figure]:
    """Every number that the study is judged by; None where the budget did not run it."""
    solids, run, plates, _ = _ladders(found)
    own = next((o for o in plates.outcomes if o.asked.arguments["mesh"] == MESH), None)
    have = bool(solids.outcomes) and own is not None
    off, smooth = (_same(found.get(part, []), mesh) for part, mesh in (("off knots", OFF_KNOTS), ("smooth", MESH)))
    return [
        _height(solids, own, have),
        _number(solids, own, have, "peak_force", "peak_force_percent", "Peak force"),
        _number(solids, own, have, "footprint", "footprint_percent", "Footprint, the largest pressed area"),
        _jacobian(solids, own, have),
        _cost(solids, run, plates, own),
        *_beside(solids, off, "off_knots", "24 x 12, lines beside the section's knots"),
        *_beside(solids, smooth, "smooth", "24 x 10 without kinks at the grooves"),
        *kernels.figures(found["kernels"]),
        _energy(found),
        _symmetry(found["saved"]),
        *(bounces.figures(found["long"]) if "long" in found else ()),
        *(standing.figures(found["standing"]) if "standing" in found else ()),
        *(rolling.figures(found["rolling"]) if "rolling" in found else ()),
        *(treads.figures(found["treads"]) if "treads" in found else ()),
        _hard(found["hard"]),
    ]


def _ladders(found: dict[str, list[Outcome]]) -> tuple[limits.Ladder, limits.Ladder, limits.Ladder, recorded.Record]:
    """The solids that were run and the recorded ones beyond, those that were run, the plates, and the record."""
    fallen = found["drop"]
    record = recorded.beyond(fallen)
    solids, run = (limits.ladder(own, "reference") for own in ([*fallen, *record.solids], fallen))
    return solids, run, limits.ladder(fallen, "ancf"), record


def path_limit(solids: limits.Ladder) -> np.ndarray:
    """Extrapolated path of node 1."""
    return solids.history("node_1", solids.convergence("travel").taken)


def _height(solids, own, have: bool) -> Figure:
    value = limits.error(own, path_limit(solids)) if have else None
    note = ""
    if have:
        last = np.array(solids.outcomes[-1].get("node_1"))
        note = f"{own.get('unknowns'):,.0f} unknowns, of which the kinks at groove floors are a part. "
        note += f"{limits.error(own, last):.2f} % from the finest solid, h = {solids.outcomes[-1].get('h'):g} m; "
        if len(solids.outcomes) > 1:
            note += f"its last refinement moved it by {limits.error(solids.outcomes[-2], last):.2f} %; "
        note += f"the limit's travel is {solids.limit('travel')[1]}."
    against = f"cross-code: {LIMIT}, greatest difference of the path in percent of its travel"
    return at_most("height_difference_percent", "Node 1, 24 x 10", value, "%", 2.0, against=against, note=note)


CHOSEN = (
    "Elements kink where the floors of grooves begin and end inside them (walls = true): there the thickness halves, "
    "and with it all strains jump. These functions were chosen after parts of the mesh had been refined in turn, in "
    "statics: smooth elements lose their accuracy inside the grooves, not beside them and not in the sidewall.",
    "The section, which is assumed, has five spans on each side, so that the five elements there hold its middle; with "
    "six spans the same mesh was 3 % off. That was chosen after seeing it. Directors between nodes still miss the "
    "thickness, as the table of misfits tells.",
    "Beside walls the tread ends with a free face; lips let it stay behind there (lips = true). Without them finer "
    "plates tend to a stiffer tire than finer solids do. They were chosen after seeing that, and their limits of "
    "room after seeing that on 24 x 10 elements one in the wide element of the shoulder makes the tread slide. That "
    "they go on in the next element, where a wall stands just behind a grid line, was added after the path of 24 x 10 "
    "elements had been 2.5 % from the limit of the finest solids: the rib between the grooves had a lip at one end.",
    'Narrow parts of an element have fewer points (integration = "sparing"), and the tread has twice as many around '
    "that may touch the ground as it has points of integration, since the footprint is as coarse as they are.",
    "Where the ladder of the solid shows no order, its finest path is the limit. Sharp corners slow it down: the order "
    "of the travel settles only with the finest solid of the full budget, and the limit then lies beyond what shorter "
    "ladders take for it. So a full study may record its solids, and a shorter one carries its ladder on with their "
    "numbers if it finds the same solid at 0.22 m; what a solid costs is told by those that were run.",
)
MISFIT = (
    Column("mesh", "elements of the quarter"),
    Column("middle", "middle of the wall off by", ".2e", "m"),
    Column("half", "half the thickness off by", ".2e", "m"),
)


def _same(outcomes: Sequence[Outcome], mesh: list[int]) -> Outcome | None:
    """The good run of a mesh."""
    return next((o for o in limits.ladder(outcomes, "ancf").outcomes if o.asked.arguments["mesh"] == mesh), None)


def _beside(solids, own, key: str, mesh: str) -> Iterator[Figure]:
    """The judged numbers of another mesh, as figures without a bar."""
    for of, name, label in (
        ("node_1", "height", "Node 1's path"),
        ("peak_force", "peak_force", "Peak force"),
        ("footprint", "footprint", "Footprint"),
    ):
        value, note = None, ""
        if solids.outcomes and own is not None:
            line = path_limit(solids)
            value = limits.error(own, line) if of == "node_1" else abs(100 * (own.get(of) / solids.limit(of)[0] - 1))
            note = f"{own.get('elements'):.0f} elements of the quarter, {own.get('unknowns'):,.0f} unknowns."
        against = f"cross-code: {LIMIT}"
        yield stated(f"{key}_{name}_percent", f"{label}, {mesh}", value, "%", against=against, note=note)


def _number(solids, own, have: bool, key: str, name: str, label: str) -> Figure:
    value, note = None, ""
    if have:
        limit, how = solids.limit(key)
        signed = 100 * (own.get(key) / limit - 1)
        value, note = abs(signed), f"{signed:+.2f} %; {how}: {limit:,.4g}."
    return at_most(name, f"{label}, 24 x 10", value, "%", 5.0, against=f"cross-code: {LIMIT}", note=note)


def _jacobian(solids, own, have: bool) -> Figure:
    value, note = None, ""
    if have:
        ratio, other = np.array(own.get("ratio")), np.array(solids.outcomes[-1].get("ratio"))
        value = float(100 * np.abs(ratio / other - 1).max())
        note = f"Least |J| {ratio.min():.4f} against {other.min():.4f}: Figure 15 of the paper."
    against = "cross-code: the finest solid, the whole path"
    label = "|J| at the tread's lower centre, 24 x 10"
    return at_most("jacobian_difference_percent", label, value, "%", 0.5, against=against, note=note)


def _cost(solids: limits.Ladder, run: limits.Ladder, plates: limits.Ladder, own: Outcome | None) -> Figure:
    value, note = _equal_cost(solids, run, plates, own) if run.outcomes and own is not None else (None, "")
    label = "CPU of the solid over the plate's at equal error"
    return at_least("cost_ratio", label, value, "times", 20.0, against=f"cross-code: {LIMIT}", note=note)


def _equal_cost(solids: limits.Ladder, run: limits.Ladder, plates: limits.Ladder, own: Outcome):
    """CPU of the solids that were run over the plate's at one error of the path (None without), and how it came about.

    The error is that of a run of the plate. Where no solid that was run comes so near to the limit of all solids, it is
    the least that one has, and the plate's seconds are those of the line through its runs.
    """
    line = path_limit(solids)
    errors, seconds = _work(run, line)
    own_errors, own_seconds = _work(plates, line)
    wanted, spent, where = limits.error(own, line), own.get("cpu_seconds"), "where 24 x 10 elements are"
    if min(errors) > wanted:
        wanted, where = min(errors), "where the nearest solid that was run is"
        if not min(own_errors) <= wanted <= max(own_errors):
            return None, f"No run of the plate is as far from the limit as {wanted:.2f} %, {where}."
        spent = limits.cost_at(own_errors, own_seconds, wanted)
    needed = limits.cost_at(errors, seconds, wanted)
    if needed is None:
        return None, "One solid shows no cost of another error."
    return needed / spent, f"At {wanted:.2f} % of node 1's path, {where}: {needed:.0f} s for {spent:.1f} s."


def _work(own: limits.Ladder, line: np.ndarray) -> tuple[list[float], list[float]]:
    """Path errors (percent) and CPU seconds of a ladder."""
    return [limits.error(o, line) for o in own.outcomes], [o.get("cpu_seconds") for o in own.outcomes]


def _energy(found: dict[str, list[Outcome]]) -> Figure:
    own = [o for part in ("drop", "long") for o in found.get(part, []) if o.ok and o.get("ended") == "ok"]
    worst = max((o.get("energy_residual") for o in own), default=None)
    note = "Kinetic + strain + contact + dissipated - work of gravity, in percent of that work; the worst run."
    label, against = "Drift of the energy", "closed form: constant"
    return at_most("energy_residual_percent", label, worst, "%", 0.5, against=against, note=note)


def _symmetry(outcomes: Sequence[Outcome]) -> Figure:
    good = [o for o in outcomes if o.ok]
    value = None
    if len(good) == 3:
        heights = [o.get("node_1") for o in good]
        value = 100 * (max(heights) - min(heights)) / abs(heights[0])
    label, against = "Quarter, half and whole tire, path of node 1", "exact: symmetry"
    return at_most("symmetry_percent", label, value, "%", 0.1, against=against, form=".1e")


def _hard(outcomes: Sequence[Outcome]) -> Figure:
    bad = [case(o) for o in outcomes if not _ends_well(o)]
    label = "Hard cases that crash, hang, or answer wrong in silence"
    against = "ends well, the energy drifts below 5 %"
    return at_most("hard_cases_failed", label, len(bad), "", 0, against=against, note="; ".join(bad) or "None.")


def _ends_well(outcome: Outcome) -> bool:
    """Every hard case has to: none is known that a step may not carry."""
    good = outcome.ok and outcome.get("ended") == "ok" and outcome.get("finite")
    return bool(good and outcome.get("energy_residual") <= 5.0)


def case(outcome: Outcome) -> str:
    """What was asked of a run, in words."""
    told = {key: value for key, value in outcome.asked.arguments.items() if key not in ("solver", "until")}
    return ", ".join(f"{key.replace('_', ' ')} {_short(value)}" for key, value in told.items())


def _short(value: Any) -> str:
    if isinstance(value, list):
        return " x ".join(map(str, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)


RUNS = (
    Column("case", "run", "wrap"),
    Column("solver", "solver"),
    Column("elements", "elements", ",d"),
    Column("unknowns", "unknowns", ",d"),
    Column("travel", "travel", ".5f", "m"),
    Column("peak_force", "peak force", ",.0f", "N"),
    Column("footprint", "footprint", ".4f", "m²"),
    Column("lowest_ratio", "least |J|", ".4f"),
    Column("error", "path error", ".2f", "%"),
    Column("energy_residual", "energy drift", ".1e", "%"),
    Column("steps", "steps", "d"),
    Column("iterations_per_step", "iterations per step", ".1f"),
    Column("cpu_seconds", "CPU", ".1f", "s"),
    Column("ended", "ended"),
    Column("status", "status"),
)


def row(outcome: Outcome, **more: Any) -> dict[str, Any]:
    """A run as a row."""
    own = {column.key: outcome.get(column.key) for column in RUNS}
    solver = outcome.asked.arguments.get("solver", "ancf")
    elements = own["elements"] and int(own["elements"])
    if outcome.asked.arguments.get("law") == "points":
        own["footprint"] = None  # points have no area
    return (
        own | {"case": case(outcome), "solver": solver, "elements": elements, "status": outcome.measured.status} | more
    )


def rows(found: dict[str, list[Outcome]]) -> list[dict[str, Any]]:
    """Every run for the JSON, without its paths."""
    paths = {"times", "node_1", "lower", "force", "area", "ratio", "energies", "x", "y", "depth", "pressure", "trace"}
    paths |= standing.PATHS | rolling.PATHS
    return [
        {
            "part": part,
            "unit": o.measured.command,
            "status": o.measured.status,
            **{
                key: value
                for key, value in o.measured.values.items()
                if key not in paths or (key == "node_1" and part == "saved")
            },
        }
        for part, outcomes in (found | {"recorded": recorded.beyond(found.get("drop", [])).solids}).items()
        for o in outcomes
    ]


def sections(found: dict[str, list[Outcome]]) -> list[Section]:
    """The page between its verdict and its commands."""
    assumed = [f"Assumed: {words}" if "ssumed" not in words else words for words in scene_words()["assumed"]]
    made = [
        Section("tire", "What is dropped", [Bullets(assumed)], "Tire"),
        Section("drop", "The fall, both solvers", _drop(found), "Fall"),
        Section("print", "Footprint", _print(found["print"]), "Footprint"),
    ]
    if "paper" in found:
        made.append(Section("paper", "The paper's element and its contact by points", _paper(found), "Paper"))
    if "long" in found:
        made.append(Section("long", "Two seconds", _long(found["long"]), "Long run"))
    if "standing" in found:
        made.append(standing.section(found["standing"]))
    if "rolling" in found:
        made.append(rolling.section(found["rolling"]))
    if "treads" in found:
        made.append(treads.section(found["treads"]))
    left_out = [*_saved(found["saved"]), *savings.blocks(found.get("omitted", []))]
    made += [
        Section("kernels", "What an element costs", kernels.blocks(found["kernels"]), "Elements"),
        Section("saved", "What was left out, and what that saved", left_out, "Left out"),
        Section("hard", "Hard cases", _hard_table(found["hard"]), "Hard cases"),
    ]
    return made


def _drop(found: dict[str, list[Outcome]]) -> list[Block]:
    solids, run, plates, record = _ladders(found)
    smooth, off = (limits.ladder(found.get(part, []), "ancf") for part in ("smooth", "off knots"))
    outcomes = [o for part in ("drop", "off knots", "smooth") for o in found.get(part, [])]
    line = path_limit(solids) if solids.outcomes else None
    table = [
        row(o, error=limits.error(o, line) if line is not None and o.ok and o.get("ended") == "ok" else None)
        for o in outcomes
    ]
    table += [row(o, error=limits.error(o, line), case=f"{case(o)}, recorded") for o in record.solids]
    blocks: list[Block] = [
        Text([*CHOSEN, record.words] if record.words else CHOSEN),
        Table("One quarter of the tire; forces and areas are the whole tire's.", RUNS, table),
        Table("Orders and limits.", ORDERS, list(_orders(solids, plates))),
        Table("Misfit of the undeformed mesh.", MISFIT, [_misfit(o) for o in found.get("misfit", []) if o.ok]),
    ]
    if not solids.outcomes or not plates.outcomes:
        return blocks
    best = [
        (o, "ancf", f"plate, {_short(o.asked.arguments['mesh'])}")
        for o in plates.outcomes
        if o.asked.arguments["mesh"] == MESH
    ]
    best += [(run.outcomes[-1], "reference", "finest solid that was run")]
    best += [(o, "ancf exact", "plate, no kinks") for o in smooth.outcomes if o.asked.arguments["mesh"] == MESH]
    plots = []
    for key, words, unit in (
        ("node_1", "Node 1, the top of the tire", "displacement (m)"),
        ("force", "Force of the ground", "force (N)"),
        ("area", "Pressed area", "area (m²)"),
        ("ratio", "|J| at the tread's lower centre", "|J|"),
    ):
        series = [Series(label, role, o.get("times"), o.get(key)) for o, role, label in best]
        if key == "node_1":
            series.append(Series("limit of the solids", "difference", run.outcomes[-1].get("times"), line))
        plots.append(
            (history_plot(f"drop-{key}", words, f"{words} over time.", ("t (s)", unit), series, None), f"{words}.")
        )
    work = [
        Series(name, role, *_work(own, line)[::-1])
        for name, role, own in (
            ("plate", "ancf", plates),
            ("plate, lines beside knots", "difference", off),
            ("plate, no kinks", "ancf exact", smooth),
            ("solid", "reference", run),
        )
        if own.outcomes
    ]
    plots.append(
        (
            log_plot("work", "Error against CPU time", "Path error over CPU.", work, "CPU (s)", "path error (%)"),
            "Speed against error.",
        )
    )
    return [*blocks, Plots(plots)]


def _misfit(o: Outcome) -> dict[str, Any]:
    return {"mesh": _short(o.asked.arguments["mesh"]), "middle": o.get("middle"), "half": o.get("half")}


ORDERS = (
    Column("solver", "solver"),
    Column("number", "number"),
    Column("order", "observed order", ".2f"),
    Column("limit", "limit", ".5g"),
    Column("how", "how", "wrap"),
)


def _orders(solids: limits.Ladder, plates: limits.Ladder):
    for name, own in (("reference", solids), ("ancf", plates)):
        for key in NUMBERS if own.outcomes else ():
            limit, how = own.limit(key)
            order = own.convergence(key).order
            yield {"solver": name, "number": key.replace("_", " "), "order": order, "limit": limit, "how": how}


def _print(outcomes: Sequence[Outcome]) -> list[Block]:
    plots, words = [], []
    for o in outcomes:
        solver = o.asked.arguments.get("solver", "ancf")
        if not o.ok:
            words.append(f"{solver}: {o.measured.status}")
            continue
        x, y, p = (np.array(o.get(key)) for key in ("x", "y", "pressure"))
        title = f"Contact pressure at 0.18 s, {solver}"
        x, y, p = np.concatenate([x, -x]), np.tile(y, 2), np.tile(p, 2) / 1e6
        x, y, p = np.tile(x, 2), np.concatenate([y, -y]), np.tile(p, 2)
        plots.append(
            (
                map_plot(f"print-{solver}", title, "Pressure over the tread.", x, y, p, "pressure (MPa)"),
                f"{title}; mirrored about both planes.",
            )
        )
        words.append(f"{solver}: the greatest pressure deeper than 0.03 m in a groove is {o.get('in_grooves'):.3g} Pa.")
    return [Plots(plots), Text(words)]


def _paper(found: dict[str, list[Outcome]]) -> list[Block]:
    words = [
        "The paper's element is conforming, with one point fewer each way for the change of volume; beside it the "
        "contact by points with Table 7 as printed, which depends on how many points there are."
    ]
    table = [row(o) for part in ("paper", "points") for o in found[part]]
    return [Text(words), Table("The paper's choices.", RUNS, table)]


def _long(outcomes: Sequence[Outcome]) -> list[Block]:
    good = [o for o in outcomes if o.ok and o.get("times")]
    plots = []
    for o in good:
        path = Series("node 1", "ancf", o.get("times"), o.get("node_1"))
        plots.append(
            (
                history_plot("long-path", "Several bounces", "Node 1.", ("t (s)", "displacement (m)"), [path], None),
                "Node 1 over 2 s.",
            )
        )
        roles = {"kinetic": "ancf", "strain": "reference", "contact": "difference", "dissipated": "ancf exact"}
        parts = [Series(kind, role, o.get("times"), o.get("energies")[kind]) for kind, role in roles.items()]
        plots.append(
            (
                history_plot("long-energy", "Energies", "Energies.", ("t (s)", "energy (J)"), parts, None),
                "Where the energy is.",
            )
        )
    rises = max((o.get("energy_gain") for o in good), default=0.0)
    words = f"The energy without the work of gravity rises by {rises:.1e} % of that work at most."
    return [Table(words, RUNS, [row(o) for o in outcomes]), Plots(plots)]


SAVED = (
    Column("part", "part"),
    Column("elements", "elements", ",d"),
    Column("unknowns", "unknowns", ",d"),
    Column("cpu_per_step", "CPU per step", ".3f", "s"),
    Column("memory", "memory", ".0f", "MB"),
    Column("node_1", "node 1 after 20 steps", ".8f", "m"),
    Column("force", "force", ",.2f", "N"),
    Column("status", "status"),
)


def _saved(outcomes: Sequence[Outcome]) -> list[Block]:
    table = [
        {column.key: o.get(column.key) for column in SAVED}
        | {"part": o.asked.arguments["part"], "elements": o.ok and int(o.get("elements")), "status": o.measured.status}
        for o in outcomes
    ]
    words = [
        "The scene states two planes of symmetry, so three quarters of the tire are not modelled. The same fall from "
        "the first touch on, 20 steps of the plate: equal answers, the costs beside them.",
        "Not in the scene and not paid for: rim, inflation, plies, heat, damping of the rubber.",
    ]
    return [Text(words), Table("Parts of the tire.", SAVED, table)]


def _hard_table(outcomes: Sequence[Outcome]) -> list[Block]:
    words = ["Far from the scene, on 12 x 6 elements of the whole tire: each has to end well."]
    return [Text(words), Table("Hard cases.", RUNS, [row(o) for o in outcomes])]
