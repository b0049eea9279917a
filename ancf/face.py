"""Points on the plate's true face, where it may touch something, and what forces there do to the unknowns.

The points are those of the elements' own rules in (x, y), subdomain by subdomain, at the height of the face there:
below a groove that of its floor, so that a floor touches only what reaches it. Upright walls have none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from ancf.assembly import Assembly, MixedAssembly
from ancf.feature import covers, depth_at, depth_slopes
from ancf.functional import interpolation
from ancf.mesh import Cell, Mesh
from ancf.quadrature import gauss, onto_cell, tensor
from ancf.subdomain import BOTTOM, GROOVE, PROTRUSION, Feature, face_rule, signature, thickness_range

SHIFT = 1e-6  # of the thickness: difference that the slope of a floor is taken from


class Some(NamedTuple):
    """Some points (m,) of a face, and the rows (m, v) that place them."""

    points: np.ndarray
    rows: sp.csr_matrix
    rows_t: sp.csr_matrix

    def positions(self, q: np.ndarray) -> np.ndarray:
        """As those of `Face` (m, 3)."""
        return self.rows @ q.reshape(-1, 3)

    def spread(self, force: np.ndarray) -> np.ndarray:
        """Generalised forces (3 v,) of forces (m, 3)."""
        return (self.rows_t @ force).ravel()


@dataclass(frozen=True, eq=False)
class Face:
    """n points on one face of the plate.

    points (n, 3): reference coordinates. share (n,): area of the undeformed face (m2) that each stands for.
    rows (n, v): their positions are rows @ vectors. Elements have unequally many points q and functions i; the
    arrays number (e, q) and S (e, q, i) are filled up with the point n and zeros. places (e, i, i, 3, 3): where the
    entry of functions i, k and components a, b goes in the values (nnz,) of a lower triangle, nnz where nowhere.
    element (n,): of each point. vectors (e, i): of each function, 0 where it is filled up.
    """

    points: np.ndarray
    share: np.ndarray
    rows: sp.csr_matrix
    element: np.ndarray
    number: np.ndarray
    S: np.ndarray
    vectors: np.ndarray
    places: np.ndarray
    nnz: int

    def positions(self, q: np.ndarray) -> np.ndarray:
        """Positions (n, 3) in m of components (3 v,), or velocities of velocities."""
        return self.rows @ q.reshape(-1, 3)

    @cached_property
    def _most(self) -> np.ndarray:
        """Greatest |S| (e, i) among the points of each element."""
        return np.abs(self.S).max(axis=1, initial=0.0)

    def farthest(self, change: np.ndarray) -> float:
        """A distance that no point moves beyond while the components change by `change` (3 v,)."""
        lengths = np.linalg.norm(change.reshape(-1, 3), axis=1)
        return float(np.einsum("ei,ei->e", self._most, lengths[self.vectors]).max(initial=0.0))

    def some(self, points: np.ndarray) -> Some:
        """The points of these numbers alone."""
        rows = self.rows[points]
        return Some(points, rows, rows.T.tocsr())

    def matrix(self, near: np.ndarray, blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (nnz,) of sum_q S_i S_k B_ab of blocks B (m, 3, 3) at the points near (m,), and of its transpose."""
        every = np.zeros((len(self.points) + 1, 3, 3))
        every[near] = blocks
        e = np.unique(self.element[near])
        S, B = self.S[e], every[self.number[e]]
        weighted = (S[..., None] * B.reshape(*B.shape[:2], 1, 9)).reshape(*B.shape[:2], -1)
        i = S.shape[2]
        K = (S.swapaxes(1, 2) @ weighted).reshape(len(e), i, i, 3, 3)
        slots = self.places[e].ravel()
        both = (K, K.transpose(0, 2, 1, 4, 3))
        lower, upper = (np.bincount(slots, part.ravel(), self.nnz + 1)[:-1] for part in both)
        return lower, upper


def face(
    mesh: Mesh,
    bands: Sequence[Feature],
    thickness: float,
    counts: tuple[int, int],
    side: int,
    sums: Assembly | MixedAssembly,
    integration: str = "subdomain",
) -> Face:
    """The face on a side, BOTTOM or TOP, with `counts` points along x and y in each subdomain."""
    seen: dict[tuple, _Profile] = {}
    found = []
    for cell in mesh.cells:
        key = signature(cell, bands)
        if key not in seen:
            seen[key] = _profile(cell, bands, thickness, counts, side, integration)
        found.append(seen[key])
    corners = [np.array([x0, y0, 0.0]) for (x0, _), (y0, _) in mesh.cells]
    points = [corner + own.points for corner, own in zip(corners, found, strict=True)]
    share = np.concatenate([_share(mesh, e, own) for e, own in enumerate(found)])
    element, points = np.repeat(np.arange(len(found)), [len(own) for own in points]), np.concatenate(points)
    rows = interpolation(mesh, element, points)
    vectors = [mesh.element(e).vectors for e in range(len(found))]
    number, S, numbers = _padded(rows, element, vectors)
    places = np.stack([_places(own, S.shape[2], sums) for own in vectors])
    nnz = len(sums.pattern.indices)
    return Face(points, share, rows, element, number, S, numbers, places, nnz)


class _Profile(NamedTuple):
    """What elements share that see the same of the bands: points (q, 3) from the element's corner, their weights dx dy
    (q,), and the slopes (2, q) of the face's height along x and y."""

    points: np.ndarray
    weights: np.ndarray
    slopes: np.ndarray


def _profile(cell: Cell, bands: Sequence[Feature], thickness: float, counts, side: int, integration: str) -> _Profile:
    """The rule over a cell, by subdomain or on one grid, on the face there."""
    if integration != "global":
        plane, z = face_rule(cell, bands, thickness, counts, side)
    else:
        plane = onto_cell(tensor(*map(gauss, counts)), cell)
        z = thickness_range(bands, thickness, *plane.points.T)[side != BOTTOM]
    (x0, _), (y0, _) = cell
    points = np.column_stack([plane.points - (x0, y0), z])
    return _Profile(points, plane.weights, _slopes(bands, thickness, *plane.points.T, side))


def _share(mesh: Mesh, e: int, profile: _Profile) -> np.ndarray:
    """Area (q,) of an element's undeformed face that each point stands for."""
    (x0, x1), (y0, y1) = mesh.cells[e]
    shape, vectors = mesh.element(e)
    S_p = shape.evaluate(profile.points, (x1 - x0, y1 - y0))[1]
    J = np.einsum("ic,qip->qpc", mesh.vectors[vectors], S_p)
    along_x, along_y = (J[:, axis] + profile.slopes[axis][:, None] * J[:, 2] for axis in (0, 1))
    return profile.weights * np.linalg.norm(np.cross(along_x, along_y), axis=1)


def _slopes(bands: Sequence[Feature], thickness: float, x: np.ndarray, y: np.ndarray, side: int) -> np.ndarray:
    """Slopes (2, q) of the face's height along x and y: at each point those of the depth of what the face is there, the
    deepest groove, or without one the highest protrusion. Walls beside it have no part in them."""
    slopes = np.zeros((2, len(x)))
    for sign in (PROTRUSION, GROOVE):
        greatest = np.zeros(len(x))
        for band in (band for band in bands if (band.face, band.sign) == (side, sign)):
            depth = np.where(covers(band, x, y), depth_at(band, x, y), 0.0)
            own = depth > greatest
            greatest[own] = depth[own]
            slopes[:, own] = side * sign * depth_slopes(band, x[own], y[own], SHIFT * thickness)
    return slopes


def _padded(rows: sp.csr_matrix, element: np.ndarray, vectors: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    """number (e, q), S (e, q, i) and vectors (e, i) of `Face`."""
    counts = np.bincount(element, minlength=len(vectors))
    most = max(len(own) for own in vectors)
    number = np.full((len(vectors), counts.max()), len(element))
    S, numbers = np.zeros((*number.shape, most)), np.zeros((len(vectors), most), dtype=np.intp)
    for e, (own, stop) in enumerate(zip(vectors, counts.cumsum(), strict=True)):
        first = stop - counts[e]
        number[e, : counts[e]] = np.arange(first, stop)
        S[e, : counts[e], : len(own)] = rows[first:stop].toarray()[:, own]
        numbers[e, : len(own)] = own
    return number, S, numbers


def _places(vectors: np.ndarray, most: int, sums: Assembly | MixedAssembly) -> np.ndarray:
    """places (i, i, 3, 3) of one element's functions, filled up to `most`."""
    nnz, n, i = len(sums.pattern.indices), sums.pattern.n, len(vectors)
    unknown = sums.unknown_of.reshape(-1, 3)[vectors].astype(np.int64)
    row, column = np.broadcast_arrays(unknown[:, None, :, None], unknown[None, :, None, :])
    found = np.full((most, most, 3, 3), nnz, dtype=np.int32)
    kept = (column >= 0) & (row >= column)
    own = np.full(row.shape, nnz, dtype=np.int32)
    own[kept] = np.searchsorted(sums.pattern.keys, column[kept] * n + row[kept])
    found[:i, :i] = own
    return found
