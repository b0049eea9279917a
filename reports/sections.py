"""Sections that every exhibit shares: scene, tables, plots, pictures, provenance, from a study's entries."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from compare import figures, plots
from compare.convergence import pairwise_orders
from compare.difference import common_times
from compare.explain import statement
from compare.report import Bullets, Column, Commands, Facts, Gallery, Plots, Section, Table, Text
from compare.result import Result
from compare.scene import Rectangle, Scene
from compare.sketch import sketch
from compare.study import AS_STATED, Entry, level_name
from compare.table import answer, digits, farther, history, in_ladders, judgements, quantity, rest, unit
from compare.verdict import Figure
from reports.bodies import bodies, opened
from reports.ladders import NAMES, Ladder, by_mode, error_target, ladders, limit_errors, named, scenes
from reports.speed_curves import cost_to

COLUMNS = (
    Column("mode", "mode", "d"),
    Column("mesh", "mesh"),
    Column("solver", "solver"),
    Column("element", "element"),
    Column("rule", "rule", about="Gauss points in each subdomain, along x, y and z"),
    Column("level", "level", "d"),
    Column("unknowns", "unknowns", ",d"),
    Column("h", "h", ".4g", "m"),
    Column("value", "value", ".5f", "m", "height of the answer probe"),
    Column("paper", "paper", ".4f", "m"),
    Column("error_paper_percent", "vs paper", "+.3f", "%"),
    Column("error_reference_percent", "vs reference", "+.3f", "%"),
    Column("error_limit_percent", "vs limit", "+.3f", "%", "the Richardson value of the same series"),
    Column("order", "order", ".2f", "observed"),
    Column("sequence", "sequence"),
    Column("extrapolated", "Richardson", ".5f", "m"),
    Column("gci_percent", "GCI band", ".3f", "± %"),
    Column("wall_seconds", "wall time", ".2f", "s"),
    Column("peak_mb", "peak memory", ",.0f", "MiB"),
    Column("newton_iterations", "Newton", ",d", "iterations"),
    Column("status", "status"),
)
PICTURED = 6  # modes at most
REACH = 0.1  # of the plate's size: the largest displacement of a pictured mode
SEEN = 0.01  # of the plate's size: smaller displacements are drawn larger
IN_HERTZ = {
    "value": Column("value", "frequency", ".6g", "Hz"),
    "extrapolated": Column("extrapolated", "Richardson", ".6g", "Hz"),
}


def scene_section(stated: Sequence[Scene]) -> Section:
    """Sketch, source and assumptions of the scenes."""
    distinct = {(scene.grooves, scene.loads): scene.name for scene in reversed(stated)}
    drawn = [(sketch(scene), scene.title) for scene in stated if scene.name in distinct.values()]
    said = list(dict.fromkeys(words for scene in stated for words in scene.assumed))
    blocks = [Plots(drawn), Text(["Read or assumed where the source is silent:"] if said else [])]
    facts = [("scene", stated[0].name), ("source", stated[0].source or "none given"), *statement(stated[0])]
    return Section("scene", "The question", [*blocks, Bullets(said), Facts(facts)], "Question")


def table_section(entries: Sequence[Entry], rows: Sequence[dict[str, Any]]) -> Section:
    """One full table per scene, with what its numbers are judged against below it."""
    blocks = []
    kept, judged = in_ladders(list(entries)), judgements(list(entries))
    rows = [{**row, "error_limit_percent": error} for row, error in zip(rows, limit_errors(entries), strict=True)]
    for scene in scenes(entries):
        chosen = [i for i, entry in enumerate(kept) if entry.scene.name == scene.name]
        groove, load = rows[chosen[0]]["groove"], rows[chosen[0]]["load"]
        vibrates = scene.analysis.kind == "modes"
        caption = f"{scene.title} (groove: {groove}{'' if vibrates else f'; load: {load}'})"
        shown = [kept[i] for i in chosen]
        form = digits(map(answer, shown), rest(shown))
        in_metres = {"value": (form, quantity(scene)), "extrapolated": (form, "")}
        columns = [IN_HERTZ.get(c.key, c) if vibrates else _formed(c, *in_metres.get(c.key, ())) for c in COLUMNS]
        columns = [c for c in columns if any(rows[i].get(c.key) is not None for i in chosen)]
        notes = [*_judged(scene, [judged[i] for i in chosen], form), _timed(shown), *_failed(shown)]
        blocks.append(Table(caption, columns, opened([rows[i] for i in chosen], shown), notes))
    views = bodies(entries)
    return Section("tables", "All rows", [views, *blocks] if views else blocks)


def _formed(column: Column, form: str = "", about: str = "") -> Column:
    """The column in another format, and with another hint, where there is one."""
    return replace(column, form=form or column.form, about=about or column.about)


def _judged(scene: Scene, judged: Sequence[dict[str, Any]], form: str) -> list[str]:
    """What the columns of a scene's table are judged against. form: of answers."""
    vibrates = scene.analysis.kind == "modes"
    of = "" if vibrates or scene.answer != "height" else ", measured from the height at rest"
    notes = [f"Differences in percent of the value they are judged against{of}; positive: {farther(scene)}."]
    if scene.published:
        printed = f"paper, vs paper: published, {scene.published.source}, the row of the same mesh"
        notes.append(printed + (", for the reference its converged row." if scene.published.converged else "."))
    reference = next((found["reference"] for found in judged if found["reference"]), None)
    if reference:
        value = f"{reference['value']:{form}} m".replace("-", "\u2212")
        value = "the same mode" if vibrates else value
        notes.append(f"vs reference: {reference['kind']}, {reference['source']} ({reference['cell']}, {value}).")
    notes.append(
        "vs limit: the Richardson value of the whole series, where it has one (see the limits of the ladders)."
    )
    notes.append("Order, sequence, Richardson value and band: of the levels of the same series up to that row.")
    return notes


def _timed(entries: Sequence[Entry]) -> str:
    """Of how many runs the wall times are the least."""
    counts = sorted({entry.repeats for entry in entries if entry.ok})
    runs = f"{counts[0]} to {counts[-1]} runs" if len(counts) > 1 else f"{counts[0]} runs" if counts else "no run"
    beside = sum(bool(entry.result.facts.get("beside")) for entry in entries if entry.ok)
    words = f" {beside} of {len(entries)} may have shared the machine with another run (--timed runs each alone)."
    return (
        f"Wall time: least of {runs} in one process, one thread; the start of the process is not in it."
        f"{words if beside else ' No other run of the study shared the machine.'}"
    )


def _failed(entries: Sequence[Entry]) -> list[str]:
    failed = [f"{named(e.solver)} {level_name(e.level)}: {e.status}. {e.message}" for e in entries if not e.ok]
    return list(dict.fromkeys(failed))


def plot_sections(entries: Sequence[Entry]) -> list[Section]:
    """Value against h, error against h, error against time and histories, one plot per scene and mode in each."""
    values, errors, work, paths = [], [], [], []
    for scene, found in ((s, found) for s in scenes(entries) for found in by_mode(ladders(entries, s.name))):
        if not any(ladder.solved for ladder in found):
            continue
        values.append(_value_plot(scene, found))
        target = error_target(found)
        if target and any(error > 0 for ladder in found for error in ladder.errors(target[0]) or ()):
            errors.append(_error_plot(scene, found, *target))
            work.append(_work_plot(scene, found, *target))
        paths.append(None if scene.analysis.kind == "modes" else _history_plot(scene, found))
    paths = [path for path in paths if path]
    if len(values) == 1:
        return [Section("plots", "Value, error, work and path", [Plots([*values, *errors, *work, *paths])], "Plots")]
    return [
        Section("values", "Value against element size", [Plots(values)], "Value against h"),
        Section("errors", "Error against element size", [Plots(errors)], "Error against h"),
        Section("work", "Error against time", [Plots(work)]),
        *([Section("history", "The path of the answer", [Plots(paths)], "Path")] if paths else []),
    ]


def _titled(scene: Scene, found: Sequence[Ladder]) -> tuple[str, str]:
    """Name and title of the plots of one height or mode."""
    mode = found[0].mode
    return (f"{scene.name}-mode-{mode}", f"{scene.title}, mode {mode}") if mode else (scene.name, scene.title)


def _value_plot(scene: Scene, found: Sequence[Ladder]) -> tuple[str, str]:
    lines = [plots.Series(f.label, f.role, f.h, f.values) for f in found if f.solved]
    limits = [_limit(ladder) for ladder in found if ladder.solved]
    if scene.published:
        sizes = {getattr(e.level, "mesh", None): e.result.h for f in found for e in f.solved}
        known = [(sizes[row.mesh], row.value) for row in scene.published.rows if row.mesh in sizes]
        lines.append(plots.Series("paper", "paper", [h for h, _ in known], [v for _, v in known]))
        if scene.published.converged:
            limits.append(plots.Limit("paper, converged", "paper", scene.published.converged.value))
    refused = [f"{f.label}: {f.convergence.refused}" for f in found if f.convergence.refused]
    name, title = _titled(scene, found)
    caption = f"{title}. Right, magnified: finest value and its GCI band, hollow the Richardson value."
    caption += f" No band for {'; '.join(refused)}." if refused else ""
    what = quantity(scene, found[0].mode)
    about = f"{what[0].upper()}{what[1:]} over element size for {', '.join(line.label for line in lines)}."
    return plots.value_plot(f"values-{name}", title, about, f"{what} ({unit(scene)})", lines, limits), caption


def _limit(ladder: Ladder) -> plots.Limit:
    seen, band = ladder.convergence, ladder.convergence.band
    ends = (band.lower, band.upper) if band else (None, None)
    return plots.Limit(ladder.label, ladder.role, answer(ladder.finest), seen.extrapolated, *ends)


def _error_plot(scene: Scene, found: Sequence[Ladder], target: float, what: str) -> tuple[str, str]:
    lines = []
    for ladder in found:
        if ladder.solved:
            errors = ladder.errors(target) or [0.0] * len(ladder.h)
            shown = [(h, e) for h, e in zip(ladder.h, errors, strict=True) if e > 0]
            slopes = pairwise_orders([h for h, _ in shown], [e for _, e in shown]) if len(shown) > 1 else []
            slope = f", slope {slopes[-1]:.2f}".replace("-", "\u2212") if slopes else ""
            lines.append(plots.Series(ladder.label + slope, ladder.role, [h for h, _ in shown], [e for _, e in shown]))
    name, title = _titled(scene, found)
    caption = f"{title}. Difference from {what}; slope: observed between the two finest levels shown."
    drawn = plots.log_plot(
        f"errors-{name}", f"Error: {title}", caption, lines, "element size h (m)", "|difference| (%)"
    )
    return drawn, caption


def _work_plot(scene: Scene, found: Sequence[Ladder], target: float, what: str) -> tuple[str, str]:
    lines = []
    for ladder in (f for f in found if f.solved and f.errors(target)):
        seconds, errors = [e.wall_seconds for e in ladder.solved], ladder.errors(target)
        cost, _ = cost_to(errors, seconds, 1.0)
        label = ladder.label + (f", 1 % in {cost:.2g} s" if cost is not None else "")
        lines.append(plots.Series(label, ladder.role, seconds, errors))
    name, title = _titled(scene, found)
    caption = f"{title}. Difference from {what} against wall time, one thread, least of the runs."
    drawn = plots.log_plot(f"work-{name}", f"Work: {title}", caption, lines, "wall time (s)", "|difference| (%)")
    return drawn, caption


def _history_plot(scene: Scene, found: Sequence[Ladder]) -> tuple[str, str] | None:
    """The finest level of each solver over time, and their difference where both have the same output times."""
    finest = {}
    for ladder in found:
        if ladder.finest and (ladder.role != "ancf exact"):
            finest[ladder.solver] = ladder.finest
    paths = [
        plots.Series(
            f"{named(s)} {level_name(e.level)}",
            s if s in NAMES else "third",
            _parameter(e.result),
            history(e),
        )
        for s, e in finest.items()
    ]
    paths = [path for path in paths if len(path.x) > 2]
    if not paths:
        return None
    residual, pair = None, [path for path in paths if path.role in NAMES]
    if len(pair) == 2:
        one, other = pair
        mine, theirs = common_times(one.x, other.x)
        apart = 1e3 * (one.y[mine] - other.y[theirs])
        residual = plots.Series(f"{one.label} minus {other.label}", "difference", one.x[mine], apart)
    labels = ("time (s)" if scene.analysis.kind == "dynamic" else "load parameter", f"{quantity(scene)} (m)")
    caption = f"{scene.title}. Each solver at its finest level of this run."
    drawn = plots.history_plot(f"history-{scene.name}", f"Path: {scene.title}", caption, labels, paths, residual)
    return drawn, caption


def _parameter(result: Result) -> np.ndarray:
    """Time or load parameter of each output."""
    return result.times if result.load_parameter is None else result.load_parameter


def opinions_section(found: Sequence[dict[str, Any]]) -> Section | None:
    """Table of other codes' heights."""
    if not found:
        return None
    columns = (
        Column("scene", "scene"),
        Column("kind", "kind"),
        Column("cell", "cell or model"),
        Column("value", "height", _finest_form(found, "value"), "m"),
        Column("reference_percent", "reference against it", "+.3f", "%"),
        Column("ancf_percent", "ANCF against it", "+.3f", "%"),
    )
    notes = ["Each solver at its finest level of this run; percent of the displacement, positive: farther from rest."]
    notes += dict.fromkeys(f"{line['kind']}: {line['source']}." for line in found)
    table = Table("Heights by other codes for the same question", columns, found, notes)
    return Section("opinions", "Third opinions", [table])


def information(figures: Sequence[Figure]) -> Table:
    """Figures of which nothing is asked."""
    columns = [
        Column("label", "figure", "wrap"),
        Column("value", "value", ".5g"),
        Column("unit", "unit"),
        Column("against", "beside", "wrap"),
        Column("note", "note", "wrap"),
    ]
    known = [figure for figure in figures if figure.value is not None]
    rows = [{**vars(figure), "unit": figure.unit or "1"} for figure in known]
    left = [figure.label for figure in figures if figure.value is None]
    notes = [f"Without a value in this run: {'; '.join(left)}."] if left else []
    return Table("Stated for information; nothing is asked of these", columns, rows, notes)


def sensitivity_section(changes: Sequence[dict[str, Any]]) -> Section | None:
    """How the answer moves when an assumption is changed."""
    if not changes:
        return None
    measured = changes[0]["unit"]
    what, form = "answer" if measured == "m" else "first frequency", digits(row["value"] for row in changes)
    columns = [
        Column("variant", "variant"),
        Column("solver", "solver"),
        Column("mesh", "mesh"),
        Column("rule", "rule"),
        Column("value", "value", form, measured),
        Column("change_percent", "change", "+.3f", "%"),
        Column("paper", "paper", ".4f", "m"),
        Column("error_paper_percent", "vs paper", "+.3f", "%"),
        Column("status", "status"),
    ]
    moved = [row for row in changes if row["change_percent"] is not None and row["variant"] != AS_STATED]
    many = len({row["solver"] for row in moved}) > 1
    bars = [
        plots.Bar(row["variant"] + (f" ({named(row['solver'])})" if many else ""), row["solver"], row["change_percent"])
        for row in moved
    ]
    words = (
        f"Change of the {what} when one assumption is another, in percent of it as stated; positive: farther from rest."
    )
    drawn = plots.bar_plot("sensitivity", "Sensitivity", words, bars, f"change of the {what} (%)")
    blocks = [Plots([(drawn, words)])] if bars else []
    return Section(
        "sensitivity", "If an assumption were another", [*blocks, Table("Variants", columns, changes)], "Sensitivity"
    )


def convergence_section(found: Sequence[dict[str, Any]]) -> Section:
    """Table of the ladders' limits."""
    form = _finest_form(found, "extrapolated", "lower", "upper")
    columns = [
        Column("scene", "scene"),
        Column("ladder", "ladder"),
        Column("mode", "mode", "d"),
        Column("levels", "levels", "d"),
        Column("sequence", "sequence"),
        Column("order", "order", ".2f", "observed"),
        Column("taken", "order", ".2f", "taken"),
        Column("extrapolated", "Richardson", form),
        Column("lower", "band from", form),
        Column("upper", "to", form),
        Column("unit", "unit"),
        Column("gci_percent", "half width", ".3f", "%"),
        Column("refused", "no band because", "wrap"),
    ]
    columns = [c for c in columns if c.key != "mode" or any(row["mode"] for row in found)]
    notes = [
        "Band: finest value ± grid convergence index (Roache, safety factor 1.25 on three levels), a statement about "
        "the discretisation error of one model, not about the distance between two.",
        "Order taken: the observed one, or the highest that theory allows in the limit. A solid is singular at the "
        "floor edges of a rectangular groove and converges there with order 1.09 however smooth its elements are "
        "(Williams 1952), so a higher observed order on a grooved solid is passing.",
    ]
    return Section(
        "convergence", "Where the ladders tend", [Table("Limits of the ladders", columns, found, notes)], "Limits"
    )


def _finest_form(lines: Sequence[dict[str, Any]], *keys: str) -> str:
    """Format of answers that has digits enough for the smallest of several questions."""
    return max((digits(line[key] for key in keys) for line in lines), key=lambda form: int(form[1:-1]), default=".5f")


def start(work: Callable[..., Section], *arguments: Any) -> Future[Section]:
    """Begin a section whose work another process does; its result is asked for later."""
    pool = ThreadPoolExecutor(1)
    begun = pool.submit(work, *arguments)
    pool.shutdown(wait=False)
    return begun


def picture_section(entries: Sequence[Entry], chosen: Sequence[str]) -> Section:
    """Mesh, groove section and deformed shape of the finest level of each solver for the chosen scenes."""
    wanted = [job for name in chosen for job in _jobs(entries, name)]
    if not wanted:
        return Section("pictures", "Pictures", [Text(["No result of this run carries a surface to draw."])])
    made, reason = figures.render(wanted)
    drawn = {picture.name for picture in made}
    missing = [job.caption for job in wanted if job.name not in drawn]
    return Section("pictures", "Pictures", [Gallery(made, missing, reason)])


def _jobs(entries: Sequence[Entry], name: str) -> list[figures.Job]:
    """The pictures of one scene, solvers side by side."""
    found = [
        f
        for f in ladders(entries, name)
        if f.solver in NAMES and f.role != "ancf exact" and f.finest and f.mode in (None, 1)
    ]
    drawn = [f.finest for f in found if f.finest.result.outline is not None]
    vibrate = any(entry.result.outline.modes is not None for entry in drawn)
    greatest = max((_reach(entry) for entry in drawn), default=0.0)
    views = ("mesh", "section") if vibrate else ("mesh", "section", "deformed")
    jobs = [_job(view, entry, greatest) for view in views for entry in drawn]
    jobs = [job for job in jobs if job is not None]
    shapes = range(min(PICTURED, drawn[0].scene.analysis.count)) if vibrate else ()
    return jobs + [_mode_job(entry, mode) for mode in shapes for entry in drawn]


def _mode_job(entry: Entry, mode: int) -> figures.Job:
    """Picture of a mode (from 0), its largest displacement a tenth of the plate; one corner is always seen raised."""
    outline = entry.result.outline
    shape, size = outline.modes[mode], np.linalg.norm(np.ptp(outline.points, axis=0))
    corner = shape[np.argmax(outline.points @ (1.0, 1.0, 1e-3))]
    shape = shape * np.sign(corner[np.abs(corner).argmax()] or 1.0)
    hertz = f"{entry.result.frequencies[mode]:.6g} Hz"
    words = f"{named(entry.solver)} {level_name(entry.level)}: mode {mode + 1}, {hertz}; size and sign mean nothing"
    bent = replace(outline, displacement=REACH * size * shape, modes=None)
    name = f"{entry.scene.name}-mode-{mode + 1}-{entry.solver}"
    return figures.Job(name, words, "mode", entry.solver, bent, greatest=REACH * size)


def _reach(entry: Entry) -> float:
    """Greatest displacement (m) of an entry's outline."""
    return float(np.linalg.norm(entry.result.outline.displacement, axis=1).max())


def _times(greatest: float, size: np.ndarray) -> float:
    """1, or the power of ten that brings a displacement too small to be seen to a tenth of the body's size or less."""
    part = greatest / float(np.linalg.norm(size))
    return 1.0 if part == 0 or part >= SEEN else 10.0 ** math.floor(math.log10(REACH / part))


def _job(view: str, entry: Entry, greatest: float) -> figures.Job | None:
    """One picture; None for a section where no groove runs along x on a rectangle."""
    scene, solver = entry.scene, entry.solver
    groove = scene.grooves[0] if scene.grooves else None
    below = groove is not None and groove.face == "bottom"
    side = "seen from below" if below else "seen from above"
    who = f"{named(solver)} {level_name(entry.level)} ({entry.result.unknowns} unknowns)"
    times = _times(greatest, np.ptp(entry.result.outline.points, axis=0))
    drawn = "" if times == 1 else f", drawn {times:g} times as large"
    words, extra = {
        "mesh": (f"undeformed mesh of {scene.name}, {side}", {"below": below}),
        "section": (f"groove “{groove.name}” where it meets edge x1, {side}" if groove else "", {"below": below}),
        "deformed": (
            f"last output time, coloured by the size of the displacement{drawn}",
            {"greatest": greatest, "times": times},
        ),
    }[view]
    if view == "section":
        if getattr(groove, "along", None) != "x" or not isinstance(scene.surface, Rectangle):
            return None
        low, high = groove.edges
        extra |= {
            "centre": (scene.surface.length, (low + high) / 2, 0.0),
            "radius": 0.7 * (high - low) + scene.thickness,
        }
    name = f"{scene.name}-{view}-{solver}"
    return figures.Job(name, f"{who}: {words}", view, solver, entry.result.outline, **extra)


def provenance_section(entries: Sequence[Entry], commands: Sequence[tuple[str, str]], about: dict[str, Any]) -> Section:
    """Versions, commit, machine, and how to get each number again."""
    versions = ", ".join(f"{name} {found}" for name, found in about["versions"].items() if found)
    fresh = sum(entry.fresh for entry in entries)
    pairs = [(key.replace("_", " "), value) for key, value in about.items() if key != "versions"]
    pairs += [
        ("versions", versions),
        ("results", f"{fresh} solved in this run, {len(entries) - fresh} kept from earlier ones"),
    ]
    return Section("provenance", "Provenance", [Facts(pairs), Commands(commands)])
