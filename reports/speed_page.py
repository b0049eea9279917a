"""The page of the speed exhibit: every measurement as a table, growth and work-precision as plots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from compare.plots import Series, log_plot
from compare.report import Block, Bullets, Column, Commands, Facts, Page, Plots, Section, Table, Text, Verdict
from compare.verdict import Figure
from reports.speed_curves import NAMES, Curves
from reports.unit import Measured, measurements

TITLE = "What both solvers cost"
LEAD = (
    "Microseconds per element, seconds per run and seconds per correct digit of the ANCF plate solver and of the "
    "solid reference, measured on this machine, one thread each, beside other codes where they are installed."
)
KERNELS = (
    Column("plate", "plate"),
    Column("elements", "elements", ",d"),
    Column("distinct", "distinct shapes", ",d", about="number of constant tensors that are stored"),
    Column("setup_seconds", "set-up", ".3f", "s CPU"),
    Column("force_us", "force", ".2f", "µs per element", group="element arrays alone"),
    Column("tangent_us", "tangent", ".2f", "µs per element", group="element arrays alone"),
    Column("tangent_ratio", "tangent", ".3f", "of the first", group="element arrays alone", about="median over rounds"),
    Column("assembled_force_us", "force", ".2f", "µs per element", group="summed into the global arrays"),
    Column("assembled_tangent_us", "tangent", ".2f", "µs per element", group="summed into the global arrays"),
)
RUBBER = (
    Column("element", "element"),
    Column("volumetric", "volume", about="how its energy is integrated"),
    *KERNELS[:2],
    Column("points", "points", ".1f", "per element"),
    Column("force_us", "force", ".2f", "µs per element"),
    Column("tangent_us", "tangent", ".2f", "µs per element"),
)
GROWTH = (*KERNELS[:7], Column("peak_mb", "peak memory", ".0f", "MiB", about="of the whole process, both plates"))
RUNS = (
    Column("what", "run"),
    Column("unknowns", "unknowns", ",d"),
    Column("steps", "steps", ",d"),
    Column("newton_iterations", "Newton iterations", ",d"),
    Column("factorisations", "factorisations", ",d"),
    Column("height", "height of P", ".6f", "m"),
    Column("setup_seconds", "set-up", ".3f", "s CPU"),
    Column("cpu_seconds", "whole run", ".3f", "s CPU"),
    Column("wall_seconds", "whole run", ".3f", "s wall"),
    Column("peak_mb", "peak memory", ".0f", "MiB"),
    Column("status", "status"),
)
CURVE = (
    Column("series", "solver"),
    Column("mesh", "mesh"),
    Column("unknowns", "unknowns", ",d"),
    Column("height", "height of P", ".6f", "m"),
    Column("error", "error", ".3g", "%"),
    Column("newton_iterations", "Newton iterations", ",d"),
    Column("factorisations", "factorisations", ",d"),
    Column("wall_seconds", "least", ".3f", "s wall"),
    Column("cpu_seconds", "least", ".3f", "s CPU"),
    Column("peak_mb", "peak memory", ".0f", "MiB"),
    Column("status", "status"),
)
COSTS = (
    Column("solver", "solver"),
    Column("percent", "error", "g", "%"),
    Column("seconds", "cost", ".3g", "s wall"),
    Column("cpu_seconds", "cost", ".3g", "s CPU"),
    Column("refused", "refused because", "wrap"),
)


OWN_STEPS = (
    *CURVE[:2],
    Column("time_step", "time step", "g", "s"),
    Column("steps", "steps", ",d"),
    *CURVE[3:9],
)
LOOKS = {"enriched": "ancf", "conforming": "ancf exact", "reference": "reference", "calculix": "difference"}


def page(found: dict[str, Any], judged: Sequence[Figure], curves: Curves, budget: str, about: dict[str, Any]) -> Page:
    """The page; `found` is what reports.speed.gather returned."""
    asked = [figure for figure in judged if figure.judged]
    parts = [
        Section("verdict", "Verdict", [Text([_summary(asked, budget)]), Verdict(judged)]),
        Section("kernels", "Microseconds per element", list(_kernels(found)), "Elements"),
        Section("runs", "Whole runs", list(_runs(found)), "Runs"),
        Section("steps", "Where a run spends its time", list(_splits(found)), "Split"),
        Section("precision", "Work and precision", list(_precision(found, curves)), "Precision"),
        Section("peers", "Other codes", [_peers(found)], "Peers"),
        Section("limits", "What these numbers do not say", [Bullets(LIMITS)], "Not said"),
        Section("again", "Every number again", [_commands(found, judged)], "Again"),
        Section("provenance", "Provenance", [_provenance(about, found["load"])], "Provenance"),
    ]
    return Page(TITLE, LEAD, parts, f"Groovecheck, {about['date']}")


def _summary(asked: Sequence[Figure], budget: str) -> str:
    met = [figure for figure in asked if figure.met]
    missed = [figure.label for figure in asked if figure.met is False]
    words = f"Budget {budget}: {len(met)} of {len(met) + len(missed)} judged figures met."
    words += f" Missed: {'; '.join(missed)}." if missed else ""
    left = len(asked) - len(met) - len(missed)
    return words + (f" {left} not judged: this budget or machine did not run what they need." if left else "")


def _failure(measured: Measured | None) -> Iterator[Block]:
    if measured is not None and not measured.ok:
        yield Text([f"{measured.name}: {measured.status}"])


def _kernels(found: dict[str, Any]) -> Iterator[Block]:
    kernels, growth = found["kernels"], found["growth"]
    yield from _failure(kernels)
    notes = [
        "Least CPU time of many calls on one thread at a randomly deformed state; plates that share shapes in turn.",
        "Elements that share shape and groove share one constant tensor, which stays in the cache. Where all differ, "
        "each tensor (0.36 MB) is read from memory once per evaluation, and reading it is what is paid for.",
        "Point by point is the plain twin: the same integrals by a loop over their points, all elements at once.",
    ]
    if kernels.ok:
        notes.append(f"A BLAS matrix product ran at {kernels.get('product_gflops'):.0f} GFlop/s in the same process.")
    yield Table("Force and tangent of 16x16 elements, SVK, exact rule", KERNELS, kernels.get("rows") or [], notes)
    yield from _failure(found["rubber"])
    about_rubber = ["Integrated point by point; the plate stretched by 10 % and disturbed at random."]
    yield Table("Mooney-Rivlin, element arrays alone", RUBBER, found["rubber"].get("rows") or [], about_rubber)
    for run in growth:
        yield from _failure(run)
    rows = [{**row, "peak_mb": run.get("peak_mb")} for run in growth for row in run.get("rows") or []]
    yield Table("Growth with the number of elements", GROWTH, rows)
    series = [
        Series(f"{what}, {plate}", role, [r["elements"] for r in own], [r[f"{what}_us"] for r in own])
        for (what, plate), role in LINES.items()
        if (own := [r for r in rows if r["plate"] == plate])
    ]
    about = "Microseconds per element against the number of elements, plain and with five grooves."
    svg = log_plot("growth", "Cost of an element", about, series, "elements", "µs per element")
    yield Plots([(svg, "CPU time of an element's force and tangent as the plate grows: flat is ideal.")])


LINES = {
    ("tangent", "plain"): "ancf",
    ("tangent", "five grooves"): "ancf exact",
    ("force", "plain"): "reference",
    ("force", "five grooves"): "difference",
}


def _runs(found: dict[str, Any]) -> Iterator[Block]:
    rows = [_row(run, f"ANCF {run.arguments['mesh']}x{run.arguments['mesh']}") for run in found["ancf"]]
    rows += [_row(run, f"reference h={run.arguments.get('size', 0):g}") for run in found["reference"]]
    yield Table(
        "Plain cantilever, point load", RUNS, rows, ["CPU and wall of the solver's own solve(): mesh included."]
    )
    table5 = found["table5"]
    if table5 is not None:
        yield from _failure(table5)
        columns = [Column("scene", "scene"), Column("mesh", "elements a side", "d"), RUNS[5], RUNS[8]]
        yield Table("Table 5, both columns", columns, table5.get("rows") or [])
    many = found["many"]
    if many is not None:
        yield from _failure(many)
        keys = ("unknowns", "tetrahedra", "setup_seconds", "newton_iterations", "factorisations", "peak_mb")
        steps = ", ".join(f"{seconds:.2f}" for seconds in many.get("step_seconds") or [])
        yield Facts([("large reference mesh", f"{key} {many.get(key)}") for key in keys] + [("steps (s wall)", steps)])


def _row(run: Measured, what: str) -> dict[str, Any]:
    return {"what": what, "status": run.status, **run.values}


def _splits(found: dict[str, Any]) -> Iterator[Block]:
    """Seconds and shares by part of each run that tells them."""
    ancf = [(f"ANCF {run.arguments['mesh']}x{run.arguments['mesh']}", run) for run in found["ancf"] if run.ok]
    solved = sorted((run for run in found["reference"] if run.ok), key=lambda run: run.get("cpu_seconds") or 0.0)
    solid = [(f"reference, {run.get('unknowns')} unknowns", run) for run in solved[:1]]
    for caption, runs, per_step in (("ANCF, CPU", ancf, True), ("Reference, wall", solid, True)):
        rows = [_split(name, run, run.get("steps") if per_step else 1) for name, run in runs]
        parts = list(runs[0][1].get("split")) if runs else []
        columns = [Column("what", "run"), *(Column(part, part, ".3g", "ms per step") for part in parts)]
        yield Table(f"Milliseconds per step ({caption}); set-up and mesh spread over the steps", columns, rows)
    many = found["many"]
    if many is not None and many.ok:
        columns = [Column(part, part, ".3f", "s wall") for part in many.get("split")]
        yield Table("One full Newton iteration of the large reference mesh", columns, [many.get("split")])


def _split(name: str, run: Measured, steps: int) -> dict[str, Any]:
    return {"what": name, **{part: 1e3 * seconds / steps for part, seconds in run.get("split").items()}}


def _precision(found: dict[str, Any], curves: Curves) -> Iterator[Block]:
    for run in (found["curve"], found["own_steps"], *found["curve_calculix"]):
        yield from _failure(run)
    series = [Series(NAMES[name], LOOKS[name], curves.seconds(name), curves.errors(name)) for name in curves.drawn]
    about = (
        f"Error in percent of {curves.target_words} against wall time of {', '.join(line.label for line in series)}."
    )
    svg = log_plot(
        "work-precision", "Work and precision", about, series, "wall time (s), least of all runs", "error (%)"
    )
    yield Plots([(svg, f"Patch-loaded plain cantilever: error against {curves.target_words}. Lower left is better.")])
    rows = [
        {**row, "error": error, "series": NAMES[name]}
        for name in curves.drawn
        for row, error in zip(curves.rows[name], curves.errors(name), strict=True)
    ]
    limits = [
        f"{NAMES[name]}: own extrapolated value {seen.extrapolated:.6f} m, order {seen.order:.2f}."
        if seen.extrapolated is not None
        else f"{NAMES[name]}: no extrapolated value: {seen.refused}."
        for name, seen in curves.convergence.items()
        if curves.rows[name]
    ]
    limits.append(
        "Gauss points of each subdomain: 5x5x3 in enriched elements (height within 2e-5), 7x7x3 in conforming."
    )
    yield Table("Levels", CURVE, rows, [words.replace("-", "\u2212") for words in limits])
    costs = [{**cost, "solver": NAMES[cost["solver"]]} for cost in curves.costs()]
    yield Table("Cost of a stated error", COSTS, costs, curves.why(1.0))
    yield from _paid_for(found)
    own = found["own_steps"]
    if own is not None and own.ok and curves.target:
        limit = curves.target + own.get("time_shift")
        rows = [
            {**row, "series": NAMES[row["series"]], "error": 100 * abs(row["height"] / limit - 1)}
            for row in own.get("rows")
        ]
        note = f"Errors from {limit:.6f} m, {curves.target_words} less the error of its time steps."
        yield Table("Every mesh at every time step", OWN_STEPS, rows, [note.replace("-", "\u2212")])


def _paid_for(found: dict[str, Any]) -> Iterator[Block]:
    """Where the two runs that reach 1 % spend their time, and what no programming could spare."""
    for run in found["one_percent"]:
        yield from _failure(run)
    if not found["one_percent"] or not all(run.ok for run in (*found["one_percent"], found["kernels"])):
        return
    ours, solid = found["one_percent"]
    n, size, gflops = ours.arguments["mesh"], solid.arguments["size"], found["kernels"].get("product_gflops")
    spent, calls, gflop, bare = (ours.get(name) for name in ("split", "calls", "gflop", "bare"))
    rows = [{"part": part, "calls": calls.get(part), "ms": 1e3 * seconds} for part, seconds in spent.items()]
    for row in rows:
        row |= {"floor": _at(gflop.get(row["part"]), gflops), "bare": _ms(bare.get(row["part"]))}
    rows = [{**row, "us": 1e3 * row["ms"] / row["calls"] if row["calls"] else None} for row in rows]
    yield Table(f"What the first level within 1 % pays for: ANCF, {n}x{n} enriched", PAID, rows)
    split = {"what": f"reference, h={size:g}", **{part: 1e3 * seconds for part, seconds in solid.get("split").items()}}
    columns = [Column("what", "run"), *(Column(part, part, ".3g", "ms") for part in solid.get("split"))]
    yield Table("The same of the reference (wall of the whole run)", columns, [split])
    mine, theirs, floor = ours.get("cpu_seconds"), solid.get("cpu_seconds"), sum(gflop.values()) / gflops
    alone = sum(bare.values())
    words = (
        f"The ANCF run takes {mine:.3g} s of CPU and the reference {theirs:.3g} s, {theirs / mine:.3g} times as much. "
        f"Its products with tensors, factors and solutions alone, called through NumPy and LAPACK with all data in the "
        f"cache, take {alone:.3g} s: without interpreter, assembly and set-up the ratio would be {theirs / alone:.3g}, "
        f"with the present set-up {theirs / (alone + spent['set-up']):.3g}. "
        f"At the speed of a BLAS product of large matrices the {sum(gflop.values()):.2g} GFlop, set-up included, would "
        f"take {floor:.2g} s and the ratio would be {theirs / floor:.3g}. "
        f"A ratio of 50 leaves {1e3 * theirs / 50:.2g} ms for all of it."
    )
    yield Text([words])


def _ms(seconds: float | None) -> float | None:
    """Milliseconds, None where they are not known."""
    return None if seconds is None else 1e3 * seconds


def _at(gflop: float | None, gflops: float) -> float | None:
    """Milliseconds of so many operations, None where they are not counted."""
    return None if gflop is None else 1e3 * gflop / gflops


PAID = (
    Column("part", "part"),
    Column("calls", "calls", ",d"),
    Column("us", "a call", ".0f", "µs CPU"),
    Column("ms", "whole run", ".3g", "ms CPU"),
    Column("bare", "its products alone", ".3g", "ms CPU", about="the same calls with nothing between them"),
    Column("floor", "its products at BLAS speed", ".2g", "ms", about="as large matrices would be multiplied"),
)


def _peers(found: dict[str, Any]) -> Table:
    ours = [{**_row(run, "reference"), "cpu_seconds": run.get("cpu_seconds")} for run in found["reference"]]
    rows = [*ours, *(_row(run, "CalculiX, same mesh and steps") for run in found["calculix"])]
    if found["exudyn"] is not None:
        mesh = found["exudyn"].arguments["mesh"]
        rows.append(_row(found["exudyn"], f"Exudyn thin plate {mesh}x{mesh}"))
        rows.append(_row(found["exudyn_ours"], f"ANCF {mesh}x{mesh}, same steps"))
    return Table("Peers that are installed, in this run", (*RUNS[:3], RUNS[5], RUNS[7], RUNS[8], RUNS[10]), rows, PEERS)


PEERS = (
    "CalculiX: CPU and wall of the whole ccx process; ours: of solve(). C3D10 integrates at four points, ours exactly.",
    "Exudyn: the time steps alone. Its Kirchhoff plate is another model: read its cost, not its height.",
)
LIMITS = (
    "What a solve costs on another machine: ratios travel, seconds do not.",
    "What two threads would save: each process has one.",
    "Times taken while the machine did other things are too long, never too short; CPU times suffer less.",
    "Error here is distance from one extrapolated value in space at a common time step, not from the truth.",
)


def _commands(found: dict[str, Any], judged: Sequence[Figure]) -> Commands:
    """Every command, with the figures that it measures again."""
    names = {run.command: [f.name for f in judged if f.note.endswith(run.command)] for run in measurements(found)}
    items = [(", ".join(figures) or "another row of the tables", command) for command, figures in names.items()]
    return Commands([("make bench", "this page"), *((command, what) for what, command in items)])


def _provenance(about: dict[str, Any], load: float) -> Facts:
    versions = ", ".join(f"{name} {number or 'absent'}" for name, number in about["versions"].items())
    facts = [(key, value) for key, value in about.items() if key != "versions"]
    return Facts([*facts, ("load before", f"{load:.1f} processes wanted the machine"), ("versions", versions)])
