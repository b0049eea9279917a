"""Which runs of a study a page lets its reader turn in three dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.bodies import Body, pack
from compare.report import Bodies
from compare.study import Entry, level_name
from compare.table import element, height, in_ladders, unit
from reports.ladders import NAMES, ladders, scenes

ALLOWED = 2_300_000  # bytes of all bodies of a page: with pictures and plots it stays below 5 MB
REACH = 0.1  # of the body's size: the largest displacement of a mode


def bodies(entries: Sequence[Entry]) -> Bodies | None:
    """The surfaces of the ladders' runs, finest levels first, as many as the page may carry; None without any."""
    packed, room, left = [], ALLOWED, 0
    for entry in _ordered(entries):
        body = _body(entry)
        if body.size > room:
            left += 1
            continue
        room -= body.size
        packed.append(body)
    words = f"{left} more are left out to keep the page small." if left else ""
    return Bodies(packed, words) if packed else None


def named(rows: Sequence[dict[str, Any]], entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Rows of a table with "run", the name of the body that each opens."""
    return [{**row, "run": entry.key} for row, entry in zip(rows, entries, strict=True)]


def _ordered(entries: Sequence[Entry]) -> list[Entry]:
    """Runs with a surface, each once: the finest of every ladder, then the others from fine to coarse."""
    drawn = [e for e in in_ladders(list(entries)) if e.result is not None and e.result.outline is not None]
    finest = {id(f.finest) for scene in scenes(entries) for f in ladders(entries, scene.name)}
    ordered = sorted(drawn, key=lambda e: (id(e) not in finest, e.result.h))
    return list({entry.key: entry for entry in ordered}.values())


def _body(entry: Entry) -> Body:
    outline, result = entry.result.outline, entry.result
    if outline.modes is not None:
        size = float(np.linalg.norm(np.ptp(outline.points, axis=0)))
        steps = [f"mode {i + 1}, {hertz:.5g} Hz" for i, hertz in enumerate(result.frequencies)]
        header, data = pack(outline, steps, REACH * size * outline.modes)
    else:
        last = result.times[-1] if len(result.times) else 0.0
        words = "t = {:.4g} s" if entry.scene.analysis.kind == "dynamic" else "load parameter {:.4g}"
        header, data = pack(outline, [words.format(last)], outline.displacement[None])
    value = height(entry) if unit(entry.scene) == "m" else None
    label = f"{NAMES.get(entry.solver, entry.solver)} {level_name(entry.level)}, {element(entry.level)}"
    label += f", {result.unknowns} unknowns" + ("" if value is None else f", {value:.5f} m".replace("-", "\u2212"))
    label += "" if entry.ok else f", {entry.status}"
    return Body(entry.key, entry.scene.name, label, entry.solver, header, data)
