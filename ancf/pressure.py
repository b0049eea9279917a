"""Pressure that follows the face it presses on, as a gas does.

On the face z = const of an element, r_x and r_y the derivatives of its position, face = -1 (bottom) or 1 (top),

    f_i = -face p integral S_i (r_x x r_y) dx dy,
    df_i / dQ_k = [w_ik x],    w_ik = -face p integral S_i (S_k,y r_x - S_k,x r_y) dx dy,

[w x] the matrix of the product with w. Only the part symmetric in (i, k), of (w_ik - w_ki) / 2, enters the tangent.
The rest is an integral along the rim of the face (Schweizerhof and Ramm 1984): between elements it cancels, on edges
that are held or closed to a ring it moves nothing, and there the load has the potential -p times the volume behind the
face. On a free edge Newton's method converges with a constant rate instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ancf.loads import factor_at
from ancf.mesh import Mesh
from ancf.packing import SPAN, pairs
from ancf.quadrature import gauss, join, onto_cell, tensor

POINTS = 5  # each way: degree 9, which a flat face of cubics needs
DIGITS = 11


class Face(NamedTuple):
    """Shape functions of a cell size on the face: S, S_x, S_y (q, i), with the weights (q,) in dx dy.

    by_x, by_y (c, q): (S_i S_k,x - S_k S_i,x) / 2 dx dy of the pairs i < k, and so by y.
    """

    S: np.ndarray
    S_x: np.ndarray
    S_y: np.ndarray
    weights: np.ndarray
    by_x: np.ndarray
    by_y: np.ndarray


@dataclass(frozen=True, eq=False)
class FollowerPressure:
    """Pressure (Pa, positive into the body) times its history (t, factor) on one face of all elements of a mesh.

    connectivity (e, i); faces (g,), face_of (e,): the Face of each element.
    """

    face: int
    pressure: float
    history: tuple[tuple[float, float], ...]
    connectivity: np.ndarray
    faces: tuple[Face, ...]
    face_of: np.ndarray

    def factor(self, t: float) -> float:
        """As that of `loads.Load`."""
        return factor_at(self.history, t)

    def force(self, q: np.ndarray, t: float) -> np.ndarray:
        """Generalised force (3 v,) at the components q (3 v,)."""
        Q, total = q.reshape(-1, 3)[self.connectivity], np.zeros((len(q) // 3, 3))
        size = -self.face * self.pressure * self.factor(t)
        for own, face in self._groups():
            normal = np.cross(face.S_x @ Q[own], face.S_y @ Q[own]) * (size * face.weights)[:, None]
            np.add.at(total, self.connectivity[own], face.S.T @ normal)
        return total.ravel()

    def stiffness(self, q: np.ndarray, t: float) -> Iterator[np.ndarray]:
        """Yield minus the symmetric part of the force's derivative, packed (`ancf.packing`), span by span."""
        Q = q.reshape(-1, 3)[self.connectivity]
        e, n = self.connectivity.shape
        pair, w = pairs(n), np.empty((e, pairs(n).crossed, 3))
        size = self.face * self.pressure * self.factor(t)
        for own, face in self._groups():
            w[own] = size * (face.by_y @ (face.S_x @ Q[own]) - face.by_x @ (face.S_y @ Q[own]))
        for start in range(0, e, SPAN):
            part = w[start : start + SPAN]
            upper = np.zeros((len(part), 6, len(pair.first)))
            for k, (component, sign) in enumerate(((2, -1), (1, 1), (0, -1)), start=3):
                upper[:, k, : pair.crossed] = sign * part[..., component]
            yield np.concatenate([upper.ravel(), -upper[:, 3:, : pair.crossed].ravel()])

    def _groups(self) -> Iterator[tuple[np.ndarray, Face]]:
        """The elements (n,) of each face."""
        return ((np.flatnonzero(self.face_of == g), face) for g, face in enumerate(self.faces))


def follower_pressure(
    mesh: Mesh, thickness: float, face: int, pressure: float, history: Sequence[tuple[float, float]]
) -> FollowerPressure:
    """The pressure on the face z = face thickness / 2, on which no element has layer functions.

    Elements that have fewer functions than others are filled up: their first vector, times zero.
    """
    elements = [mesh.element(e) for e in range(len(mesh.cells))]
    most = max(len(vectors) for _, vectors in elements)
    connectivity = np.stack([np.append(v, np.full(most - len(v), v[0])) for _, v in elements])
    sizes = np.array([[x1 - x0, y1 - y0] for (x0, x1), (y0, y1) in mesh.cells])
    rounded = np.round(sizes / sizes.max(), DIGITS)
    number: dict = {}
    keys = [(*row, shape) for row, (shape, _) in zip(rounded.tolist(), elements, strict=True)]
    face_of = np.array([number.setdefault(key, len(number)) for key in keys])
    first = np.unique(face_of, return_index=True)[1]
    faces = tuple(_face(mesh, e, face * thickness / 2, most) for e in first)
    return FollowerPressure(face, pressure, tuple(history), connectivity, faces, face_of)


def _face(mesh: Mesh, e: int, z: float, most: int) -> Face:
    (x0, x1), (y0, y1) = mesh.cells[e]
    rule = join(*(onto_cell(tensor(gauss(POINTS), gauss(POINTS)), part) for part in mesh.parts(e)))
    points = np.column_stack([rule.points - (x0, y0), np.full(len(rule.weights), z)])
    S, S_p = mesh.element(e).shape.evaluate(points, (x1 - x0, y1 - y0))
    fill = ((0, 0), (0, most - S.shape[1]))
    S, S_x, S_y = (np.pad(values, fill) for values in (S, S_p[..., 0], S_p[..., 1]))
    weights, pair = rule.weights, pairs(most)
    i, k = pair.first[: pair.crossed], pair.second[: pair.crossed]
    by = [(weights[:, None] * (S[:, i] * d[:, k] - S[:, k] * d[:, i]) / 2).T for d in (S_x, S_y)]
    return Face(S, S_x, S_y, weights, *by)
