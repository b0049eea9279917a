"""Which runs of a study a page lets its reader turn in three dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from compare.bodies import Body, pack
from compare.report import Bodies
from compare.result import Result
from compare.study import Entry, level_name
from compare.table import element, height, in_ladders, unit
from reports.ladders import NAMES, ladders, named, scenes

ALLOWED = 2_600_000  # bytes of all bodies of a page: with pictures and plots it stays below 5 MB
REACH = 0.1  # of the body's size: the largest displacement of a mode


def bodies(entries: Sequence[Entry]) -> Bodies | None:
    """The surfaces of the ladders' runs at their last output, finest levels first, as many as the page may carry.

    What room is left goes to the outputs on the way there of the finest levels, small ones first. None without any.
    """
    finest = {f.finest.key for scene in scenes(entries) for f in ladders(entries, scene.name) if f.finest}
    ordered, packed, room = _ordered(entries, finest), {}, ALLOWED
    for entry in ordered:
        body = _body(entry, moving=False)
        if body.size <= room:
            packed[entry.key] = body
            room -= body.size
    for entry in sorted(ordered, key=lambda e: len(e.result.outline.points)):
        if entry.key in finest and entry.key in packed:
            body = _body(entry, moving=True)
            more = body.size - packed[entry.key].size
            if more <= room:
                packed[entry.key] = body
                room -= more
    left = len(ordered) - len(packed)
    words = f"{left} more are left out to keep the page small." if left else ""
    return Bodies(list(packed.values()), words) if packed else None


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
    steps, shapes = _modes(result) if result.outline.modes is not None else _path(entry, moving)
    header, data = pack(result.outline, steps, shapes, _fields(entry))
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


def _fields(entry: Entry) -> dict[str, np.ndarray]:
    """Contact at the last output on the nodes of a flat plate's surface: that of the nearest contact point, 0 away."""
    contact, outline = entry.result.contact, entry.result.outline
    if contact is None or not len(contact.points) or entry.scene.surface.kind != "rectangle":
        return {}
    distance, nearest = cKDTree(contact.points).query(outline.points)
    spacing = cKDTree(contact.points).query(contact.points, k=min(2, len(contact.points)))[0].max()
    pressed = np.where(distance <= max(spacing, 1e-9), np.maximum(contact.pressure[nearest], 0.0), 0.0)
    single = bool((contact.share == 1).all())
    return {"contact force at the end (N)" if single else "contact pressure at the end (Pa)": pressed}
