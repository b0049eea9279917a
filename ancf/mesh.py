"""Structured mesh of plate elements on a rectangle, a NURBS surface or a revolved one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ancf.nurbs import GeometryError, Revolved, Surface, crease, surface_derivatives, unit_normal
from ancf.shape import CONFORMING, CORNERS, EDGES, Plate

Cell = tuple[tuple[float, float], tuple[float, float]]
HAIR = 1e-9  # of the plate's side


class Special(NamedTuple):
    """An element with functions of its own after those of the mesh's shape, and the nodal vectors (i,) of all."""

    shape: Plate
    vectors: np.ndarray


@dataclass(frozen=True, eq=False)
class Mesh:
    """Elements between grid lines, and their undeformed shape.

    x_lines, y_lines: grid lines in mid-surface parameters. vectors (v, 3): nodal vectors of the
    reference shape. connectivity (e, i): nodal vector that each shape function multiplies.
    kinds (v,): what each vector is, "r", "r_x" ... parameters (v, 2): where its node lies, or the
    middle of its edge. corners (e, 2): the lines at which an element begins. special: the elements that have
    more functions than `shape`; connectivity holds their first ones. closed: the last line along x is the
    first one again, and has no vectors of its own. Vectors are numbered along the direction with fewer
    elements first, those of edges beside their nodes: the band stays narrow.
    """

    shape: Plate
    x_lines: np.ndarray
    y_lines: np.ndarray
    vectors: np.ndarray
    connectivity: np.ndarray
    kinds: np.ndarray
    parameters: np.ndarray
    corners: np.ndarray
    special: dict[int, Special] = field(default_factory=dict)
    closed: bool = False

    def element(self, e: int) -> Special:
        """Shape of an element and its nodal vectors (i,)."""
        return self.special.get(e) or Special(self.shape, self.connectivity[e])

    def levels(self, e: int) -> list[float]:
        """Levels of z at which the functions of an element have a kink."""
        return self.special[e].shape.levels if e in self.special else []

    def parts(self, e: int) -> list[Cell]:
        """The parts of an element's cell inside which its functions have no kink along x or y."""
        cell = self.cells[e]
        if e not in self.special:
            return [cell]
        kinks = (self.special[e].shape.lines(axis) for axis in (0, 1))
        x, y = (
            [low, *(low + at for at in lines if HAIR < at / (high - low) < 1 - HAIR), high]
            for (low, high), lines in zip(cell, kinks, strict=True)
        )
        return [(along, across) for along in pairwise(x) for across in pairwise(y)]

    def extended(
        self, after: np.ndarray, kinds: Sequence[Sequence[str]], parameters: np.ndarray
    ) -> tuple[Mesh, list[np.ndarray]]:
        """The mesh with further nodal vectors, zero in the reference shape, and their numbers.

        Behind each of the vectors `after` (n,) those of its `kinds`, at parameters (n, 2).
        """
        base, counts = len(self.vectors), [len(own) for own in kinds]
        more = sum(counts)
        order = np.argsort(np.concatenate([np.arange(base), np.repeat(after, counts) + 0.5]), kind="stable")
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        names = np.array([kind for own in kinds for kind in own], dtype=self.kinds.dtype)
        wider = replace(
            self,
            vectors=np.concatenate([self.vectors, np.zeros((more, 3))])[order],
            connectivity=number[self.connectivity],
            kinds=np.concatenate([self.kinds, names])[order],
            parameters=np.concatenate([self.parameters, np.repeat(parameters, counts, axis=0)])[order],
        )
        return wider, np.split(number[base:], np.cumsum(counts)[:-1])

    @cached_property
    def cells(self) -> list[Cell]:
        """Parameter ranges of the elements."""
        return [
            ((float(self.x_lines[i]), float(self.x_lines[i + 1])), (float(self.y_lines[j]), float(self.y_lines[j + 1])))
            for i, j in self.corners
        ]

    @property
    def element_vectors(self) -> np.ndarray:
        """Reference nodal vectors by element (e, i, 3)."""
        return self.vectors[self.connectivity]

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """Lengths (e, 4) in m of the straight lines between the corners of each element."""
        corners = self.element_vectors[:, self.shape.positions]
        return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)

    def metres(self, axis: int) -> float:
        """Mean length (m) of a unit of the parameter along an axis."""
        sizes = np.diff((self.x_lines, self.y_lines)[axis])[self.corners[:, axis]]
        return float((self.edge_lengths[:, [1 - axis, 3 - axis]].mean(axis=1) / sizes).mean())

    def orientation(self, vectors: np.ndarray) -> np.ndarray:
        """det (r_x, r_y, r_z) at each node for nodal vectors (v, 3)."""
        r_x, r_y, r_z = vectors.take(self._frames, axis=0)
        (x, y, z), (X, Y, Z) = r_x.T, r_y.T
        n_x, n_y, n_z = y * Z - z * Y, z * X - x * Z, x * Y - y * X
        return n_x * r_z[:, 0] + n_y * r_z[:, 1] + n_z * r_z[:, 2]

    @cached_property
    def _frames(self) -> np.ndarray:
        """Numbers (3, n) of r_x, r_y, r_z at each node."""
        return np.stack([np.flatnonzero(self.kinds == kind) for kind in ("r_x", "r_y", "r_z")])

    def edges_of(self, element: int) -> tuple[str, ...]:
        """The edges x0, x1, y0, y1 of the plate that an element lies on."""
        (i, j), last = self.corners[element], (len(self.x_lines) - 2, len(self.y_lines) - 2)
        touched = {"x0": i == 0, "x1": i == last[0], "y0": j == 0, "y1": j == last[1]}
        if self.closed:
            del touched["x0"], touched["x1"]
        return tuple(edge for edge, touches in touched.items() if touches)

    def inward(self, x: float, y: float) -> tuple[float, float]:
        """The parameters (x, y), from an edge of the plate moved inside by a hair."""
        ends = ((lines[0], lines[-1]) for lines in (self.x_lines, self.y_lines))
        hairs = ((low, high, HAIR * (high - low)) for low, high in ends)
        return tuple(
            float(np.clip(v, low + hair, high - hair)) for v, (low, high, hair) in zip((x, y), hairs, strict=True)
        )

    def locate(self, x: float, y: float) -> int:
        """Element that contains the parameters (x, y). Raises ValueError outside the mesh."""
        column = _interval(self.x_lines, x, "x")
        row = _interval(self.y_lines, y, "y")
        return int(np.flatnonzero((self.corners == (column, row)).all(axis=1))[0])


def _interval(lines: np.ndarray, value: float, name: str) -> int:
    slack = 1e-12 * (lines[-1] - lines[0])
    if not lines[0] - slack <= value <= lines[-1] + slack:
        raise ValueError(f"{name} = {value} lies outside the plate [{lines[0]}, {lines[-1]}]")
    return int(np.clip(np.searchsorted(lines, value, side="right") - 1, 0, len(lines) - 2))


def grid(
    x_lines: np.ndarray,
    y_lines: np.ndarray,
    surface: Surface | Revolved | None = None,
    shape: Plate = CONFORMING,
    closed: bool = False,
) -> Mesh:
    """Mesh between the given lines; flat at Z = 0 with normal +Z, or on a surface; closed: its last line is the first.

    Nodal vectors on a surface are its point, its parameter derivatives and its unit normal; an edge has
    what the normal at its middle exceeds the mean of those at its ends by. Raises ValueError where the
    lines do not increase, GeometryError where the surface has a crease or is degenerate at a node or the middle
    of an edge.
    """
    lines = np.asarray(x_lines, dtype=float), np.asarray(y_lines, dtype=float)
    for name, values in zip("xy", lines, strict=True):
        if values.ndim != 1 or len(values) < 2 or not np.all(np.diff(values) > 0):
            raise ValueError(f"grid lines along {name} must increase and number at least two, got {values}")
    _require_smooth(surface)
    nx, ny = len(lines[0]), len(lines[1])
    places = _places(nx, ny, len(shape.node_kinds), len(shape.edge_kinds), closed)
    corners = np.stack([index.ravel() for index in np.indices((nx - 1, ny - 1))], axis=1)
    if ny > nx:
        corners = corners[np.lexsort((corners[:, 0], corners[:, 1]))]
    parts = [(places.node, shape.node_kinds, *_at_nodes(lines, shape, surface))]
    if shape.edges:
        parts += [(places.edge[axis], shape.edge_kinds, *_at_edges(lines, axis, surface)) for axis in (0, 1)]
    vectors, parameters = np.empty((places.count, 3)), np.empty((places.count, 2))
    kinds, distinct = np.empty(places.count, dtype="U4"), nx - closed  # lines along x
    for first, names, values, at in parts:
        own = first[:distinct, :, None] + np.arange(len(names))
        vectors[own], parameters[own], kinds[own] = values[:distinct], at[:distinct, :, None, :], names
    connectivity = places.connectivity(corners, shape)
    return Mesh(shape, *lines, vectors, connectivity, kinds, parameters, corners, closed=closed)


def _require_smooth(surface: Surface | Revolved | None) -> None:
    """Raise GeometryError where the tangent of a surface jumps: the nodal vectors r_x and r_y have one value."""
    for axis in (0, 1) if surface is not None else ():
        if (knot := crease(surface, axis)) is not None:
            name = "xy"[axis]
            raise GeometryError(f"the surface has a crease at {name} = {knot:g}: the gradient r_{name} jumps there")


class _Places(NamedTuple):
    """Number of the first vector of each node (nx, ny) and of the edges along x (nx - 1, ny) and y (nx, ny - 1)."""

    node: np.ndarray
    edge: tuple[np.ndarray, np.ndarray]
    count: int

    def connectivity(self, corners: np.ndarray, shape: Plate) -> np.ndarray:
        """Nodal vectors (e, i) of the elements that begin at the lines `corners` (e, 2)."""
        i, j = corners.T
        starts = [(self.node[i + c, j + d], len(shape.node_kinds)) for c, d in CORNERS]
        if shape.edges:
            starts += [(self.edge[axis][i + c, j + d], len(shape.edge_kinds)) for axis, (c, d) in EDGES]
        return np.concatenate([first[:, None] + np.arange(count) for first, count in starts], axis=1)


def _places(nx: int, ny: int, node_vectors: int, edge_vectors: int, closed: bool = False) -> _Places:
    """Number node by node, each followed by its edge along the shorter direction and then by its other one.

    On a closed ring the last of the nx lines has the numbers of the first one.
    """
    fast = 1 if ny <= nx else 0
    counts = np.empty((nx - closed, ny, 3), dtype=int)
    counts[...] = node_vectors, edge_vectors, edge_vectors
    for axis in (1,) if closed else (0, 1):
        last = (-1, slice(None)) if axis == 0 else (slice(None), -1)
        counts[(*last, 1 if axis == fast else 2)] = 0
    order = _folded(nx - 1) if closed and fast == 1 else np.arange(len(counts))
    ordered = counts[order] if fast == 1 else counts.swapaxes(0, 1)
    first = (ordered.cumsum() - ordered.ravel()).reshape(ordered.shape)
    first = first[np.argsort(order)] if fast == 1 else first.swapaxes(0, 1)
    if closed:
        first = np.concatenate([first, first[:1]])
    along_x, along_y = (first[..., 1 if axis == fast else 2] for axis in (0, 1))
    return _Places(first[..., 0], (along_x[:-1], along_y[:, :-1]), int(counts.sum()))


def _folded(n: int) -> np.ndarray:
    """Lines of a ring in an order that keeps neighbours near each other: 0, n - 1, 1, n - 2 ... (n,)."""
    lines = np.arange(n)
    return np.stack([lines, lines[::-1]], axis=1).ravel()[:n]


def _at_nodes(lines, shape: Plate, surface: Surface | Revolved | None) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (nx, ny, k, 3) of the nodes, in the order of their kinds, and parameters (nx, ny, 2)."""
    at = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    if surface is None:
        flat = np.zeros((*at.shape[:2], 3))
        flat[..., :2] = at
        unit = {
            kind: np.broadcast_to(row, flat.shape) for kind, row in zip(("r_x", "r_y", "r_z"), np.eye(3), strict=True)
        }
        found = {"r": flat, **unit, "r_xy": np.zeros_like(flat)}
    else:
        values = surface_derivatives(surface, at[..., 0], at[..., 1])
        found = {"r": values.s, "r_x": values.s_u, "r_y": values.s_v, "r_xy": values.s_uv}
        found["r_z"] = unit_normal(values).n
    return np.stack([found[kind] for kind in shape.node_kinds], axis=-2), at


def _at_edges(lines, axis: int, surface: Surface | Revolved | None) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (nx, ny, 1, 3) of the edges along an axis and the parameters (nx, ny, 2) of their middles."""
    middles = [(own[:-1] + own[1:]) / 2 if along == axis else own for along, own in enumerate(lines)]
    at = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
    if surface is None:
        return np.zeros((*at.shape[:2], 1, 3)), at
    ends = [
        [own[half] if along == axis else own for along, own in enumerate(lines)] for half in (np.s_[:-1], np.s_[1:])
    ]
    first, last = (_normals(np.stack(np.meshgrid(*end, indexing="ij"), axis=-1), surface) for end in ends)
    return (_normals(at, surface) - (first + last) / 2)[..., None, :], at


def _normals(at: np.ndarray, surface: Surface | Revolved) -> np.ndarray:
    """Unit normals (..., 3) of a surface at the parameters (..., 2)."""
    return unit_normal(surface_derivatives(surface, at[..., 0], at[..., 1])).n
