"""Which runs of a study a page lets its reader turn in three dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from compare.bodies import Body, pack
from compare.report import Bodies
from compare.result import Outline, Result
from compare.study import Entry, level_name
from compare.table import element, in_ladders, shown, unit
from reports.ladders import NAMES, ladders, named, scenes

ALLOWED = 2_600_000  # bytes of all bodies of a page: with pictures and plots it stays below 5 MB
NEAR = (24, 500)  # triangles, by their middles, among which the one that holds a point is looked for
FAR = 2e-3  # of the body's size: farther from every triangle a point is not on the other surface
REACH = 0.1  # of the body's size: the largest displacement of a mode


def bodies(entries: Sequence[Entry]) -> Bodies | None:
    """The surfaces of the ladders' runs at their last output, finest levels first, as many as the page may carry.

    What room is left goes to the outputs on the way there of the finest levels, small ones first. None without any.
    """
    measure = {scene.name: _reference(entries, scene.name) for scene in scenes(entries)}
    finest = {f.finest.key for scene in scenes(entries) for f in ladders(entries, scene.name) if f.finest}
    ordered, packed, room = _ordered(entries, finest), {}, ALLOWED
    for entry in ordered:
        body = _body(entry, measure[entry.scene.name], moving=False)
        if body.size <= room:
            packed[entry.key] = body
            room -= body.size
    for entry in sorted(ordered, key=lambda e: len(e.result.outline.points)):
        if entry.key in finest and entry.key in packed:
            body = _body(entry, measure[entry.scene.name], moving=True)
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


def _reference(entries: Sequence[Entry], scene: str) -> Entry | None:
    """The reference's finest run of a scene: what the other bodies' errors are measured from."""
    found = [ladder.finest for ladder in ladders(entries, scene) if ladder.solver == "reference" and ladder.finest]
    return next((entry for entry in found if entry.result.outline is not None), None)


def _body(entry: Entry, reference: Entry | None, moving: bool) -> Body:
    """A run's body; moving: with the outputs on the way to its last one."""
    result = entry.result
    steps, shapes = _modes(result) if result.outline.modes is not None else _path(entry, moving)
    header, data = pack(result.outline, steps, shapes, _fields(entry, reference))
    value = shown(entry) if unit(entry.scene) == "m" else None
    label = f"{named(entry.solver)} {level_name(entry.level)}, {element(entry.level)}"
    label += f", {result.unknowns} unknowns" + ("" if value is None else f", {value}".replace("-", "\u2212"))
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


def _fields(entry: Entry, reference: Entry | None) -> dict[str, np.ndarray]:
    """What a body's last step may be coloured by, each under its name with its unit."""
    outline = entry.result.outline
    found = {} if outline.stress is None else {"von Mises stress at the end (Pa)": _joined(outline)}
    apart = None if reference is None or reference.key == entry.key else _apart(outline, reference.result.outline)
    if apart is not None:
        found[f"distance from the reference {level_name(reference.level)} at the end (m)"] = apart
    return found | _contact(entry)


def _joined(outline: Outline) -> np.ndarray:
    """Stress (n,), of elements that meet at a point and move alike there their mean."""
    rows = np.round(np.hstack([outline.points, outline.displacement]), 9)
    _, place, count = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    return (np.bincount(place.ravel(), outline.stress) / count)[place.ravel()]


def _apart(outline: Outline, other: Outline) -> np.ndarray | None:
    """Sizes (n,) in m of the difference of two solvers' displacements, where the other's surface has this one's points.

    The other's displacement is interpolated in the triangle of its surface that a point lies in. None where a point
    in a hundred lies on no triangle (within FAR of the body's size): the surfaces are then not one and the same. A
    mode has no size, and its sign means nothing: none for modes.
    """
    if outline.modes is not None or other.modes is not None:
        return None
    far = FAR * np.linalg.norm(np.ptp(outline.points, axis=0))
    there, missed = _read_off(other, outline.points, NEAR[0])
    lost = missed > far  # beside triangles of very different sizes the nearest middles are not enough
    if lost.any():
        there[lost], missed[lost] = _read_off(other, outline.points[lost], NEAR[1])
    if np.mean(missed > far) > 0.01:
        return None
    return np.linalg.norm(outline.displacement - there, axis=1)


def _read_off(other: Outline, points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (n, 3) of a surface at points (n, 3), and how far (m) each is from the nearest of the `count`
    triangles whose middles are closest."""
    corners = other.points[other.triangles]
    sides = corners[:, 1:] - corners[:, :1]
    inverse = np.linalg.pinv(sides.swapaxes(1, 2))
    _, near = cKDTree(corners.mean(axis=1)).query(points, k=min(count, len(corners)))
    near = near.reshape(len(points), -1)
    r = points[:, None] - corners[near, 0]
    inside = np.clip(np.einsum("qkai,qki->qka", inverse[near], r), 0.0, 1.0)
    inside /= np.maximum(inside.sum(axis=-1, keepdims=True), 1.0)
    missed = np.linalg.norm(r - np.einsum("qka,qkai->qki", inside, sides[near]), axis=-1)
    best = np.arange(len(points)), missed.argmin(axis=1)
    moved = other.displacement[other.triangles[near[best]]]
    there = moved[:, 0] + np.einsum("qa,qai->qi", inside[best], moved[:, 1:] - moved[:, :1])
    return there, missed[best]


def _contact(entry: Entry) -> dict[str, np.ndarray]:
    """Contact at the last output on the nodes of a flat plate's surface: that of the nearest contact point, 0 away.

    Where several obstacles may touch a face each has its points there: what they press is summed.
    """
    contact, outline = entry.result.contact, entry.result.outline
    if contact is None or not len(contact.points) or entry.scene.surface.kind != "rectangle":
        return {}
    points, place = np.unique(contact.points, axis=0, return_inverse=True)
    pressure = np.bincount(place.ravel(), np.maximum(contact.pressure, 0.0))
    distance, nearest = cKDTree(points).query(outline.points)
    spacing = cKDTree(points).query(points, k=min(2, len(points)))[0].max()
    pressed = np.where(distance <= max(spacing, 1e-9), pressure[nearest], 0.0)
    single = bool((contact.share == 1).all())
    return {"contact force at the end (N)" if single else "contact pressure at the end (Pa)": pressed}
