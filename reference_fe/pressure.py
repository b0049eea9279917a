"""Pressure that follows the face it presses on.

On a face of quadratic triangles, x_s and x_t the derivatives of the deformed position by a triangle's coordinates,

    f_a = -p ∫ N_a (x_s x x_t) ds dt,    df_a / dx_b = [w_ab x],    w_ab = -p ∫ N_a (N_b,t x_s - N_b,s x_t) ds dt,

with the normal outward. The tangent has the part of w that is antisymmetric in a and b, which makes it symmetric; the
rest lives on the rim of the face (Bonet, Wood, Nonlinear Continuum Mechanics for FEA, section 8.5.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skfem import ElementTriP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from reference_fe.mesh import Solid

DEGREE = 4  # of N_a times two slopes
EDGES = ((0, 1), (1, 2), (0, 2))  # of ElementTriP2
SIGNS = ((0, 1, 2, -1.0), (0, 2, 1, 1.0), (1, 2, 0, -1.0))  # of [w x]: row, column, component


@dataclass(frozen=True)
class FollowerPressure:
    """Pressure (Pa, positive into the body) times a piecewise linear history (k, 2) of (time, factor).

    nodes (m, 6) of the triangles; outward (m,): 1 where x_s x x_t points outward, else -1. points (n, 3): reference
    positions of all nodes. shape, by_s, by_t (6, q) and weight (q,): the functions and their derivatives.
    """

    pressure: float
    history: np.ndarray
    nodes: np.ndarray
    outward: np.ndarray
    points: np.ndarray
    shape: np.ndarray
    by_s: np.ndarray
    by_t: np.ndarray
    weight: np.ndarray

    def force(self, u: np.ndarray, time: float) -> np.ndarray:
        """Nodal forces (n, 3) in N at the displacement u (n, 3)."""
        x_s, x_t = self._tangents(u)
        normal = np.cross(x_s, x_t) * self.weight[:, None] * self._size(time)
        force = np.zeros_like(u)
        np.add.at(force, self.nodes, self.shape @ normal)
        return force

    def subtract_stiffness(self, where, u: np.ndarray, time: float, factor: float, values: np.ndarray) -> None:
        """Take factor x the symmetric part of the force's derivative off upper-triangle values on a pattern."""
        x_s, x_t = self._tangents(u)
        a, b = np.triu_indices(6, 1)
        by_s, by_t = (self.weight * (self.shape[a] * d[b] - self.shape[b] * d[a]) / 2 for d in (self.by_s, self.by_t))
        w = factor * self._size(time) * (by_t @ x_s - by_s @ x_t)
        first, second = where.number[self.nodes[:, a]], where.number[self.nodes[:, b]]
        moving = (first >= 0) & (second >= 0)
        w = np.where(first < second, 1.0, -1.0)[moving][:, None] * w[moving]
        row, column = np.minimum(first, second)[moving], np.maximum(first, second)[moving]
        count = where.free.size
        keys = np.repeat(np.arange(count), np.diff(where.start)) * count + where.column
        k = np.searchsorted(keys, row * count + column) - where.start[row]
        for i, j, component, sign in SIGNS:
            np.subtract.at(values, where.indptr[3 * row + i] + 3 * k + j - i, sign * w[:, component])
            np.add.at(values, where.indptr[3 * row + j] + 3 * k + i - j, sign * w[:, component])

    def _tangents(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x_s and x_t (m, q, 3)."""
        x = (self.points + u)[self.nodes]
        return self.by_s.T @ x, self.by_t.T @ x

    def _size(self, time: float) -> np.ndarray:
        """-p with the sign of x_s x x_t (m, 1, 1)."""
        factor = np.interp(time, self.history[:, 0], self.history[:, 1])
        return -self.pressure * factor * self.outward[:, None, None]


def follower_pressure(solid: Solid, side: int, height: float, pressure: float, history) -> FollowerPressure:
    """A pressure (Pa) on the face z = side x height of the box, side = -1 or 1."""
    mesh, element = solid.mesh, ElementTriP2()
    facets = mesh.boundary_facets()
    corners = mesh.facets[:, facets]
    on = (np.abs(solid.places[2][corners] - side * height) < 1e-7 * solid.extent).all(axis=0)
    corners, behind = corners[:, on], mesh.t[:, mesh.f2t[0, facets[on]]]
    edges = np.sort(mesh.edges, axis=0)
    keys = edges[0].astype(np.int64) * mesh.nvertices + edges[1]
    order = np.argsort(keys)
    middles = []
    for i, j in EDGES:
        low, high = np.minimum(corners[i], corners[j]), np.maximum(corners[i], corners[j])
        place = np.searchsorted(keys[order], low.astype(np.int64) * mesh.nvertices + high)
        middles.append(mesh.nvertices + order[place])
    nodes = np.vstack([corners, middles]).T
    where, weight = get_quadrature(RefTri, DEGREE)
    values = [element.lbasis(where, a) for a in range(6)]
    shape = np.array([value for value, _ in values])
    by_s, by_t = (np.array([np.broadcast_to(slope[c], weight.shape) for _, slope in values]) for c in (0, 1))
    x = mesh.doflocs[:, corners]
    out = x.mean(axis=1) - mesh.doflocs[:, behind].mean(axis=1)
    outward = np.sign(np.einsum("cm,cm->m", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], axis=0), out))
    return FollowerPressure(pressure, np.array(history), nodes, outward, mesh.doflocs.T, shape, by_s, by_t, weight)
