"""Sections that every exhibit shares: scene, tables, plots, pictures, provenance, from a study's entries."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare import figures, plots
from compare.convergence import Convergence, pairwise_orders, study
from compare.report import Bullets, Column, Commands, Facts, Gallery, Plots, Section, Table, Text
from compare.scene import Rectangle, Scene
from compare.sketch import sketch
from compare.study import AS_STATED, Entry, level_name
from compare.table import height, in_ladders, judgements, percent, rule, series
from compare.verdict import Figure

NAMES = {"ancf": "ANCF", "reference": "reference"}
COLUMNS = (
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
    Column("order", "order", ".2f", "observed"),
    Column("sequence", "sequence"),
    Column("extrapolated", "Richardson", ".5f", "m"),
    Column("gci_percent", "GCI band", ".3f", "± %"),
    Column("wall_seconds", "wall time", ".2f", "s"),
    Column("peak_mb", "peak memory", ",.0f", "MiB"),
    Column("newton_iterations", "Newton", ",d", "iterations"),
    Column("status", "status"),
)


@dataclass(frozen=True)
class Ladder:
    """One series of levels of one scene and solver, coarse to fine."""

    scene: Scene
    entries: tuple[Entry, ...]
    label: str
    role: str
    convergence: Convergence

    @property
    def solver(self) -> str:
        """ "ancf" or "reference"."""
        return self.entries[0].solver

    @property
    def solved(self) -> tuple[Entry, ...]:
        """Levels that succeeded."""
        return tuple(entry for entry in self.entries if entry.ok)

    @property
    def h(self) -> list[float]:
        """Element lengths (m)."""
        return [entry.result.h for entry in self.solved]

    @property
    def values(self) -> list[float]:
        """Heights (m) of the answer probe."""
        return [height(entry) for entry in self.solved]

    @property
    def finest(self) -> Entry | None:
        """Finest level that succeeded."""
        return self.solved[-1] if self.solved else None


def ladders(entries: Sequence[Entry], scene: str) -> list[Ladder]:
    """The series of a scene, in the order of its entries; the first ANCF series is the one drawn boldest."""
    groups: dict[Any, list[Entry]] = {}
    for entry in in_ladders(list(entries)):
        if entry.scene.name == scene:
            groups.setdefault(series(entry), []).append(entry)
    found, plain = [], 0
    for members in groups.values():
        ok = [entry for entry in members if entry.ok]
        members.sort(key=lambda entry: -_coarseness(entry))
        label, role = NAMES[members[0].solver], "reference"
        if members[0].solver == "ancf":
            label, role, plain = f"ANCF {rule(members[0].level)}", "ancf exact" if plain else "ancf", plain + 1
        seen = study([e.result.h for e in ok], [height(e) for e in ok])
        found.append(Ladder(members[0].scene, tuple(members), label, role, seen))
    return found


def _coarseness(entry: Entry) -> float:
    mesh = getattr(entry.level, "mesh", None)
    return entry.level.size if mesh is None else 1 / max(mesh)


def scenes(entries: Iterable[Entry]) -> list[Scene]:
    """The scenes of a study as stated, each once, in the order of the entries."""
    found = {entry.scene.name: entry.scene for entry in in_ladders(list(entries))}
    return list(found.values())


def scene_section(stated: Sequence[Scene]) -> Section:
    """Sketch, source and assumptions of the scenes."""
    drawn = [
        (sketch(scene), f"{scene.title}. Shaded: grooves, dashed edge on the bottom face.") for scene in stated[:2]
    ]
    said = list(dict.fromkeys(words for scene in stated for words in scene.assumed))
    blocks = [Plots(drawn), Text(["Read or assumed where the source is silent:"] if said else [])]
    return Section("scene", "The question", [*blocks, Bullets(said), Facts(_facts(stated[0]))], "Question")


def _facts(scene: Scene) -> list[tuple[str, Any]]:
    """What the scene states, in words."""
    material, analysis = scene.material, scene.analysis
    density = f", density {material.density:g} kg/m³" if material.density else ""
    forces = [f"{load.kind} {getattr(load, 'force', None) or load.acceleration}" for load in scene.loads]
    clamps = [f"{c.edge}: {'all nodal gradients' if c.gradients == 'all' else 'face only'}" for c in scene.supports]
    return [
        ("source", scene.source or "none given"),
        ("material", f"St. Venant-Kirchhoff, E {material.youngs_modulus:g} Pa, ν {material.poissons_ratio:g}{density}"),
        ("thickness", f"{scene.thickness:g} m"),
        ("loads (N, m/s²)", "; ".join(forces) or "none"),
        ("clamped edges", "; ".join(clamps) or "none"),
        ("analysis", f"{analysis.kind}, until {analysis.until:g}{' s' if analysis.kind == 'dynamic' else ''}"),
        ("answer", f"height z of {scene.probes[0].name} at the last output time"),
    ]


def table_section(entries: Sequence[Entry], rows: Sequence[dict[str, Any]]) -> Section:
    """One full table per scene, with what its numbers are judged against below it."""
    blocks = []
    kept, judged = in_ladders(list(entries)), judgements(list(entries))
    for scene in scenes(entries):
        chosen = [i for i, entry in enumerate(kept) if entry.scene.name == scene.name]
        groove, load = rows[chosen[0]]["groove"], rows[chosen[0]]["load"]
        caption = f"{scene.title} (groove: {groove}; load: {load})"
        columns = [c for c in COLUMNS if any(rows[i].get(c.key) is not None for i in chosen)]
        notes = _judged(scene, [judged[i] for i in chosen]) + _failed([kept[i] for i in chosen])
        blocks.append(Table(caption, columns, [rows[i] for i in chosen], notes))
    return Section("tables", "All rows", blocks)


def _judged(scene: Scene, judged: Sequence[dict[str, Any]]) -> list[str]:
    """What the columns of a scene's table are judged against."""
    notes = []
    if scene.published:
        notes.append(f"paper, vs paper: published, {scene.published.source}, the row of the same mesh.")
    reference = next((found["reference"] for found in judged if found["reference"]), None)
    if reference:
        value = f"{reference['value']:.5f} m".replace("-", "\u2212")
        notes.append(f"vs reference: {reference['kind']}, {reference['source']} ({reference['cell']}, {value}).")
    reasons = dict.fromkeys(found["band_refused"] for found in judged if found["band_refused"])
    if reasons:
        notes.append("No order or band where the sequence does not allow one: " + "; ".join(reasons) + ".")
    return notes


def _failed(entries: Sequence[Entry]) -> list[str]:
    return [f"{NAMES[e.solver]} {level_name(e.level)}: {e.status}. {e.message}" for e in entries if not e.ok]


def plot_sections(entries: Sequence[Entry]) -> list[Section]:
    """Value against h, error against h, error against time and histories, one plot per scene in each."""
    values, errors, work, paths = [], [], [], []
    for scene in scenes(entries):
        found = ladders(entries, scene.name)
        if not any(ladder.solved for ladder in found):
            continue
        values.append(_value_plot(scene, found))
        target = error_target(found)
        if target:
            errors.append(_error_plot(scene, found, *target))
            work.append(_work_plot(scene, found, *target))
        paths.append(_history_plot(scene, found))
    return [
        Section("values", "Value against element size", [Plots(values)], "Value against h"),
        Section("errors", "Error against element size", [Plots(errors)], "Error against h"),
        Section("work", "Error against time", [Plots(work)]),
        Section("history", "The path of the answer", [Plots([path for path in paths if path])], "Path"),
    ]


def error_target(found: Sequence[Ladder]) -> tuple[float, str] | None:
    """The value (m) that plotted errors are measured from, and what it is: the best that the study has."""
    best = sorted(found, key=lambda ladder: ladder.solver != "reference")
    for ladder in best:
        if ladder.convergence.extrapolated is not None:
            return ladder.convergence.extrapolated, f"the Richardson value of the {ladder.label} ladder"
    for ladder in best:
        if ladder.finest:
            return height(ladder.finest), f"the finest {ladder.label} level"
    return None


def _value_plot(scene: Scene, found: Sequence[Ladder]) -> tuple[str, str]:
    lines = [plots.Series(f.label, f.role, f.h, f.values) for f in found if f.solved]
    limits = []
    for ladder in found:
        seen = ladder.convergence
        if seen.extrapolated is not None:
            band = seen.band
            limits.append(
                plots.Limit(f"{ladder.label}, Richardson", ladder.role, seen.extrapolated, band.lower, band.upper)
            )
    if scene.published:
        sizes = {getattr(e.level, "mesh", None): e.result.h for f in found for e in f.solved}
        known = [(sizes[row.mesh], row.value) for row in scene.published.rows if row.mesh in sizes]
        lines.append(plots.Series("paper", "paper", [h for h, _ in known], [v for _, v in known]))
        if scene.published.converged:
            limits.append(plots.Limit("paper, converged", "paper", scene.published.converged.value))
    refused = [f"{f.label}: {f.convergence.refused}" for f in found if f.convergence.refused]
    caption = f"{scene.title}. Shaded: GCI band around the finest value of a ladder."
    caption += f" No band for {'; '.join(refused)}." if refused else ""
    about = f"Height of {scene.probes[0].name} over element size for {', '.join(line.label for line in lines)}."
    return plots.value_plot(f"values-{scene.name}", scene.title, about, lines, limits), caption


def _errors(ladder: Ladder, target: float) -> list[float]:
    return [abs(percent(value, target)) for value in ladder.values]


def _error_plot(scene: Scene, found: Sequence[Ladder], target: float, what: str) -> tuple[str, str]:
    lines = []
    for ladder in found:
        if ladder.solved:
            errors = _errors(ladder, target)
            shown = [(h, e) for h, e in zip(ladder.h, errors, strict=True) if e > 0]
            slopes = pairwise_orders([h for h, _ in shown], [e for _, e in shown]) if len(shown) > 1 else []
            label = f"{ladder.label}, slope {slopes[-1]:.2f}" if slopes else ladder.label
            lines.append(plots.Series(label, ladder.role, [h for h, _ in shown], [e for _, e in shown]))
    caption = f"{scene.title}. Difference from {what}; slope: observed between the two finest levels shown."
    drawn = plots.log_plot(
        f"errors-{scene.name}", f"Error: {scene.title}", caption, lines, "element size h (m)", "|difference| (%)"
    )
    return drawn, caption


def _work_plot(scene: Scene, found: Sequence[Ladder], target: float, what: str) -> tuple[str, str]:
    lines = [
        plots.Series(f.label, f.role, [e.wall_seconds for e in f.solved], _errors(f, target)) for f in found if f.solved
    ]
    caption = f"{scene.title}. Difference from {what} against wall time, one thread, least of the runs."
    drawn = plots.log_plot(
        f"work-{scene.name}", f"Work: {scene.title}", caption, lines, "wall time (s)", "|difference| (%)"
    )
    return drawn, caption


def _history_plot(scene: Scene, found: Sequence[Ladder]) -> tuple[str, str] | None:
    """The finest level of each solver over time, and their difference where both have the same output times."""
    finest = {}
    for ladder in found:
        if ladder.finest and (ladder.role != "ancf exact"):
            finest[ladder.solver] = ladder.finest
    probe = scene.probes[0].name
    paths = [
        plots.Series(f"{NAMES[s]} {level_name(e.level)}", s, e.result.times, e.result.position(probe)[:, 2])
        for s, e in finest.items()
    ]
    if not paths or len(paths[0].x) < 3:
        return None
    residual = None
    if len(paths) == 2 and np.array_equal(paths[0].x, paths[1].x):
        residual = plots.Series(
            f"{paths[0].label} minus {paths[1].label}", "difference", paths[0].x, 1e3 * (paths[0].y - paths[1].y)
        )
    unit = "Time in s" if scene.analysis.kind == "dynamic" else "Load parameter from 0 to its end"
    caption = f"{scene.title}. {unit}; each solver at its finest level of this run."
    return plots.history_plot(f"history-{scene.name}", f"Path: {scene.title}", caption, paths, residual), caption


def band_words(ladder: Ladder) -> str:
    """The ladder's own band in words, or why there is none."""
    seen = ladder.convergence
    if seen.band is None:
        return f"No band: {seen.refused}."
    limits = f"{seen.band.lower:.5f} to {seen.band.upper:.5f} m".replace("-", "\u2212")
    return f"Band {limits} around the finest value, order {seen.order:.2f}, {seen.sequence}."


def information(figures: Sequence[Figure]) -> Table:
    """Figures of which nothing is asked."""
    columns = [
        Column("label", "figure", "wrap"),
        Column("value", "value", ".5g"),
        Column("unit", "unit"),
        Column("against", "beside", "wrap"),
        Column("note", "note", "wrap"),
    ]
    rows = [{**vars(figure), "unit": figure.unit or "1"} for figure in figures]
    return Table("Stated for information; nothing is asked of these", columns, rows)


def sensitivity_section(changes: Sequence[dict[str, Any]]) -> Section | None:
    """How the answer moves when an assumption is changed."""
    if not changes:
        return None
    columns = [
        Column("variant", "variant"),
        Column("solver", "solver"),
        Column("mesh", "mesh"),
        Column("rule", "rule"),
        Column("value", "value", ".5f", "m"),
        Column("change_percent", "change", "+.3f", "%"),
        Column("paper", "paper", ".4f", "m"),
        Column("error_paper_percent", "vs paper", "+.3f", "%"),
        Column("status", "status"),
    ]
    moved = [row for row in changes if row["change_percent"] is not None and row["variant"] != AS_STATED]
    many = len({row["solver"] for row in moved}) > 1
    bars = [
        plots.Bar(row["variant"] + (f" ({NAMES[row['solver']]})" if many else ""), row["solver"], row["change_percent"])
        for row in moved
    ]
    words = "Change of the height when one assumption is another, in percent of the height as stated."
    drawn = plots.bar_plot("sensitivity", "Sensitivity", words, bars, "change of the height (%)")
    blocks = [Plots([(drawn, words)])] if bars else []
    return Section(
        "sensitivity", "If an assumption were another", [*blocks, Table("Variants", columns, changes)], "Sensitivity"
    )


def convergence(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """What each ladder says about its limit: sequence type, order, Richardson value and band (m), or the refusal."""
    return [
        {
            "scene": ladder.scene.name,
            "ladder": ladder.label,
            "levels": len(ladder.solved),
            "sequence": ladder.convergence.sequence,
            "order": ladder.convergence.order,
            "extrapolated": ladder.convergence.extrapolated,
            "lower": ladder.convergence.band and ladder.convergence.band.lower,
            "upper": ladder.convergence.band and ladder.convergence.band.upper,
            "gci_percent": ladder.convergence.gci_percent,
            "refused": ladder.convergence.refused,
        }
        for scene in scenes(entries)
        for ladder in ladders(entries, scene.name)
    ]


def convergence_section(found: Sequence[dict[str, Any]]) -> Section:
    """Table of the ladders' limits."""
    columns = (
        Column("scene", "scene"),
        Column("ladder", "ladder"),
        Column("levels", "levels", "d"),
        Column("sequence", "sequence"),
        Column("order", "order", ".2f", "observed"),
        Column("extrapolated", "Richardson", ".5f", "m"),
        Column("lower", "band from", ".5f", "m"),
        Column("upper", "to", ".5f", "m"),
        Column("gci_percent", "half width", ".3f", "%"),
        Column("refused", "no band because", "wrap"),
    )
    notes = [
        "Band: finest value ± grid convergence index (Roache, safety factor 1.25 on three levels), a statement about "
        "the discretisation error of one model, not about the distance between two."
    ]
    return Section(
        "convergence", "Where the ladders tend", [Table("Limits of the ladders", columns, found, notes)], "Limits"
    )


def picture_section(entries: Sequence[Entry], chosen: Sequence[str]) -> Section:
    """Mesh, groove section and deformed shape of the finest level of each solver for the chosen scenes."""
    wanted = [job for name in chosen for job in _jobs(entries, name)]
    reason = figures.rendering_problem() if wanted else None
    if reason:
        return Section("pictures", "Pictures", [Gallery((), [caption for caption, _ in wanted], reason)])
    made, missing, why = [], [], ""
    for caption, job in wanted:
        try:
            made.append(job())
        except Exception as error:
            missing.append(caption)
            why = f"{type(error).__name__}: {error}"
    blocks = [Gallery(made, missing, why)] if wanted else [Text(["No result of this run carries a surface to draw."])]
    return Section("pictures", "Pictures", blocks)


def _jobs(entries: Sequence[Entry], name: str) -> list[tuple[str, Any]]:
    """(caption, function that makes the picture) for one scene."""
    found = [f.finest for f in ladders(entries, name) if f.role != "ancf exact" and f.finest]
    drawn = [entry for entry in found if entry.result.outline is not None]
    if not drawn:
        return []
    greatest = max(float(np.linalg.norm(e.result.outline.displacement, axis=1).max()) for e in drawn)
    jobs = []
    for entry in drawn:
        scene, outline, solver = entry.scene, entry.result.outline, entry.solver
        who = f"{NAMES[solver]} {level_name(entry.level)}, {entry.result.unknowns:,} unknowns".replace(",", "\u202f", 1)
        face = scene.grooves[0].face if scene.grooves else "top"
        side = "seen from below" if face == "bottom" else "seen from above"
        mesh = f"{who}: mesh of {scene.name}, {side}"
        jobs.append((mesh, lambda a=(f"mesh-{solver}", mesh, solver, outline, face): figures.mesh_picture(*a)))
        if scene.grooves and isinstance(scene.surface, Rectangle) and scene.grooves[0].along == "x":
            band = scene.grooves[0]
            centre = np.array([scene.surface.length, sum(band.edges) / 2, 0.0])
            radius = 0.75 * (band.edges[1] - band.edges[0]) + scene.thickness
            near = f"{who}: groove {band.name} at the edge x1, {side}"
            jobs.append(
                (
                    near,
                    lambda a=(f"section-{solver}", near, solver, outline, centre, radius, face): (
                        figures.section_picture(*a)
                    ),
                )
            )
        bent = f"{who}: {scene.name} at the last output time, coloured by the size of the displacement"
        jobs.append((bent, lambda a=(f"deformed-{solver}", bent, outline, greatest): figures.deformed_picture(*a)))
    return jobs


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
