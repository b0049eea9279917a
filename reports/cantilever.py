"""The cantilever exhibit: Table 5 of He, Patel and Shabana, both solvers and their patch-loaded twins, on one page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.exact import Value, cross_code
from compare.report import Bullets, Column, Page, Section, Table, Text, Verdict, write
from compare.scene import PublishedRow, Scene
from compare.study import Entry, Unit, level_name
from compare.table import height, in_ladders, percent, rule
from compare.verdict import Figure, at_most, stated
from reports import calculix_solver, sections, split, third
from reports import scene as alone
from reports.ladders import (
    NAMES,
    Ladder,
    band_words,
    ladders,
    page_content,
    scenes,
)

PLAIN, GROOVED = "cantilever_plain", "cantilever"
TWINS = {"cantilever_plain_patch": "plain", "cantilever_patch": "grooved"}
POINT = "neither of them converged under a point load"
PATCH = "one physical question, both held and loaded alike"


@dataclass(frozen=True)
class Printed:
    """A printed row, the ANCF entry that is compared with it and the entry with the other rule; None: not run."""

    row: PublishedRow
    entry: Entry | None
    other: Entry | None
    assigned: bool

    @property
    def difference(self) -> float | None:
        """ANCF minus printed (m)."""
        value = None if self.entry is None else height(self.entry)
        return None if value is None else value - self.row.value


@dataclass(frozen=True)
class Found:
    """The ladders of each scene."""

    ladders: dict[str, list[Ladder]]

    def reference(self, scene: str) -> Ladder | None:
        """The reference's ladder of a scene, None where it was not run."""
        return next((ladder for ladder in self.ladders[scene] if ladder.role == "reference"), None)

    def ancf(self, scene: str) -> Ladder | None:
        """The first ANCF ladder of a scene, None where it was not run."""
        return next((ladder for ladder in self.ladders[scene] if ladder.role == "ancf"), None)


def printed_rows(entries: Sequence[Entry], scene: str) -> list[Printed]:
    """The printed rows of a scene, each with the entry of the rule that it names, or the nearer of those run."""
    found = [e for e in in_ladders(list(entries)) if e.scene.name == scene and e.solver == "ancf"]
    if not found or found[0].scene.published is None:
        return []
    return [_printed(row, [e for e in found if e.level.mesh == row.mesh]) for row in found[0].scene.published.rows]


def _printed(row: PublishedRow, candidates: Sequence[Entry]) -> Printed:
    if row.points is not None:
        named = [e for e in candidates if e.level.points == row.points]
    else:
        solved = [e for e in candidates if e.ok] or list(candidates)
        named = sorted(solved, key=lambda e: abs(height(e) - row.value) if e.ok else 0.0)
    entry = named[0] if named else None
    other = next((e for e in candidates if entry is not None and e.level.points != entry.level.points), None)
    return Printed(row, entry, other, row.points is not None)


def figures(entries: Sequence[Entry], rows: Sequence[dict[str, Any]]) -> list[Figure]:
    """Every number that the exhibit is judged by; value and met are None where the budget did not run it."""
    found = Found({scene: ladders(entries, scene) for scene in (PLAIN, GROOVED, *TWINS)})
    return [
        _plain_table(entries),
        *_plain_reference(found),
        _grooved_table(entries),
        _grooved_reference(found),
        *_softening(found),
        *[_cross(found, scene, name, POINT) for scene, name in ((PLAIN, "plain"), (GROOVED, "grooved"))],
        *[_cross(found, scene, f"patch_{name}", PATCH) for scene, name in TWINS.items()],
        *[figure for scene, name in TWINS.items() for figure in _twin(found, scene, name)],
    ]


def _worst(found: Sequence[Printed], sizes: Sequence[float | None]) -> tuple[float | None, str, bool]:
    """Largest size, the names of the rows behind it, and whether a row that was run failed."""
    known = [size for size in sizes if size is not None]
    run = [p.row.cell for p in found if p.difference is not None]
    left = [p.row.cell for p in found if p.entry is None]
    failed = [f"{p.row.cell} ({p.entry.status})" for p in found if p.entry is not None and not p.entry.ok]
    words = f"Rows {', '.join(run)}." if run else "No row was run."
    words += f" Not in this budget: {', '.join(left)}." if left else ""
    words += f" Failed: {', '.join(failed)}." if failed else ""
    return (None if failed or not known else max(known)), words, bool(failed)


def _plain_table(entries: Sequence[Entry]) -> Figure:
    found = printed_rows(entries, PLAIN)
    sizes = [None if p.difference is None else abs(p.difference) for p in found]
    worst, words, failed = _worst(found, sizes)
    free = [p.row.cell for p in found if p.entry is not None and not p.assigned]
    words += f" For {', '.join(free)} no rule is known: the nearer of the two was taken." if free else ""
    label = "Table 5 without grooves: largest |ANCF − printed|"
    against = "published: Table 5, without local geometry; each row at the quadrature rule it was found to use"
    made = at_most("table5_plain_max_difference", label, worst, "m", 2e-4, against=against, note=words, form=".2e")
    return _failing(made) if failed else made


def _failing(figure: Figure) -> Figure:
    return Figure(**{**vars(figure), "met": False})


def _grooved_table(entries: Sequence[Entry]) -> Figure:
    found = printed_rows(entries, GROOVED)
    sizes = [None if p.difference is None else abs(percent(height(p.entry), p.row.value)) for p in found]
    worst, words, failed = _worst(found, sizes)
    label = "Table 5 with grooves: largest |ANCF − printed|"
    against = "published: Table 5, with local geometry; the groove's shape is inferred from this very column"
    made = at_most("table5_grooved_max_percent", label, worst, "%", 1.0, against=against, note=words)
    return _failing(made) if failed else made


def _plain_reference(found: Found) -> list[Figure]:
    """The reference without grooves against the printed value, its own band, and CalculiX."""
    ladder = found.reference(PLAIN)
    error, own, met, note = None, None, *_unjudged(ladder)
    if not note:
        printed = ladder.scene.published.converged.value
        error, own = abs(percent(height(ladder.finest), printed)), ladder.convergence.gci_percent
        met, note = error <= 0.4, f"{level_name(ladder.finest.level)}. {band_words(ladder)}"
    label = "Reference without grooves: |finest − printed converged value|"
    against = "published: Table 5, classical FE converged mesh, without local geometry (−0.5022 m)"
    band = "Reference without grooves: half width of its own band"
    return [
        Figure("reference_plain_error_percent", label, error, "%", 0.4, met, against, note),
        stated("reference_plain_band_percent", band, own, "%", against="its own ladder", note=note),
        _peer(_calculix(ladder) if ladder else None),
    ]


def _unjudged(ladder: Ladder | None) -> tuple[bool | None, str]:
    """(met, why) of a reference ladder that failed or is too short for a band; why is "" where it can be judged."""
    if ladder is None:
        return None, "Not run."
    failed = [f"{level_name(entry.level)} ({entry.status})" for entry in ladder.entries if not entry.ok]
    if failed:
        return False, f"Failed: {', '.join(failed)}."
    if len(ladder.entries) < 3:
        last = f"{height(ladder.finest):.5f} m".replace("-", "\u2212")
        return None, f"Judged from three levels on; this budget ran {len(ladder.entries)}, the finest at {last}."
    return None, ""


def _peer(close: tuple[Entry, Value] | None) -> Figure:
    """A reference level against CalculiX at a comparable mesh."""
    gap, note = None, ""
    if close is not None:
        entry, value = close
        gap = abs(percent(height(entry), value.value))
        note = f"{level_name(entry.level)} against {value.cell} ({value.value:.5f} m).".replace("-0.", "\u22120.")
    label = "Reference without grooves: |difference from CalculiX|"
    against = "cross-code: CalculiX 2.20, quadratic tetrahedra C3D10 of the nearest size (within a factor of 1.3)"
    return at_most("reference_plain_calculix_percent", label, gap, "%", 0.3, against=against, note=note)


def _calculix(ladder: Ladder) -> tuple[Entry, Value] | None:
    """The reference level and CalculiX's C3D10 value of the nearest mesh size, if within a factor of 1.3."""
    peers = [
        (float(v.cell.partition("h=")[2].split(",")[0]), v) for v in cross_code(ladder.scene) if "C3D10 h=" in v.cell
    ]
    pairs = [(max(e.level.size / s, s / e.level.size), e.level.size, e, v) for e in ladder.solved for s, v in peers]
    ratio, _, entry, value = min(pairs, key=lambda pair: pair[:2], default=(np.inf, 0.0, None, None))
    return (entry, value) if ratio < 1.3 else None


def _grooved_reference(found: Found) -> Figure:
    """Richardson value of the reference against the printed converged one; met only where its band holds the latter."""
    ladder = found.reference(GROOVED)
    label = "Reference with grooves: |Richardson value − printed converged value|"
    against = "published: Table 5, classical FE converged mesh, with local geometry (−0.5669 m)"
    asked = "the reference's own band contains the printed value, or the page explains the distance"
    name = "reference_grooved_error_percent"
    met, note = _unjudged(ladder)
    if note:
        return Figure(name, label, None, "%", None, met, against, note, asked=asked)
    seen, printed = ladder.convergence, ladder.finest.scene.published.converged.value
    inside = seen.band is not None and seen.band.contains(printed)
    value = seen.extrapolated if seen.extrapolated is not None else height(ladder.finest)
    note = f"{level_name(ladder.finest.level)}, not extrapolated. " if seen.extrapolated is None else ""
    note += band_words(ladder) + ("" if inside else " Not inside: see the modelling differences below for why.")
    return Figure(name, label, abs(percent(value, printed)), "%", None, inside, against, note, asked=asked)


def _softening(found: Found) -> list[Figure]:
    """Height with grooves over height without, at the finest level that both scenes ran."""
    made = []
    for solver, pick, words in (("ancf", found.ancf, "ANCF"), ("reference", found.reference, "Reference")):
        plain, grooved = pick(PLAIN), pick(GROOVED)
        pairs = [
            (g, p)
            for g in (grooved.solved if grooved else ())
            for p in (plain.solved if plain else ())
            if _same_level(g, p)
        ]
        value = height(pairs[-1][0]) / height(pairs[-1][1]) if pairs else None
        note = f"At {level_name(pairs[-1][0].level)}{_rule(pairs[-1][0])}, in both scenes." if pairs else ""
        against = "published: 1.106 at 16x16 (ANCF) and 1.129 (classical FE), ratios of Table 5"
        label = f"{words}: height with grooves over height without"
        made.append(stated(f"softening_ratio_{solver}", label, value, "", against=against, note=note, form=".4f"))
    return made


def _rule(entry: Entry) -> str:
    return f" ({rule(entry.level)})" if rule(entry.level) else ""


def _same_level(one: Entry, other: Entry) -> bool:
    return one.level.model_dump(exclude={"budget"}) == other.level.model_dump(exclude={"budget"})


def _cross(found: Found, scene: str, name: str, loaded: str) -> Figure:
    """ANCF minus reference at the finest levels, and at the finest levels of about the same element size."""
    ancf, reference = found.ancf(scene), found.reference(scene)
    value, note = None, ""
    if ancf and reference and ancf.finest and reference.finest:
        value, note = _apart(ancf.finest, reference.finest)
        near = [(a, r) for a in ancf.solved for r in reference.solved if _alike(a.result.h, r.result.h)]
        if near and near[-1] != (ancf.finest, reference.finest):
            gap, words = _apart(*near[-1])
            note += f" At about the same element size, {words[:-1]}: {gap:+.3g} %.".replace(" -", " \u2212")
    label = f"ANCF against the reference, {name.replace('_', ', ')}, each at its finest level of this run"
    against = f"cross-code: two independent solvers, {loaded}"
    return stated(f"ancf_reference_{name}_percent", label, value, "%", against=against, note=note, form="+.3g")


def _apart(ancf: Entry, reference: Entry) -> tuple[float, str]:
    """Difference (percent of the reference's height) of two levels, and which they are."""
    words = f"{level_name(ancf.level)}{_rule(ancf)} against {level_name(reference.level)}."
    return percent(height(ancf), height(reference)), words


def _alike(one: float, other: float) -> bool:
    """Whether two element sizes lie within a factor of 1.3."""
    return max(one / other, other / one) < 1.3


def _twin(found: Found, scene: str, name: str) -> list[Figure]:
    """Orders and bands of both solvers on a patch-loaded scene, and the gap between the bands."""
    both = {"ancf": found.ancf(scene), "reference": found.reference(scene)}
    made = []
    for solver, ladder in both.items():
        seen = ladder.convergence if ladder else None
        words = f"Patch load, {name}, {NAMES[solver]}: "
        note = band_words(ladder) if ladder else "Not run."
        key, own = f"patch_{name}_{solver}", "its own ladder; no published value"
        made.append(stated(f"{key}_order", words + "observed order", seen and seen.order, "", against=own, note=note))
        made.append(
            stated(
                f"{key}_gci_percent", words + "half width of the GCI band", seen and seen.gci_percent, "%", against=own
            )
        )
    bands = [ladder.convergence.band if ladder else None for ladder in both.values()]
    gap = None
    if all(bands):
        middle = abs(bands[1].lower + bands[1].upper) / 2
        gap = 100 * max(0.0, bands[0].lower - bands[1].upper, bands[1].lower - bands[0].upper) / middle
    label = f"Patch load, {name}: gap between the bands of the two solvers"
    refused = [
        f"{NAMES[s]}: {band_words(f) if f else 'not run.'}" for s, f in both.items() if not f or not f.convergence.band
    ]
    note = " ".join(refused) or "0 where they overlap; a gap is a difference between the two models (see below)."
    against = "cross-code: GCI bands of two independent solvers"
    made.append(at_most(f"patch_{name}_band_gap_percent", label, gap, "%", 0.0, against=against, note=note))
    return made


WITHOUT, WITH = "without grooves", "with grooves (inferred)"
TABLE5 = (
    Column("mesh", "mesh"),
    Column("paper_plain", "paper", ".4f", "m", group=WITHOUT),
    Column("ancf_plain", "ANCF", ".5f", "m", group=WITHOUT),
    Column("difference_plain", "difference", "+.5f", "m", group=WITHOUT),
    Column("rule_plain", "rule", group=WITHOUT, about="Gauss points that the printed row was found to use"),
    Column("other_plain", "ANCF", ".5f", "m", group=WITHOUT),
    Column("other_rule_plain", "other rule", group=WITHOUT),
    Column("paper_grooved", "paper", ".4f", "m", group=WITH),
    Column("ancf_grooved", "ANCF", ".5f", "m", group=WITH),
    Column("difference_grooved", "difference", "+.5f", "m", group=WITH),
    Column("percent_grooved", "difference", "+.3f", "%", group=WITH),
)


def table5(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Table 5 as printed beside the ANCF column, without and with grooves; one dict per mesh."""
    joined: dict[str, dict[str, Any]] = {}
    for scene, name in ((PLAIN, "plain"), (GROOVED, "grooved")):
        for p in printed_rows(entries, scene):
            line = joined.setdefault(p.row.cell, {"mesh": p.row.cell})
            value = height(p.entry) if p.entry else None
            other = height(p.other) if p.other else None
            exact = "" if p.assigned or not p.entry else " (nearer)" if p.other else ""
            line |= {
                f"paper_{name}": p.row.value,
                f"ancf_{name}": value,
                f"difference_{name}": p.difference,
                f"percent_{name}": percent(value, p.row.value),
                f"rule_{name}": (rule(p.entry.level) + exact) if p.entry else None,
                f"other_{name}": other,
                f"other_rule_{name}": rule(p.other.level) if p.other else None,
            }
    return list(joined.values())


def publish(scene: Scene, entries: Sequence[Entry], rows: Sequence[dict[str, Any]], folder: Path) -> Path:
    """Write the scene's page and json into `folder`; returns the page's path.

    A scene that was run without the printed table's own scenes has a page of its own, not an empty exhibit.
    """
    if not {PLAIN, GROOVED} & {entry.scene.name for entry in entries}:
        return alone.publish(scene, entries, rows, folder)
    judged = figures(entries, rows)
    found = {
        **page_content(entries, rows, judged),
        **split.content(entries),
        **third.content(entries),
        "table5": table5(entries),
    }
    return write(folder, scene.name, page(entries, rows, found, judged), found)


def third_solvers(scenes: Sequence[Scene], budget: str) -> list[Unit]:
    """Units of CalculiX on the patch-loaded twins, where it is installed."""
    return calculix_solver.units(scenes, budget)


def page(
    entries: Sequence[Entry], rows: Sequence[dict[str, Any]], content: dict[str, Any], judged: Sequence[Figure]
) -> Page:
    """The exhibit's page; `content` is what its JSON holds."""
    asked = [figure for figure in judged if figure.judged]
    verdict = [
        Text([_summary(asked, entries)]),
        Verdict(asked),
        sections.information([figure for figure in judged if not figure.judged]),
    ]
    differences = [*DIFFERENCES, *_explanation(content)]
    pictures = sections.start(sections.picture_section, entries, [GROOVED])
    parts = [
        Section("verdict", "Verdict", verdict),
        sections.scene_section(scenes(entries)),
        Section("table5", "Table 5, printed and computed", [_table5(content["table5"])], "Table 5"),
        sections.convergence_section(content["convergence"]),
        sections.opinions_section(content["opinions"]),
        *sections.plot_sections(entries),
        split.section(content),
        third.section(content),
        sections.sensitivity_section(content["sensitivity"]),
        sections.table_section(entries, rows),
        pictures.result(),
        Section("differences", "Modelling differences that remain", [Bullets(differences)], "Differences"),
        Section("limits", "What a pass does not prove", [Bullets(LIMITS)], "Not proven"),
        sections.provenance_section(entries, COMMANDS, content["provenance"]),
    ]
    return Page(TITLE, LEAD, [part for part in parts if part], f"Groovecheck, {content['provenance']['date']}")


def _explanation(content: dict[str, Any]) -> list[str]:
    """How far the reference with grooves is from the printed converged value, beside what could account for it."""
    ladder = next((f for f in content["convergence"] if f["scene"] == GROOVED and f["ladder"] == "reference"), None)
    printed = next((f for f in content["opinions"] if f["scene"] == GROOVED and f["kind"] == "published"), None)
    if ladder is None or ladder["extrapolated"] is None or printed is None:
        return []
    gap = percent(ladder["extrapolated"], printed["value"])
    words = [
        f"The reference with grooves tends to {ladder['extrapolated']:.5f} m, {gap:+.2f} % from the printed value."
    ]
    peers = [f["value"] for f in content["opinions"] if f["scene"] == GROOVED and f["kind"] == "cross-code"]
    if peers:
        low, high = percent(max(peers), printed["value"]), percent(min(peers), printed["value"])
        words.append(f"CalculiX with the same inferred grooves lies {low:+.2f} to {high:+.2f} % from it.")
    moved = [row["change_percent"] for row in content["sensitivity"] if row["change_percent"] is not None]
    if moved:
        words.append(
            f"The other grooves of the sensitivity table move the ANCF height by {min(moved):+.2f} to "
            f"{max(moved):+.2f} %."
        )
    return [" ".join(words).replace("-", "\u2212")]


def _summary(asked: Sequence[Figure], entries: Sequence[Entry]) -> str:
    """The verdict in two or three sentences."""
    met = [figure for figure in asked if figure.met]
    missed = [figure.label for figure in asked if figure.met is False]
    open_ = len(asked) - len(met) - len(missed)
    words = f"{len(met)} of {len(met) + len(missed)} judged figures met."
    words += f" Missed: {'; '.join(missed)}." if missed else ""
    words += f" {open_} not judged; its card says why." if open_ else ""
    return f"{words} {sum(entry.ok for entry in entries)} of {len(entries)} runs succeeded."


TITLE = "The grooved cantilever: an ANCF plate against solid finite elements and a printed table"
LEAD = (
    "A square plate clamped along one edge, pulled down at a free corner. He, Patel and Shabana print how far it "
    "bends, with and without grooves. Two independent solvers compute it again."
)


def _table5(rows: Sequence[dict[str, Any]]) -> Table:
    notes = [
        "The printed rows without grooves do not share one quadrature rule: each is compared at the Gauss points that "
        "reproduce it to four digits (found by running both); 7x7x3 integrates this element exactly.",
        "The groove of Figure 9 is lost. Its two rectangular grooves were inferred from the printed column with "
        "grooves, so agreement there is a fit, not a prediction.",
        "Heights of P in metres at t = 1 s; the plate is still swinging then.",
    ]
    return Table("Height of P: He, Patel and Shabana, Table 5, beside this run", TABLE5, rows, notes)


DIFFERENCES = (
    "A force on a point, or on a line through the thickness, has no converged answer: a shear-deformable plate sinks "
    "without bound as the mesh is refined, logarithmically and slowly, a solid faster. Orders and bands are therefore "
    "claimed down to the last digits only for the patch-loaded twins.",
    "The paper's clamp fixes all twelve coordinates of a node, the gradient normal to the edge included; a solid can "
    "only hold the face. The patch-loaded twins hold the face in both solvers.",
    "The plate's cross-section may stretch and shear but stays straight within an element. Beside a groove the solid "
    "warps through the thickness within about one thickness of each edge; no quadrature rule gives that motion to "
    "the plate element, and refining it without following the groove gives it only slowly.",
    "The element interpolates a twist w = xy with 9.7 % too much bending energy on any mesh that is coarse beside the "
    "thickness (nu = 0), so its ladder approaches the limit from the stiff side and late.",
    "The printed converged value with grooves belongs to the lost groove of Figure 9 and to a commercial code's own "
    "material law and mesh; the inferred groove reproduces the ANCF column, which bounds neither.",
    "Both solvers use the trapezoidal rule, with the time steps of the tables; the height is read while the plate "
    "swings, so a difference in period shows as a difference in height.",
)

LIMITS = (
    "That the groove is the paper's: it was inferred from the column that it is compared with.",
    "That either solver is right: two codes that agree may share a misreading of the question. They share no "
    "numerics, only the statement of the scene and the format of the answer.",
    "Anything about other materials, nu > 0, contact or curved plates: none of them occurs here.",
    "That the height of P under the point load is converged: see the differences above.",
    "That a figure met with a small margin stays met on another machine: see the gate's tolerances.",
)

COMMANDS = (
    ("make cantilever", "this page at the standard budget"),
    ("make cantilever BUDGET=full", "with the 12x12 and 16x16 rows and the finest reference"),
    ("groovecheck table cantilever --format json", "every row of every table, with full digits (--budget as above)"),
    ("groovecheck run cantilever_plain --solver ancf", "the columns of Table 5 without grooves alone"),
    ("groovecheck run cantilever_patch", "the patch-loaded twin with grooves alone"),
    ("groovecheck run cantilever --set grooves.0.depth=0.027 --set grooves.1.depth=0.027", "another groove"),
    ("groovecheck check cantilever", "a fresh quick run against the accepted table"),
)
