"""Bodies: deformed surfaces of runs, packed so small that a page holds one per row of its tables.

Coordinates and displacements are whole numbers of 16 bits (a 65 000th of the body's size and of its largest
displacement), each stored as its difference from the one before, all of them deflated: some 4 bytes a point. Points
that coincide and move alike are one. For pictures only: no number of the page is read from them.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.result import Outline

LEVELS = 32000  # a coordinate is a whole number from -LEVELS to LEVELS


@dataclass(frozen=True)
class Body:
    """A packed surface. key: what a row's "run" names it by; group: bodies of one group may be laid over each other.

    label: its name for people. header: JSON of `pack`. data: base64 of the deflated arrays.
    """

    key: str
    group: str
    label: str
    solver: str
    header: str
    data: str

    @property
    def size(self) -> int:
        """Bytes that it takes on a page."""
        return len(self.data) + len(self.header)


def pack(
    outline: Outline, steps: Sequence[str], shapes: np.ndarray, fields: dict[str, np.ndarray] | None = None
) -> tuple[str, str]:
    """(header, data) of an outline with its displacements shapes (s, n, 3) at the named steps.

    fields: numbers (n,), not negative, to colour the last step by, under their name with its unit. header: counts,
    origin (m) and unit (m) of coordinates, unit (m) of displacements, "steps" and "greatest" (m), the largest
    displacement of each step, and of each field its "name", "unit" and "greatest". data: points (3, n), displacements
    (s, 3, n), fields (f, n), triangles (3, m), edges (2, k).
    """
    shapes = np.asarray(shapes, float)
    points, origin, unit = _quantised(np.asarray(outline.points, float))
    moved, _, moved_unit = _quantised(shapes, np.zeros(3))
    greatest = {name: float(np.max(values, initial=0.0)) for name, values in (fields or {}).items()}
    units = {name: high / LEVELS or 1.0 for name, high in greatest.items()}
    scalars = [np.rint(np.asarray(values) / units[name]).astype(int) for name, values in (fields or {}).items()]
    rows = np.concatenate([points, *moved, *(column[:, None] for column in scalars)], axis=1)
    distinct, place = np.unique(rows, axis=0, return_inverse=True)
    place = place.ravel()
    triangles, edges = place[np.asarray(outline.triangles)], _edges(place, outline.edges)
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    index = np.uint16 if len(distinct) < 2**16 else np.uint32
    arrays = [_differences(distinct.T.astype(np.int16)), *(_differences(a.T.astype(index)) for a in (triangles, edges))]
    header = {
        "points": len(distinct), "triangles": len(triangles), "edges": len(edges), "wide": index is np.uint32,
        "origin": origin.tolist(), "unit": unit, "moved": moved_unit, "steps": list(steps),
        "greatest": [float(np.linalg.norm(shape, axis=1).max(initial=0.0)) for shape in shapes],
        "fields": [{"name": name, "unit": units[name], "greatest": high} for name, high in greatest.items()],
    }  # fmt: skip
    data = zlib.compress(b"".join(array.tobytes() for array in arrays), 9)
    return json.dumps(header, allow_nan=False), base64.b64encode(data).decode("ascii")


def unpack(header: str, data: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """points (n, 3), displacements (s, n, 3) in m, triangles (m, 3) and edges (k, 2) of what `pack` made."""
    about, raw = json.loads(header), zlib.decompress(base64.b64decode(data))
    n, index = about["points"], np.uint32 if about["wide"] else np.uint16
    vectors, count = 3 * (1 + len(about["steps"])), n * (3 * (1 + len(about["steps"])) + len(about["fields"]))
    numbers = np.cumsum(np.frombuffer(raw, np.int16, count).reshape(-1, n), axis=1, dtype=np.int16).astype(float)
    fields = numbers[:vectors].reshape(-1, 3, n).swapaxes(1, 2)
    rest = np.frombuffer(raw, index, offset=2 * count)
    parts = np.split(rest, [3 * about["triangles"]])
    triangles, edges = (
        np.cumsum(part.reshape(k, -1), axis=1, dtype=index).T for part, k in zip(parts, (3, 2), strict=True)
    )
    return about["origin"] + about["unit"] * fields[0], about["moved"] * fields[1:], triangles, edges


def _quantised(values: np.ndarray, origin: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, float]:
    """Whole numbers, origin (3,) and unit of values (..., 3); about their middle where no origin is given."""
    flat = values.reshape(-1, 3)
    if origin is None:
        origin = (flat.min(axis=0) + flat.max(axis=0)) / 2
    unit = float(np.abs(flat - origin).max(initial=0.0)) / LEVELS or 1.0
    return np.rint((values - origin) / unit).astype(int), origin, unit


def _edges(place: np.ndarray, edges: Any) -> np.ndarray:
    """Distinct edges between distinct points."""
    edges = np.asarray(edges, int).reshape(-1, 2)
    found = np.unique(np.sort(place[edges], axis=1), axis=0) if len(edges) else edges
    return found[found[:, 0] != found[:, 1]]


def _differences(rows: np.ndarray) -> np.ndarray:
    """Each row (k, n) as its first number and the differences between neighbours, modulo the type's range."""
    return np.diff(rows, axis=1, prepend=rows.dtype.type(0))
