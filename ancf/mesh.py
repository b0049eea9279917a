"""Structured mesh of plate elements on a rectangle or on a NURBS surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ancf.nurbs import Surface, surface_derivatives, unit_normal
from ancf.shape import CONFORMING, CORNERS, Conforming

Cell = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Elements between grid lines, and their undeformed shape.

    x_lines, y_lines: grid lines in mid-surface parameters. vectors (v, 3): nodal vectors of the
    reference shape. connectivity (e, i): nodal vector that each shape function multiplies.
    kinds (v,): "r", "r_x", "r_y" or "r_z". parameters (v, 2): where the vector's node lies.
    Nodes are numbered along the direction with fewer elements first, which keeps the band narrow.
    """

    shape: Conforming
    x_lines: np.ndarray
    y_lines: np.ndarray
    vectors: np.ndarray
    connectivity: np.ndarray
    kinds: np.ndarray
    parameters: np.ndarray
    corners: np.ndarray

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

    def orientation(self, vectors: np.ndarray) -> np.ndarray:
        """det (r_x, r_y, r_z) at each node for nodal vectors (v, 3)."""
        r_x, r_y, r_z = (vectors[self.kinds == kind] for kind in ("r_x", "r_y", "r_z"))
        return np.einsum("na,na->n", np.cross(r_x, r_y), r_z)

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


def grid(x_lines: np.ndarray, y_lines: np.ndarray, surface: Surface | None = None) -> Mesh:
    """Mesh between the given lines; flat at Z = 0 with normal +Z, or on a NURBS surface.

    Nodal vectors on a surface are its point, its two parameter derivatives and its unit normal.
    Raises ValueError where the lines do not increase, GeometryError where the surface is degenerate at a node.
    """
    x_lines, y_lines = np.asarray(x_lines, dtype=float), np.asarray(y_lines, dtype=float)
    for name, lines in (("x", x_lines), ("y", y_lines)):
        if lines.ndim != 1 or len(lines) < 2 or not np.all(np.diff(lines) > 0):
            raise ValueError(f"grid lines along {name} must increase and number at least two, got {lines}")
    nx, ny = len(x_lines), len(y_lines)
    number = np.arange(nx * ny).reshape(nx, ny) if ny <= nx else np.arange(nx * ny).reshape(ny, nx).T
    i, j = (index.ravel() for index in np.indices((nx, ny)))
    order = np.argsort(number.ravel())
    at = np.stack([x_lines[i], y_lines[j]], axis=1)[order]
    corners = np.stack([index.ravel() for index in np.indices((nx - 1, ny - 1))], axis=1)
    if ny > nx:
        corners = corners[np.lexsort((corners[:, 0], corners[:, 1]))]
    nodes = np.stack([number[corners[:, 0] + c, corners[:, 1] + d] for c, d in CORNERS], axis=1)
    connectivity = (4 * nodes[:, :, None] + np.arange(4)).reshape(len(nodes), 16)
    vectors = _flat(at) if surface is None else _curved(at, surface)
    return Mesh(
        CONFORMING,
        x_lines,
        y_lines,
        vectors.reshape(-1, 3),
        connectivity,
        np.tile(["r", "r_x", "r_y", "r_z"], nx * ny),
        np.repeat(at, 4, axis=0),
        corners,
    )


def _flat(at: np.ndarray) -> np.ndarray:
    """Nodal vectors (n, 4, 3) of the rectangle."""
    vectors = np.zeros((len(at), 4, 3))
    vectors[:, 0, :2] = at
    vectors[:, 1:] = np.eye(3)
    return vectors


def _curved(at: np.ndarray, surface: Surface) -> np.ndarray:
    """Nodal vectors (n, 4, 3) of a NURBS surface."""
    values = surface_derivatives(surface, at[:, 0], at[:, 1])
    return np.stack([values.s, values.s_u, values.s_v, unit_normal(values).n], axis=1)
