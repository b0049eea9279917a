"""The page of any scene: its table, plots, pictures and provenance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.report import Bullets, Page, Section, Text, write
from compare.scene import BUDGETS, Scene
from compare.study import AS_STATED, Entry, level_name
from compare.table import answer, error, farther, finest_reference, quantity, unit
from compare.verdict import Figure, stated
from reports import probes, sections, split, third
from reports.ladders import NAMES, Ladder, band_words, by_mode, ladders, page_content, scenes


def figures(entries: Sequence[Entry]) -> list[Figure]:
    """Finest answer of each ladder and the distance between the solvers; nothing is asked of them."""
    return [
        figure
        for scene in scenes(entries)
        for found in by_mode(ladders(entries, scene.name))
        for figure in _figures(scene, found)
    ]


def _figures(scene: Scene, found: Sequence[Ladder]) -> list[Figure]:
    """Figures of the ladders of one height or mode."""
    mode = found[0].mode
    about, what = scene.name + (f"_mode_{mode}" if mode else ""), quantity(scene, mode)
    made = []
    for ladder in found:
        entry = ladder.finest
        note = f"{level_name(entry.level)}. {band_words(ladder)}" if entry else "No level succeeded."
        name = f"{about}_{ladder.label.replace(' ', '_')}_{'frequency' if mode else scene.answer}"
        label = f"{scene.name}, {ladder.label}: {what} at its finest level"
        value = answer(entry) if entry else None
        made.append(stated(name, label, value, unit(scene), against="its own ladder", note=note, form=".6g"))
    plates = [ladder for ladder in found if ladder.solver == "ancf"]
    judge = finest_reference(found[0].entries[0], [entry for ladder in found for entry in ladder.solved])
    return [*made, *(_gap(about, ladder, judge, ladder is plates[0]) for ladder in plates)]


def _gap(about: str, ladder: Ladder, judge: Entry | None, is_first: bool) -> Figure:
    """How far the finest level of a ladder of ANCF is from the reference's; the first one has the short name."""
    known = ladder.finest is not None and judge is not None
    name = f"{about}_{'ancf' if is_first else ladder.label.replace(' ', '_')}_reference_percent"
    mode = f", mode {ladder.mode}" if ladder.mode else ""
    label = f"{ladder.scene.name}{mode}: {ladder.label} against the reference, finest levels of this run"
    note = ""
    if known:
        note = f"{level_name(ladder.finest.level)} against {level_name(judge.level)}; "
        note += f"positive: {farther(ladder.scene)}."
    gap = error(ladder.finest, judge and answer(judge))
    against = "cross-code: two independent solvers"
    return stated(name, label, gap, "%", against=against, note=note, form="+.3g")


def publish(scene: Scene, entries: Sequence[Entry], rows: Sequence[dict[str, Any]], folder: Path) -> Path:
    """Write <scene's name>.html and .json into `folder`; returns the page's path."""
    judged = figures(entries)
    found = {**page_content(entries, rows, judged), **split.content(entries), **third.content(entries)}
    found["probes"] = probes.rows(entries)
    about = found["provenance"]
    failed = sum(not entry.ok for entry in entries)
    words = f"{len(entries) - failed} of {len(entries)} runs succeeded."
    pictures = sections.start(sections.picture_section, entries, [scene.name])
    parts = [
        Section("verdict", "Verdict", [Text([words]), sections.information(judged)]),
        sections.scene_section(scenes(entries)),
        sections.convergence_section(found["convergence"]),
        sections.opinions_section(found["opinions"]),
        *sections.plot_sections(entries),
        split.section(found),
        third.section(found),
        sections.sensitivity_section(found["sensitivity"]),
        probes.section(found["probes"]),
        sections.table_section(entries, rows),
        pictures.result(),
        Section("limits", "What agreement does not prove", [Bullets(limits(entries))], "Not proven"),
        sections.provenance_section(entries, commands(scene, paid(entries)), about),
    ]
    lead = f"{scene.source}. " if scene.source else ""
    lead += "Two independent solvers on one stated question."
    page = Page(scene.title, lead, [part for part in parts if part], f"Groovecheck, {about['date']}")
    return write(folder, scene.name, page, found)


def commands(scene: Scene, budget: str) -> list[tuple[str, str]]:
    """What to type to see the numbers again, with the budget where it is not the default one."""
    spent = "" if budget == "standard" else f" --budget {budget}"
    return [
        (
            f"groovecheck run {scene.name}{spent}",
            "this page (give a scene of your own by its path)",
        ),
        (f"groovecheck table {scene.name}{spent} --format json", "every row with full digits"),
        (f"groovecheck explain {scene.name}{spent}", "what is modelled and what is left out"),
    ]


def paid(entries: Sequence[Entry]) -> str:
    """The least budget that pays for both solvers' entries: their levels, and variants where there are some."""
    levels = [entry.level.budget for entry in entries if entry.variant is None and entry.solver in NAMES]
    variants = [entry.scene.sensitivity.budget for entry in entries if entry.variant == AS_STATED]
    return max(levels + variants, key=BUDGETS.index)


def limits(entries: Sequence[Entry]) -> list[str]:
    """What the scenes of this page leave open, whatever their numbers are."""
    stated = scenes(entries)
    found = [AGREEMENT]
    if any(load.kind == "point" for scene in stated for load in scene.loads):
        found.append(POINT)
    locked = [
        e for e in entries if e.solver == "ancf" and e.level.element != "enriched" and e.scene.material.kind == "svk"
    ]
    ratios = {e.scene.material.poissons_ratio for e in locked}
    found += [locking(nu) for nu in sorted(ratios) if nu != 0]
    return [*found, "Anything the scene does not mention: it is not modelled."]


def locking(nu: float) -> str:
    """Why an element without enhanced strains does not reach a solid whose Poisson's ratio is `nu`.

    Its strain through the thickness is constant in z, while bending asks for a linear one; with the
    three-dimensional law that raises a plate's E / (1 - nu^2) to E (1 - nu) / ((1 + nu) (1 - 2 nu)), and where it is
    bent alike in both directions its E / (1 - nu) to E / ((1 + nu) (1 - 2 nu)).
    """
    cylinder, bowl = (1 - nu) ** 2 / (1 - 2 * nu), (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    return (
        f"That an ANCF plate of conforming or acm elements tends to the solid: at \u03bd = {nu:g} it does not. Its "
        "thickness stretches evenly, so it cannot follow Poisson's effect in bending (thickness locking) and is "
        f"{100 * (cylinder - 1):.3g} % too stiff in bending to a cylinder and {100 * (bowl - 1):.3g} % to a bowl, "
        "however fine the mesh. Part of the distance between the two solvers is this."
    )


AGREEMENT = (
    "That either solver is right: two codes that agree may share a misreading of the question. They share no "
    "numerics, only the statement of the scene and the format of the answer."
)
POINT = "That a value under a point load is converged: it sinks without bound as the mesh is refined."
