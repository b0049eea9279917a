"""Which runs of a study a page lets its reader turn in three dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.bodies import Body, pack
from compare.report import Bodies
from compare.result import Result
from compare.study import Entry, level_name
from compare.table import element, height, in_ladders, unit
from reports.ladders import NAMES, ladders, named, scenes

ALLOWED = 2_300_000  # bytes of all bodies of a page: with pictures and plots it stays below 5 MB
REACH = 0.1  # of the body's size: the largest displacement of a mode


def bodies(entries: Sequence[Entry]) -> Bodies | None:
    """The surfaces of the ladders' runs, finest levels first, as many as the page may carry; None without any."""
    packed, room, left = [], ALLOWED, 0
    finest = {f.finest.key for scene in scenes(entries) for f in ladders(entries, scene.name) if f.finest}
    for entry in _ordered(entries, finest):
        body = _body(entry, moving=entry.key in finest)
        if body.size > room:
            left += 1
            continue
        room -= body.size
        packed.append(body)
    words = f"{left} more are left out to keep the page small." if left else ""
    return Bodies(packed, words) if packed else None


def opened(rows: Sequence[dict[str, Any]], entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Rows of a table with "run", the name of the body that each opens."""
    return [{**row, "run": entry.key} for row, entry in zip(rows, entries, strict=True)]


def _ordered(entries: Sequence[Entry], finest: set[str]) -> list[Entry]:
    """Runs with a surface, each once: the finest of every ladder, then the others from fine to coarse."""
    drawn = [e for e in in_ladders(list(entries)) if e.result is not None and e.result.outline is not None]
    ordered = sorted(drawn, key=lambda e: (e.key not in finest, e.result.h))
    return list({entry.key: entry for entry in ordered}.values())


def _body(entry: Entry, moving: bool) -> Body:
    """A run's body; moving: with the outputs on the way to its last one."""
    result = entry.result
    header, data = pack(result.outline, *(_modes(result) if result.outline.modes is not None else _path(entry, moving)))
    value = height(entry) if unit(entry.scene) == "m" else None
    label = f"{named(entry.solver)} {level_name(entry.level)}, {element(entry.level)}"
    label += f", {result.unknowns} unknowns" + ("" if value is None else f", {value:.5f} m".replace("-", "\u2212"))
    label += "" if entry.ok else f", {entry.status}"
    return Body(entry.key, entry.scene.name, label, entry.solver if entry.solver in NAMES else "third", header, data)


def _modes(result: Result) -> tuple[list[str], np.ndarray]:
    """Names and shapes (k, n, 3) of vibrations, REACH times the body's size in their largest displacement."""
    size = float(np.linalg.norm(np.ptp(result.outline.points, axis=0)))
    steps = [f"mode {i}, {hertz:.5g} Hz" for i, hertz in enumerate(result.frequencies, 1)]
    return steps, REACH * size * result.outline.modes


def _path(entry: Entry, moving: bool) -> tuple[list[str], np.ndarray]:
    """Names and displacements (s, n, 3) of outputs, the last one of the run at their end."""
    result, outline = entry.result, entry.result.outline
    words = "t = {:.4g} s" if entry.scene.analysis.kind == "dynamic" else "load parameter {:.4g}"
    told = result.times if result.load_parameter is None else result.load_parameter
    last = len(told) - 1
    index = outline.path_index if moving and outline.path is not None else ()
    chosen = [i for i, output in enumerate(index) if output < last]
    steps = [words.format(told[index[i]]) for i in chosen] + [words.format(told[last] if len(told) else 0.0)]
    return steps, np.array([*(outline.path[i] for i in chosen), outline.displacement], float)
