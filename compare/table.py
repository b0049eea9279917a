"""Entries of a study -> rows of the table, and what each judged number is judged against.

A row is a dict with exactly the keys of KEYS; null (None) where a key does not apply.

- element: "enriched", "conforming" (the paper's), "acm" or "P2 tetrahedron". rule: Gauss points per
  subdomain as stated in the level, "3x3x2", with " global" behind it where grooves are ignored by
  the rule; 7x7x3 is exact for this element and SVK. null for the reference, whose rule is its own.
- groove: "none", or the names of grooves and protrusions joined by "+". load: kinds of the loads joined by "+".
- mesh: "4x4" elements, or "h=0.1" metres. level: index in its series (see `series`). h: metres.
- mode: number of the natural frequency, from 1, of a scene that asks for modes: a row each; null for a height.
- value: the scene's `answer` at the last output time, height z (m) or displacement (m) of the answer probe, the scene's
  first; of a mode its frequency (Hz).
- paper: the printed height for that mesh, for the reference the printed converged one.
- error_..._percent: 100 (value - against) / (against - rest), where rest is a height's value in the undeformed body and
  zero for all others; positive where the value is farther from rest;
  reference: the finest successful reference level of the same scene, for a mode its mode of the same number.
- order, sequence, extrapolated, gci_percent: of the series' levels up to that row (convergence.study,
  with `highest_order`).
- wall_seconds: least of the runs. peak_mb: MiB of the whole process. status: "ok" or the failure's name.

The rows hold the ladders only; the sensitivity variants of a scene are `sensitivity(entries)`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from compare.convergence import Convergence, study
from compare.exact import Value, cross_code, published, reentrant_order
from compare.scene import Level, Scene
from compare.scene_corners import reentrant_angle
from compare.study import AS_STATED, Entry, level_name
from compare.treads import title

NOTHING = 1e-9  # of a displacement: what solvers' tolerances leave of a component that is none
MOST_DECIMALS = 12
KEYS = (
    *("solver", "element", "rule", "groove", "load", "mode", "mesh", "level", "unknowns", "h", "value"),
    *("paper", "error_paper_percent", "error_reference_percent", "order", "sequence", "extrapolated", "gci_percent"),
    *("wall_seconds", "peak_mb", "newton_iterations", "status"),
)

Row = dict[str, Any]


def rows(entries: list[Entry]) -> list[Row]:
    """One row per entry of `in_ladders`."""
    ladder = in_ladders(entries)
    found = convergences(ladder)
    return [_row(entry, ladder, convergence) for entry, convergence in zip(ladder, found, strict=True)]


def in_ladders(entries: list[Entry]) -> list[Entry]:
    """The entries that rows stand for: those of the scenes as they are stated, level by level.

    Where a scene asks for modes each entry stands there once per mode, all levels of a mode together.
    """
    stated = [entry for entry in entries if entry.variant is None]
    single = [each for entry in stated for each in _modes(entry)]
    order = {name: place for place, name in enumerate(dict.fromkeys(entry.scene.name for entry in stated))}
    return sorted(single, key=lambda entry: (order[entry.scene.name], entry.mode or 0))


def _modes(entry: Entry) -> list[Entry]:
    if entry.mode is not None or entry.scene.analysis.kind != "modes":
        return [entry]
    return [replace(entry, mode=mode) for mode in range(1, entry.scene.analysis.count + 1)]


def series(entry: Entry) -> tuple[Any, ...]:
    """What the levels of one convergence series share: scene, mode, solver, and all of the level but its size."""
    return (entry.scene.name, entry.mode, entry.solver, *kind(entry.level).items())


def kind(level: Level) -> dict[str, Any]:
    """The keys of a level that are no resolution of the mesh."""
    stated = vars(level)
    return {key: stated[key] for key in sorted(stated) if key not in ("mesh", "size", "budget")}


def coarse_first(entries: Iterable[Entry]) -> list[Entry]:
    """The levels of a series from the coarsest to the finest, in whatever order they are stated."""
    return sorted(entries, key=lambda entry: fineness(entry.level))


def fineness(level: Level) -> float:
    """A number that grows along the levels of a series."""
    return math.prod(level.mesh) if hasattr(level, "mesh") else -level.size


def convergences(entries: list[Entry]) -> list[Convergence]:
    """For each entry what its series says up to it: every level that is not finer."""
    groups: dict[tuple[Any, ...], list[Entry]] = {}
    for entry in entries:
        groups.setdefault(series(entry), []).append(entry)
    groups = {name: coarse_first(group) for name, group in groups.items()}
    highest = {name: highest_order(group[0]) for name, group in groups.items()}
    return [
        _converged(entry, groups[name], highest[name])
        for entry, name in zip(entries, map(series, entries), strict=True)
    ]


def _converged(entry: Entry, group: list[Entry], highest: float) -> Convergence:
    """Convergence of the levels of a series (coarse to fine) up to an entry; refused behind a failed level."""
    if not entry.ok:
        return Convergence(None, refused=f"failed level: {entry.status}")
    failed = [other for other in group[: group.index(entry)] if not other.ok]
    if failed:
        reason = ", ".join(f"{level_name(other.level)} {other.status}" for other in failed)
        return Convergence(None, refused=f"failed level: {reason}", value=answer(entry))
    coarser = [other for other in group if other.ok and other.result.h >= entry.result.h]
    h = [other.result.h for other in coarser]
    if len(set(h)) < len(h):
        return Convergence(None, refused="two levels of equal h", value=answer(entry))
    return study(h, [answer(other) for other in coarser], highest=highest, rest=at_rest(entry))


def highest_order(entry: Entry) -> float:
    """Order that theory allows a series in the limit: a solid is singular at the sharpest re-entrant edge of its bands;
    without such edges there is no bound. A plate has no such edge in its kinematics."""
    angle = None if entry.solver == "ancf" else reentrant_angle(entry.scene)
    return math.inf if angle is None else reentrant_order(angle)


def _row(entry: Entry, entries: list[Entry], found: Convergence) -> Row:
    result, value = entry.result, answer(entry)
    paper, finest = paper_value(entry), finest_reference(entry, entries)
    against = None if finest is None or finest is entry else answer(finest)
    row = {
        "solver": entry.solver,
        "element": element(entry.level),
        "rule": rule(entry.level),
        "groove": groove(entry),
        "load": "+".join(dict.fromkeys(load.kind for load in entry.scene.loads)) or "none",
        "mode": entry.mode,
        "mesh": level_name(entry.level),
        "level": _index(entry),
        "unknowns": (result and result.unknowns) or None,  # a file of another code may not say
        "h": result and result.h,
        "value": value,
        "paper": paper and paper.value,
        "error_paper_percent": error(entry, paper and paper.value),
        "error_reference_percent": error(entry, against),
        "order": found.order,
        "sequence": found.sequence,
        "extrapolated": found.extrapolated,
        "gci_percent": found.gci_percent,
        "wall_seconds": entry.wall_seconds,
        "peak_mb": result and result.peak_mb,
        "newton_iterations": result and result.newton_iterations,
        "status": entry.status,
    }
    assert tuple(row) == KEYS
    return row


def judgements(entries: list[Entry]) -> list[dict[str, Any]]:
    """For each row: scene, key of the result, and for each judged number what it is judged against.

    "paper": {kind, source, cell, value, rule_agrees} or None; rule_agrees is whether the row's rule is
    the one that the printed row was found to use. "reference": {kind, source, cell, value} or None.
    "cross_code": heights that CalculiX found for the same question. "band_refused": why there is no GCI band, or None.
    """
    ladder = in_ladders(entries)
    found = convergences(ladder)
    return [_judgement(entry, ladder, convergence) for entry, convergence in zip(ladder, found, strict=True)]


def _judgement(entry: Entry, entries: list[Entry], found: Convergence) -> dict[str, Any]:
    paper, finest = paper_value(entry), finest_reference(entry, entries)
    reference = None
    if finest is not None and finest is not entry:
        source = f"{finest.result.solver} {finest.result.version}, finest successful level"
        reference = {"kind": "cross-code", "source": source, "cell": level_name(finest.level), "value": answer(finest)}
    return {
        "scene": entry.scene.name,
        "key": entry.key,
        "paper": paper and {**described(paper), "rule_agrees": _rule_agrees(entry)},
        "reference": reference,
        "cross_code": [described(value) for value in cross_code(entry.scene)],
        "band_refused": found.refused,
    }


def described(value: Value) -> dict[str, Any]:
    """A known value as plain JSON: kind, source, cell, value."""
    return {"kind": value.kind, "source": value.source, "cell": value.cell, "value": value.value}


def sensitivity(entries: list[Entry]) -> list[dict[str, Any]]:
    """One dict per sensitivity variant: scene, variant, solver, mesh, rule, unit, value (of modes the first), change
    and change_percent against the unchanged scene at the same level, paper, error_paper_percent, status."""
    stated = {(e.scene.name, e.solver): answer(e) for e in entries if e.variant == AS_STATED}
    found = []
    for entry in entries:
        if entry.variant is None:
            continue
        value, base, paper = answer(entry), stated.get((entry.scene.name, entry.solver)), paper_value(entry)
        found.append(
            {
                "scene": entry.scene.name,
                "variant": entry.variant,
                "solver": entry.solver,
                "mesh": level_name(entry.level),
                "rule": rule(entry.level),
                "unit": unit(entry.scene),
                "value": value,
                "change": None if None in (value, base) else value - base,
                "change_percent": error(entry, base),
                "paper": paper and paper.value,
                "error_paper_percent": error(entry, paper and paper.value),
                "status": entry.status,
            }
        )
    return found


def element(level: Level) -> str:
    """Name of the element of a level, and what was spent on grooves."""
    if not hasattr(level, "element"):
        return "P2 tetrahedron"
    beside = None if level.fit is None else " ".join(["fitted", *(f"{distance:g}" for distance in level.fit)])
    spent = (
        beside,
        level.enrich and f"layers to {level.enrich:g}",
        level.walls and "walls",
        level.lips and "lips",
        level.volumetric not in (None, "relaxed") and f"{level.volumetric} volumetric energy",
    )
    return ", ".join([level.element, *filter(None, spent)])


def rule(level: Level) -> str | None:
    """Quadrature rule of a level, None where it states none."""
    points = getattr(level, "points", None)
    if points is None:
        return None
    return "x".join(map(str, points)) + (" global" if level.integration == "global" else "")


def groove(entry: Entry) -> str:
    """Names of the local geometry joined by "+", one for a tread, "none" without any."""
    names = (title(band.name) for band in (*entry.scene.grooves, *entry.scene.protrusions))
    return "+".join(dict.fromkeys(names)) or "none"


def unit(scene: Scene) -> str:
    """Unit of the scene's answer."""
    return "Hz" if scene.analysis.kind == "modes" else "m"


def quantity(scene: Scene, mode: int | None = None) -> str:
    """What the scene's answer is, in words; of a scene that asks for modes the first unless another one is named."""
    if scene.analysis.kind == "modes":
        return f"frequency of mode {mode or 1}"
    what = "height" if scene.answer == "height" else f"displacement {scene.answer}"
    return f"{what} of {scene.probes[0].name}"


def digits(values: Iterable[float | None], rest: float = 0.0) -> str:
    """Format of answers that shows five digits of the largest displacement among them, five decimals at least.

    >>> digits([-0.41, None]), digits([-6.5785e-5]), digits([18.7466], rest=19.0)
    ('.5f', '.9f', '.5f')
    """
    largest = max((abs(value - rest) for value in values if value is not None and math.isfinite(value)), default=0.0)
    decimals = 4 - math.floor(math.log10(largest)) if largest > 0 else 0
    return f".{min(max(decimals, 5), MOST_DECIMALS)}f"


def shown(entry: Entry) -> str | None:
    """An entry's answer with its unit, for people."""
    value = answer(entry)
    return None if value is None else f"{value:{digits([value], at_rest(entry))}} {unit(entry.scene)}"


def farther(scene: Scene) -> str:
    """What a positive difference in percent means, in words."""
    if scene.analysis.kind == "modes":
        return "the higher frequency"
    return "farther from where it was at rest"


def answer(entry: Entry) -> float | None:
    """What the scene asks for: a height or a displacement (m) of the first probe at the last output time, or the
    frequency (Hz) of the entry's mode, the first where none is named. None unless the status is ok.
    """
    if not entry.ok:
        return None
    if entry.scene.analysis.kind == "modes":
        return float(entry.result.frequencies[(entry.mode or 1) - 1])
    return float(history(entry)[-1])


def history(entry: Entry) -> np.ndarray:
    """Height or displacement (t,) in m of the answer probe at every output, of an entry that succeeded."""
    scene, result = entry.scene, entry.result
    if scene.answer == "height":
        return result.position(scene.probes[0].name)[:, 2]
    return result.displacement[:, _probe(entry), "xyz".index(scene.answer[-1])]


def _probe(entry: Entry) -> int:
    """Number of the answer probe in an entry's result."""
    return entry.result.probes.index(entry.scene.probes[0].name)


def at_rest(entry: Entry) -> float:
    """The answer of the undeformed body: a height's in m, 0 for displacements and frequencies. The entry must be ok."""
    if entry.scene.analysis.kind == "modes" or entry.scene.answer != "height":
        return 0.0
    return float(entry.result.probe_position[_probe(entry), 2])


def height(entry: Entry) -> float | None:
    """z (m) of the answer probe, the scene's first, at the last output time; None unless the status is ok."""
    if not entry.ok:
        return None
    return float(entry.result.position(entry.scene.probes[0].name)[-1, 2])


def rest(entries: Iterable[Entry]) -> float:
    """`at_rest` of the entries of one question: of the first that succeeded, 0 without one."""
    return next((at_rest(entry) for entry in entries if entry.ok), 0.0)


def error(entry: Entry | None, against: float | None) -> float | None:
    """`percent` of an entry's answer against another one; None without one, and where what `against` moves by is next
    to nothing of the probe's own displacement: round-off has no accuracy."""
    if entry is None or not entry.ok or against is None:
        return None
    start, vibrates = at_rest(entry), entry.scene.analysis.kind == "modes"
    if not vibrates and abs(against - start) <= NOTHING * np.linalg.norm(entry.result.displacement[-1, _probe(entry)]):
        return None
    return percent(answer(entry), against, start)


def percent(value: float | None, against: float | None, rest: float = 0.0) -> float | None:
    """100 (value - against) / (against - rest); None where either is missing or `against` is `rest`."""
    return None if None in (value, against) or against == rest else 100 * (value - against) / (against - rest)


def paper_value(entry: Entry) -> Value | None:
    """The printed height that an entry's row is judged against: of its mesh, and of its rule where several are."""
    mesh, stated = getattr(entry.level, "mesh", None), entry.scene.published
    same = [value for value in published(entry.scene) if value.mesh == mesh]
    if len(same) < 2 or mesh is None:
        return next(iter(same), None)
    rules = [row.points for row in stated.rows if row.mesh == mesh]
    return same[rules.index(entry.level.points) if entry.level.points in rules else 0]


def finest_reference(entry: Entry, entries: list[Entry]) -> Entry | None:
    """The finest successful reference entry of the same scene and mode: of least h, there of the least steps."""
    about = (entry.scene.name, entry.mode)
    same = [e for e in entries if e.solver == "reference" and (e.scene.name, e.mode) == about and e.ok]
    return min(same, key=_resolution, default=None)


def _resolution(entry: Entry) -> tuple[float, ...]:
    """Element length, time step and allowed error per step of an entry, whichever it has."""
    level = entry.level
    return entry.result.h, getattr(level, "time_step", None) or 0.0, getattr(level, "error_per_step", None) or math.inf


def _rule_agrees(entry: Entry) -> bool | None:
    """Whether the level's points are those that the printed row was found to use; None where none were found."""
    stated = entry.scene.published
    found = [row.points for row in stated.rows if row.mesh == getattr(entry.level, "mesh", None) and row.points]
    return entry.level.points in found if found else None


def _index(entry: Entry) -> int:
    """Index of an entry's level in its series of the whole ladder, whatever the budget."""
    if entry.solver not in ("ancf", "reference"):
        return 0  # a third solver's levels are no ladder of the scene
    same = [level for level in entry.scene.ladder(entry.solver) if kind(level) == kind(entry.level)]
    return same.index(entry.level)
