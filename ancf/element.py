"""Strain of an element and what follows from it: energy, internal force, tangent, mass.

The general continuum approach (paper section 3, Eq. 6): F = dr/dX = r_p J_o^-1 on flat and curved
reference shapes, E = (F^T F - 1)/2, and for any hyperelastic material

    U   = integral W(E) dV
    f   = dU/dQ     = P Q,          P_ij = integral G_ip S_pr G_jr dV
    K   = df_ia/dQ_kb = P_ik delta_ab + integral (F_ap G_ir) C_prst (F_bs G_kt) dV

with G_ip = dS_i/dX_p. Here every integral is summed over its points, for all elements at once.

Members of the family may add strains of their own that cost the quadratic form nothing: `ancf.enhanced`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from ancf.columns import Columns, columns
from ancf.enhanced import enhanced_strains, inverse_root
from ancf.material import SaintVenantKirchhoff
from ancf.nurbs import GeometryError
from ancf.packing import SPAN, packing
from ancf.quadrature import Rule
from ancf.shape import Plate

RUN_BYTES = 32_000_000
FIELDS = ("S", "G", "volume", "M", "g_z", "at")
ONE = np.ones(1)
Terms = Sequence[tuple[float, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Integrand:
    """All that integrals over one undeformed element need.

    G (q, i, p): derivatives of the shape functions by reference position (1/m for positions).
    S (q, i): shape functions. volume (q,): weight of each point in m3. M (q, p, r, k): enhanced strains.
    g_z (q, 3): gradient of z. at (q, 3): place of each point, s and t from -1 to 1 and z (m). columns: finds those of
    the points.
    """

    S: np.ndarray
    G: np.ndarray
    volume: np.ndarray
    M: np.ndarray
    g_z: np.ndarray
    at: np.ndarray
    columns: Callable[[], Columns] | None = None


def integrand(
    shape: Plate, rule: Rule, cell, vectors: np.ndarray, free: Sequence[str] = (), enhanced: bool = True
) -> Integrand:
    """Integrand of the element on `cell` whose reference nodal vectors are `vectors` (i, 3).

    free: the free edges of the plate that it lies on (for its enhanced strains). enhanced: whether it has any.

    J_o = dr_o/d(x, y, z). Raises GeometryError where det J_o is not positive: the reference shape folds.
    """
    (x0, x1), (y0, y1) = cell
    points, size = rule.points - (x0, y0, 0.0), (x1 - x0, y1 - y0)
    S, S_p = shape.evaluate(points, size)
    J = np.einsum("ic,qip->qcp", vectors, S_p)
    determinant = np.linalg.det(J)
    if not np.all(determinant > 0):
        raise GeometryError(f"the reference shape folds in the cell {cell}: det J_o = {determinant.min():.3g}")
    inverse, volume = np.linalg.inv(J), rule.weights * determinant
    M = enhanced_strains(shape, rule, cell, inverse, volume, free) if enhanced else np.zeros((len(volume), 3, 3, 0))
    at = np.column_stack([points[:, :2] * 2 / size - 1, points[:, 2]])
    of_columns = partial(columns, shape, points, size, inverse)
    return Integrand(S, S_p @ inverse, volume, M, inverse[:, 2], at, of_columns)


def signed(part: Integrand, signs: np.ndarray) -> Integrand:
    """The integrand of an element whose nodal vectors times signs (i,) are those of `part`; see `ancf.image`."""
    return replace(part, S=part.S * signs, G=part.G * signs[:, None], columns=None) if np.any(signs < 0) else part


def strain(Q: np.ndarray, G: np.ndarray, factors: np.ndarray = ONE) -> np.ndarray:
    """Green-Lagrange strain E (e, q, 3, 3) of nodal vectors Q (e, i, 3) with G (e or 1, q, i, 3).

    factors (a,): of each component's part in F^T F, where Q (e, i, a) has others beside the three of space.
    """
    F = _gradient(Q, G)
    return (F.swapaxes(-1, -2) @ (factors[:, None] * F) - np.eye(3)) / 2


def _gradient(Q: np.ndarray, G: np.ndarray) -> np.ndarray:
    """Deformation gradient F_ap (e, q, a, 3)."""
    return Q[:, None].swapaxes(-1, -2) @ G


def _beside(Q: np.ndarray, more: Terms) -> tuple[np.ndarray, np.ndarray]:
    """Factors (a,) and components (e, i, a) of Q and of the arrays beside it."""
    factors = np.repeat([1.0, *(c for c, _ in more)], 3)
    return factors, np.concatenate([Q, *(X for _, X in more)], axis=2)


def mass(parts: Integrand, density: float) -> np.ndarray:
    """Scalar mass matrix (i, i) in kg for position functions; the element's is this times the 3 x 3 identity."""
    return density * (parts.S.T * parts.volume) @ parts.S


class Run(NamedTuple):
    """What consecutive elements have by element: G (e, q, i, p), volume (e, q), M (e, 9 q, k) of their Integrand, and
    the inverse root (e, k, k) of their enhanced strains."""

    G: np.ndarray
    volume: np.ndarray
    M: np.ndarray
    root: np.ndarray


@dataclass(frozen=True, eq=False)
class PointElements:
    """Elements integrated point by point: any material, any reference shape; with enhanced strains one whose stress is
    linear in the strain.

    parts (e,): the Integrand of each element; elements may share one.
    """

    parts: tuple[Integrand, ...]
    material: SaintVenantKirchhoff

    def energy(self, Q: np.ndarray) -> float:
        """Strain energy (J) of all elements with nodal vectors Q (e, i, 3)."""
        runs = ((self._strain(q, run), run) for q, run in self._runs(Q))
        return float(sum(run.volume.ravel() @ self.material.energy(E).ravel() for E, run in runs))

    def force(self, Q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (e, i, 3) in N for positions and N m for gradients.

        more: pairs (c, X) of a number and an array (e, i, 3); the stress is then that of F^T F + c F_X^T F_X, where
        F_X = X^T G. The mean of F^T F at Q - X and Q + X is F^T F + F_X^T F_X.
        """
        factors, Q = _beside(Q, more)
        runs = ((q, run, self._strain(q, run, factors)) for q, run in self._runs(Q))
        return np.concatenate([self._stiffening(E, run) @ q[..., :3] for q, run, E in runs])

    def tangent(self, Q: np.ndarray, more: Terms = ()) -> Iterator[np.ndarray]:
        """Yield the packed tangents span by span; see `packing`. more: as in `force`."""
        rows, columns, second = packing(Q.shape[1])
        factors, Q = _beside(Q, more)
        for start in range(0, len(Q), SPAN):
            runs = self._runs(Q[start : start + SPAN], start)
            K = np.concatenate([self._tangent(q, run, factors) for q, run in runs])
            entries = K.reshape(len(K), 3 * Q.shape[1], -1)[:, rows, columns]
            yield np.concatenate([entries[:, :second].ravel(), entries[:, second:].ravel()])

    @cached_property
    def _roots(self) -> dict[Integrand, np.ndarray]:
        """The inverse root (k, k) of the enhanced strains of each distinct part."""
        C, found = self.material.tangent(np.zeros((3, 3))).reshape(9, 9), {}
        for part in set(self.parts):
            M = part.M.reshape(len(part.volume), 9, -1)
            CM = C @ M * part.volume[:, None, None]
            found[part] = inverse_root(*(array.reshape(9 * len(M), -1) for array in (M, CM)))
        return found

    def _runs(self, Q: np.ndarray, start: int = 0) -> Iterator[tuple[np.ndarray, Run]]:
        """Q of the elements from `start` on, and the Run of consecutive ones with as many points and strains, in small
        portions."""
        parts, first = self.parts[start : start + len(Q)], 0
        while first < len(Q):
            points = len(parts[first].volume)
            most = max(1, RUN_BYTES // (points * 9 * 3 * Q.shape[1] * 8 * 2))
            stop = first + 1
            while stop < min(len(Q), first + most) and parts[stop].M.shape == parts[first].M.shape:
                stop += 1
            own = parts[first:stop]
            G, volume, M = (np.stack([getattr(part, name) for part in own]) for name in ("G", "volume", "M"))
            root = np.stack([self._roots[part] for part in own])
            yield Q[first:stop], Run(G, volume, M.reshape(len(own), 9 * points, -1), root)
            first = stop

    def _strain(self, Q: np.ndarray, run: Run, factors: np.ndarray = ONE) -> np.ndarray:
        """E (e, q, 3, 3), the enhanced strain included."""
        E = strain(Q, run.G, factors)
        if not run.M.shape[-1]:
            return E
        S = self.material.stress(E) * run.volume[..., None, None]
        against = run.root @ (run.M.swapaxes(1, 2) @ S.reshape(len(S), -1, 1))
        return E - (run.M @ (run.root.swapaxes(1, 2) @ against)).reshape(E.shape)

    def _stiffening(self, E: np.ndarray, run: Run) -> np.ndarray:
        """P_ij (e, i, j) = integral G_ip S_pr G_jr dV of strains E (e, q, 3, 3)."""
        G = run.G
        S = self.material.stress(E) * run.volume[..., None, None]
        e, q, i, _ = G.shape
        GS = (G @ S).swapaxes(1, 2).reshape(e, i, 3 * q)
        return GS @ G.swapaxes(2, 3).reshape(e, 3 * q, i)

    def _tangent(self, Q: np.ndarray, run: Run, factors: np.ndarray) -> np.ndarray:
        """Tangents K (e, i, 3, k, 3) of elements with equally many points: E_q^T C E_q dV less B^T B, what the enhanced
        strains take, with B = R^-1 M^T C E_q dV."""
        (e, q, i, _), E = run.G.shape, self._strain(Q, run, factors)
        C = self.material.tangent(E) * run.volume[..., None, None, None, None]
        E_q = np.einsum("eqap,eqir->eqpria", _gradient(Q[..., :3], run.G), run.G, order="C").reshape(e, q, 9, 3 * i)
        CE = (C.reshape(e, q, 9, 9) @ E_q).reshape(e, 9 * q, 3 * i)
        K = E_q.reshape(e, 9 * q, 3 * i).swapaxes(1, 2) @ CE
        B = run.root @ (run.M.swapaxes(1, 2) @ CE)
        K = (K - B.swapaxes(1, 2) @ B).reshape(e, i, 3, i, 3)
        P = self._stiffening(E, run)
        for a in range(3):
            K[:, :, a, :, a] += P
        return K
