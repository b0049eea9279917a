"""Third solvers beside the two of this project: each level with its error and its time over the reference's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.report import Column, Section, Table
from compare.study import Entry, level_name
from compare.table import answer, error, unit
from reports.ladders import NAMES, Ladder, by_mode, error_target, ladders, named, scenes

ALIKE = 1.3  # largest ratio of two element sizes that are compared with each other


def content(entries: Sequence[Entry]) -> dict[str, Any]:
    """What a page's JSON holds: "third", one dict per level of a solver that is neither ANCF nor the reference."""
    found = []
    for scene, members in ((s, m) for s in scenes(entries) for m in by_mode(ladders(entries, s.name))):
        own = [ladder for ladder in members if ladder.solver in NAMES]
        target = error_target(own or members)
        reference = next((ladder for ladder in own if ladder.solver == "reference"), None)
        for ladder in (ladder for ladder in members if ladder.solver not in NAMES):
            found += [_line(scene, ladder, entry, target, reference) for entry in ladder.solved]
    return {"third": found}


def _line(scene: Any, ladder: Ladder, entry: Entry, target: tuple[float, str] | None, reference: Ladder | None):
    close = _closest(entry, reference)
    own, theirs = (_error(e, target) for e in (entry, close))
    seconds, other = entry.wall_seconds or None, close.wall_seconds if close else None
    return {
        "scene": scene.name,
        "mode": ladder.mode,
        "solver": named(entry.solver),
        "version": entry.result.version,
        "mesh": level_name(entry.level),
        "value": answer(entry),
        "unit": unit(scene),
        "error_percent": own,
        "seconds": seconds,
        "beside": None if close is None else f"reference {level_name(close.level)}",
        "error_ratio": abs(own / theirs) if own is not None and theirs else None,
        "time_ratio": seconds / other if seconds and other else None,
        "target": target and target[1],
        "run": entry.key,
    }


def _closest(entry: Entry, reference: Ladder | None) -> Entry | None:
    """The reference's level of the nearest element size, None where none is alike."""
    h = entry.result.h
    near = min(reference.solved if reference else (), key=lambda e: max(h / e.result.h, e.result.h / h), default=None)
    return near if near is not None and max(h / near.result.h, near.result.h / h) < ALIKE else None


def _error(entry: Entry | None, target: tuple[float, str] | None) -> float | None:
    return error(entry, target and target[0])


def section(content: dict[str, Any]) -> Section | None:
    """The section of the third solvers; None without any."""
    rows = content["third"]
    if not rows:
        return None
    columns = [column for column in COLUMNS if any(row[column.key] is not None for row in rows)]
    table = Table("Other codes, run or read", columns, rows, NOTES)
    return Section("third", "A third solver beside the two", [table], "Third solver")


COLUMNS = (
    Column("scene", "scene"),
    Column("mode", "mode", "d"),
    Column("solver", "solver"),
    Column("version", "version"),
    Column("mesh", "mesh"),
    Column("value", "value", ".6g"),
    Column("unit", "unit"),
    Column("error_percent", "error", "+.3f", "%"),
    Column("seconds", "wall time", ".3g", "s"),
    Column("beside", "beside"),
    Column("error_ratio", "error ratio", ".3g"),
    Column("time_ratio", "time ratio", ".3g"),
    Column("target", "error measured from"),
)
NOTES = (
    "Ratios: this solver's |error| and wall time over those of the reference's level of the nearest element size "
    f"(within a factor of {ALIKE:g}); above 1 the third solver is farther away, or slower.",
    "CalculiX runs on the reference's mesh and nodal forces with one thread and its own elements (four integration "
    "points), steps and tolerances. A file's times are what its author says, on the author's machine.",
)
