"""The true surface of a plate that outlines cut, as triangles: for pictures only.

The whole plate is one cell for `ancf.cut`, whose strips are divided further at element lines and evenly. Within a
strip lie quadrilaterals between two curves each; where what is beside one has another height there is a wall.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ancf.cut import PLAIN, Region, Strip, rows, strips
from ancf.feature import Feature, depth_at, faces
from ancf.mesh import Mesh
from ancf.subdomain import regions

INWARD = 1e-7  # of a strip: its sides are looked at from inside
THIN = 1e-9  # of the plate: what is narrower is not drawn
MEETING = 1e-6  # of a side: ordinates this near to each other are one
SAME = 5e-3  # of the thickness: heights this near to each other have no wall between them


class Column(NamedTuple):
    """Quadrilaterals of one strip from y0 to y1: y (k, 2) at its sides, z (2, k - 1, 2, 2) by face, side and end."""

    x: tuple[float, float]
    y: np.ndarray
    z: np.ndarray


def surface(mesh: Mesh, bands: Sequence[Feature], thickness: float, finest: int) -> tuple[np.ndarray, ...]:
    """Triangles (n, 3, 3) of both faces, quadrilaterals (k, 4, 3) of walls and edges, and element lines (m, 2, 3)."""
    columns = list(_columns(mesh, bands, thickness, finest))
    sides = _sides(columns)
    flat = [_flat(c, face, *sides[i : i + 2]) for i, c in enumerate(columns) for face in (0, 1)]
    walls = [_inner(column, face, thickness) for column in columns for face in (0, 1)]
    walls += [_between(*pair, y, face, thickness) for *pair, y in zip(columns, columns[1:], sides[1:], strict=False)
              for face in (0, 1)]  # fmt: skip
    walls += [_rim(columns[0], 0), _rim(columns[-1], 1), *(_end(column, k) for column in columns for k in (0, -1))]
    return np.concatenate(flat), np.concatenate(walls), _element_lines(mesh, columns)


def _sides(columns: Sequence[Column]) -> list[np.ndarray]:
    """Ordinates at which anything ends on the line between two columns; those of the columns are moved onto them."""
    found = []
    for left, right in zip([None, *columns], [*columns, None], strict=True):
        own = [c.y[:, k] for c, k in ((left, 1), (right, 0)) if c is not None]
        y = np.sort(np.concatenate(own))
        y = y[np.append(True, np.diff(y) > MEETING * np.ptp(y))]
        for part in own:
            part[:] = y[np.abs(part[:, None] - y).argmin(axis=1)]
        found.append(y)
    return found


def _columns(mesh: Mesh, bands: Sequence[Feature], thickness: float, finest: int) -> Iterator[Column]:
    """The strips from left to right, none wider than a `finest` part of the plate."""
    cell = tuple((float(lines[0]), float(lines[-1])) for lines in (mesh.x_lines, mesh.y_lines))
    (left, right), (low, high) = cell
    grid = Region((), (), 0.0, (mesh.x_lines[1:-1].tolist(), mesh.y_lines[1:-1].tolist()))
    parts = [*regions(cell, bands), grid]
    for strip in sorted(strips(cell, parts), key=lambda strip: strip.x):
        if strip.x[1] - strip.x[0] > THIN * (right - left):
            count = max(int(np.ceil((strip.x[1] - strip.x[0]) / (right - left) * finest - 1e-9)), 1)
            for x in pairwise(np.linspace(*strip.x, count + 1)):
                own = Strip(x, PLAIN, strip.arcs, strip.below)
                yield _column(cell, bands, parts, own, thickness, (high - low) / finest)


def _column(cell, bands, parts: Sequence[Region], strip: Strip, thickness: float, longest: float) -> Column:
    start, end = strip.x
    hair = INWARD * (end - start)
    x = np.array([start + hair, end - hair, (start + end) / 2])
    y, inside = rows(cell, parts, strip, x)
    count = np.maximum(np.ceil((y[1:, 2] - y[:-1, 2]) / longest - 1e-9), 1).astype(int)
    part = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(part)) - np.repeat(np.cumsum(count) - count, count)) / count[part]
    y = np.concatenate([y[part, :2] + share[:, None] * (y[part + 1, :2] - y[part, :2]), y[-1:, :2]])
    covers = inside[: len(bands), part, 2, None, None]
    at = np.broadcast_to(x[:2, None], (len(y) - 1, 2, 2)), np.stack([y[:-1], y[1:]], axis=2)
    z = faces(bands, thickness, covers, [depth_at(band, *at) for band in bands])
    return Column(strip.x, y, np.array([np.broadcast_to(part, at[0].shape) for part in z]))


def _quads(x, y, z) -> np.ndarray:
    """Corners (n, 4, 3) from coordinates that are broadcast to (n, 4)."""
    return np.stack(np.broadcast_arrays(*map(np.asarray, (x, y, z))), axis=-1).reshape(-1, 4, 3)


def _flat(column: Column, face: int, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Triangles of one face in a column, which meet those of its neighbours at the ordinates of its two sides."""
    found = []
    for k in range(len(column.y) - 1):
        chains = [_chain(column, face, k, side, y) for side, y in enumerate((left, right))]
        i, ends = [0, 0], [len(chain) - 1 for chain in chains]
        while i != ends:
            step = 0 if i[1] == ends[1] or (i[0] < ends[0] and i[0] * ends[1] <= i[1] * ends[0]) else 1
            third = chains[step][i[step] + 1]
            corners = [chains[0][i[0]], chains[1][i[1]], third]
            found.append(corners if face == 1 else corners[::-1])
            i[step] += 1
    return np.array(found).reshape(-1, 3, 3)


def _chain(column: Column, face: int, k: int, side: int, y: np.ndarray) -> list[tuple[float, float, float]]:
    """Points along one side of a part of a column, from below."""
    (low, high), (z0, z1) = column.y[k : k + 2, side], column.z[face, k, side]
    own = y[(y >= low) & (y <= high)]
    slope = (z1 - z0) / (high - low) if high > low else 0.0
    return [(column.x[side], float(at), float(z0 + slope * (at - low))) for at in own]


def _inner(column: Column, face: int, thickness: float) -> np.ndarray:
    """Walls along the curves inside a column."""
    (l, r), y, z = column.x, column.y[1:-1], column.z[face]
    below, above = z[:-1, :, 1], z[1:, :, 0]
    apart = np.abs(below - above).max(axis=1) > SAME * thickness
    y, below, above = y[apart], below[apart], above[apart]
    return _quads(
        [[l, r, r, l]],
        np.stack([y[:, 0], y[:, 1], y[:, 1], y[:, 0]], axis=1),
        np.stack([below[:, 0], below[:, 1], above[:, 1], above[:, 0]], axis=1),
    )


def _between(left: Column, right: Column, y: np.ndarray, face: int, thickness: float) -> np.ndarray:
    """Walls where two columns meet."""
    middle = (y[1:] + y[:-1]) / 2
    one, other = (_heights(c.y[:, k], c.z[face, :, k], middle, y) for c, k in ((left, 1), (right, 0)))
    apart = np.abs(one - other).max(axis=1) > SAME * thickness
    ends = np.stack([y[:-1], y[1:], y[1:], y[:-1]], axis=1)[apart]
    z = np.stack([one[:, 0], one[:, 1], other[:, 1], other[:, 0]], axis=1)[apart]
    return _quads([[left.x[1]]], ends, z)


def _heights(own: np.ndarray, z: np.ndarray, middle: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights (n, 2) at the ends of the parts of a side between the places y, from those of its own parts."""
    k = np.clip(np.searchsorted(own, middle, side="right") - 1, 0, len(own) - 2)
    size = np.where(own[k + 1] > own[k], own[k + 1] - own[k], 1.0)
    return np.stack([z[k, 0] + (z[k, 1] - z[k, 0]) * (at - own[k]) / size for at in (y[:-1], y[1:])], axis=1)


def _rim(column: Column, side: int) -> np.ndarray:
    """The plate's edge at the left (0) or right (1) side of a column."""
    y, z = column.y[:, side], column.z[:, :, side]
    ends = np.stack([y[:-1], y[1:], y[1:], y[:-1]], axis=1)
    return _quads([[column.x[side]]], ends, np.stack([z[0, :, 0], z[0, :, 1], z[1, :, 1], z[1, :, 0]], axis=1))


def _end(column: Column, row: int) -> np.ndarray:
    """The plate's edge at the lower (0) or upper (-1) end of a column."""
    (l, r), z = column.x, column.z[:, row, :, row]
    return _quads([[l, r, r, l]], [[column.y[row, 0]]], [[z[0, 0], z[0, 1], z[1, 1], z[1, 0]]])


def _element_lines(mesh: Mesh, columns: Sequence[Column]) -> np.ndarray:
    """Sides of quadrilaterals on element lines (m, 2, 3), on both faces."""
    found = []
    for column in columns:
        for face in (0, 1):
            (l, r), y, z = column.x, column.y, column.z[face]
            for row, part, end in ((y[:-1], z, 0), (y[1:], z, 1)):
                on = _on(mesh.y_lines, row).all(axis=1)
                found.append(_segments((l, r), row[on], part[on][:, :, end]))
            for side, x in enumerate((l, r)):
                if _on(mesh.x_lines, np.array(x)):
                    found.append(_segments((x, x), np.stack([y[:-1, side], y[1:, side]], axis=1), z[:, side]))
    return np.concatenate(found)


def _on(lines: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Whether values lie on one of the lines."""
    return np.abs(values[..., None] - lines).min(axis=-1) <= MEETING * np.ptp(lines)


def _segments(x, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.stack([np.broadcast_to(x, y.shape), y, z], axis=2)
