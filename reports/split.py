"""What the distance between the two solvers is made of, and what an accuracy costs in each.

A finest level stands away from its own limit (discretisation), and the two limits from each other (model): the
solvers read the same question with other kinematics, so that their limits need not be one number.

    ANCF - reference = (ANCF - its limit) + (limit of ANCF - limit of reference) + (limit of reference - reference)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare import plots
from compare.report import Block, Column, Plots, Section, Table
from compare.study import Entry, level_name
from compare.table import answer, at_rest, error, unit
from reports.ladders import Ladder, by_mode, error_target, ladders, scenes
from reports.speed_curves import cost_to

COSTS = (10.0, 1.0, 0.1)  # percent
PARTS = (
    ("ancf_percent", "ancf", "ANCF mesh"),
    ("model_percent", "difference", "model"),
    ("reference_percent", "reference", "reference mesh"),
)


def split(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """One dict per scene (and mode) that both solvers answered: their distance and its parts in percent."""
    found = []
    for scene, members in ((s, m) for s in scenes(entries) for m in by_mode(ladders(entries, s.name))):
        pair = [next((f for f in members if f.solver == solver and f.finest), None) for solver in ("ancf", "reference")]
        if all(pair):
            found.append({"scene": scene.name, "mode": pair[0].mode, "unit": unit(scene), **_parts(*pair)})
    return found


def _parts(ancf: Ladder, reference: Ladder) -> dict[str, Any]:
    ours, theirs = answer(ancf.finest), answer(reference.finest)
    whole = None if error(ancf.finest, theirs) is None else theirs - at_rest(reference.finest)
    ends = [ladder.convergence.extrapolated for ladder in (ancf, reference)]
    base = {
        "ancf_level": level_name(ancf.finest.level),
        "reference_level": level_name(reference.finest.level),
        "total_percent": error(ancf.finest, theirs),
    }
    refused = [f"{f.label}: {f.convergence.refused}" for f in (ancf, reference) if f.convergence.extrapolated is None]
    if refused:
        empty = dict.fromkeys((*(key for key, _, _ in PARTS), "uncertain_percent"))
        return {**base, **empty, "reading": f"inconclusive, because there is no limit of {'; of '.join(refused)}"}
    parts = dict(zip((key for key, _, _ in PARTS), (ours - ends[0], ends[0] - ends[1], ends[1] - theirs), strict=True))
    uncertain = _of(sum(f.convergence.gci for f in (ancf, reference)), whole and abs(whole))
    parts = {key: _of(part, whole) for key, part in parts.items()}
    return {**base, **parts, "uncertain_percent": uncertain, "reading": _reading(parts["model_percent"], uncertain)}


def _of(part: float, whole: float | None) -> float | None:
    return 100 * part / whole if whole else None


def _reading(model: float | None, uncertain: float | None) -> str:
    if model is None:
        return "inconclusive, because the reference's answer is none"
    if abs(model) <= uncertain:
        return "inconclusive: the limits are nearer to each other than their bands are wide"
    return "the models differ: more than both bands together explain"


def costs(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Wall seconds of each ladder to each of COSTS, measured from the page's best value, with the reason without."""
    found = []
    for scene, members in ((s, m) for s in scenes(entries) for m in by_mode(ladders(entries, s.name))):
        target = error_target(members)
        for ladder in members if target else ():
            line = {"scene": scene.name, "mode": ladder.mode, "ladder": ladder.label, "target": target[1]}
            told = [_cost(ladder, target[0], part) for part in COSTS]
            line |= {f"seconds_{part:g}": cost for part, (cost, _) in zip(COSTS, told, strict=True)}
            found.append({**line, "refused": "; ".join(dict.fromkeys(why for _, why in told if why)) or None})
    return found


def _cost(ladder: Ladder, target: float, part: float) -> tuple[float | None, str | None]:
    """Wall seconds of a ladder to an error (percent), or why they are not known."""
    if not ladder.solved:
        return None, "no level succeeded"
    if target == answer(ladder.finest):
        return None, "errors are measured from its own finest level"
    errors = ladder.errors(target)
    if errors is None:
        return None, "the answer is none"
    return cost_to(errors, [entry.wall_seconds for entry in ladder.solved], part)


def content(entries: Sequence[Entry]) -> dict[str, Any]:
    """What a page's JSON holds of both."""
    return {"split": split(entries), "costs": costs(entries)}


def section(content: dict[str, Any]) -> Section | None:
    """The section of both tables, with a drawing of the parts; None where there is neither."""
    blocks: list[Block] = []
    parts, paid = content["split"], content["costs"]
    if bars := _bars(parts):
        words = "Parts of the distance at the finest levels, in percent of the reference's answer."
        blocks.append(Plots([(plots.bar_plot("split", "Parts of the distance", words, bars, "part (%)"), words)]))
    if parts:
        blocks.append(Table("ANCF beside the reference, and what that is made of", _shown(SPLIT, parts), parts, NOTES))
    if paid:
        note = "Interpolated between levels in the logarithms; from the level on behind which the error stays within."
        blocks.append(Table("Wall time to an accuracy", _shown(PAID, paid), paid, [note]))
    return Section("split", "Why the solvers differ, and what an accuracy costs", blocks, "Why") if blocks else None


def _bars(parts: Sequence[dict[str, Any]]) -> list[plots.Bar]:
    known = [line for line in parts if line["model_percent"] is not None]
    return [
        plots.Bar(
            " ".join(filter(None, (line["scene"], line["mode"] and f"mode {line['mode']}", words))), role, line[key]
        )
        for line in known[:6]
        for key, role, words in PARTS
    ]


def _shown(columns: Sequence[Column], rows: Sequence[dict[str, Any]]) -> list[Column]:
    return [column for column in columns if any(row.get(column.key) is not None for row in rows)]


SPLIT = (
    Column("scene", "scene"),
    Column("mode", "mode", "d"),
    Column("ancf_level", "ANCF"),
    Column("reference_level", "reference"),
    Column("total_percent", "ANCF beside reference", "+.3f", "%"),
    Column("ancf_percent", "ANCF mesh", "+.3f", "%", "finest ANCF level minus its own Richardson value"),
    Column("model_percent", "model", "+.3f", "%", "limit of ANCF minus limit of the reference"),
    Column(
        "reference_percent", "reference mesh", "+.3f", "%", "Richardson value of the reference minus its finest level"
    ),
    Column("uncertain_percent", "bands", ".3f", "± %", "sum of the half widths of both bands"),
    Column("reading", "reading", "wrap"),
)
PAID = (
    Column("scene", "scene"),
    Column("mode", "mode", "d"),
    Column("ladder", "ladder"),
    *(Column(f"seconds_{part:g}", f"to {part:g} %", ".3g", "s") for part in COSTS),
    Column("target", "measured from"),
    Column("refused", "not known because", "wrap"),
)
NOTES = (
    "In percent of the reference's answer, of a height measured from rest; positive: ANCF is farther from rest. The "
    "three parts add up to the distance.",
    "Mesh parts are each solver's own, from its own ladder. The model part is what refining either mesh cannot remove: "
    "a plate's kinematics against a solid's, and how each holds and loads the body.",
)
