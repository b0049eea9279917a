"""Elements of Mooney-Rivlin material, integrated point by point.

With Q_a the a-th components of the nodal vectors of all elements that share an undeformed shape, F_ap = G_p^T Q_a is
one matrix product for all their points. The law is evaluated by compiled loops (`ancf.rubber`), and what comes out of
it goes back by matrix products too:

    f_ia = sum over q of G_ip T_ap,    T_ap = F_ar S_rp dV,
    K_ia,kb = sum over q of G_ip A_apbt G_kt,    A_apbt = (S_pt delta_ab + F_ar C_rpst F_bs) dV.

Forces take G in a frame of its own at each point, whose third direction n is the normal of the undeformed mid-surface:
the law is isotropic. Tangents take the parametric gradients, of which each function has one value in a whole column of
points (`ancf.columns`): A is summed over the points of a column first (`ancf.moduli`), and the products of gradients
are tabulated column by column (`ancf.column_products`).

An element that corrects the shear factor (`Plate.shear`) has the transverse shears of E times sqrt(5/6): a straight
director shears evenly, and then has the energy 5/6 of which faces without traction leave it (Reissner).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import legvander2d

from ancf import moduli, relaxation, rubber
from ancf.column_products import ColumnProducts
from ancf.columns import Columns, slots
from ancf.element import Integrand, Terms
from ancf.material import MooneyRivlin
from ancf.packing import SPAN, pairs

POINTS = 2048  # points that are computed together
SHEAR = float(np.sqrt(5 / 6))
SYMMETRIC = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  # places of C_pr in its six components


@dataclass(frozen=True, eq=False)
class Form:
    """One undeformed element: G (3, i, q) in the frame of each point, volume (q,) in m3, b (4, q) of `relaxation`.

    columns: the points' own, whose order all arrays have; R (9, q): gradients of the parameters in the frames; scale
    (q,): 1 / |g_z|^2. Without these a form has no tangent.
    """

    G: np.ndarray
    volume: np.ndarray
    b: np.ndarray
    columns: Columns | None = None
    R: np.ndarray | None = None
    scale: np.ndarray | None = None

    @cached_property
    def gradient(self) -> np.ndarray:
        """G (i, 3 q)."""
        return np.ascontiguousarray(self.G.swapaxes(0, 1)).reshape(self.G.shape[1], -1)

    @cached_property
    def b_b(self) -> np.ndarray:
        """b_k b_l (q, 16)."""
        return np.ascontiguousarray((self.b[:, None] * self.b).reshape(16, -1).T)

    @cached_property
    def products(self) -> ColumnProducts:
        """Those of its tangent."""
        return ColumnProducts(self.columns)

    @cached_property
    def N_b(self) -> list[np.ndarray]:
        """By factor in z, N_is b_k |g_z|^2 (s c, 4 i) of the functions that have it."""
        count, every = self.columns.count, self.products.functions
        b = np.pad((self.b / self.scale)[:, :count], ((0, 0), (0, self.products.count - count)))
        return [np.einsum("sci,kc->scki", N, b).reshape(-1, 4 * len(own)) for own, N in every]


def form(parts: Integrand) -> Form:
    """Form of an Integrand."""
    columns, frames = parts.columns(), _frames(parts.g_z)
    order = columns.order
    G = np.ascontiguousarray((parts.G @ frames)[order].transpose(2, 1, 0))
    scale = 1 / np.einsum("qp,qp->q", parts.g_z, parts.g_z)[order]
    b = np.ascontiguousarray(legvander2d(*parts.at[order, :2].T, [1, 1]).T * scale)
    R = np.ascontiguousarray((columns.inverse @ frames[order]).transpose(1, 2, 0)).reshape(9, -1)
    return Form(G, np.ascontiguousarray(parts.volume[order]), b, columns, R, scale)


def _frames(g_z: np.ndarray) -> np.ndarray:
    """Orthonormal columns (q, 3, 3) whose third is along g_z (q, 3)."""
    n = g_z / np.linalg.norm(g_z, axis=1)[:, None]
    least = np.eye(3)[np.abs(n).argmin(axis=1)]
    first = np.cross(least, n)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(n, first), n], axis=2)


@dataclass(frozen=True, eq=False)
class HyperelasticElements:
    """Elements of Mooney-Rivlin material; forms (g,), form_of (e,): the form of each element, in its order.

    relax: whether the thickness strain is free at each point (`ancf.relaxation`). shear: factor of E13 and E23.
    """

    material: MooneyRivlin
    forms: tuple[Form, ...]
    form_of: np.ndarray
    relax: bool
    shear: float = 1.0

    def energy(self, Q: np.ndarray) -> float:
        """Strain energy (J) of all elements with nodal vectors Q (e, i, 3)."""
        cauchy_green = ((own, self._strained(own, Q[e])[1]) for own, e in self._runs)
        return float(sum(rubber.energy(self._law, C, own.volume) for own, C in cauchy_green))

    def force(self, Q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (e, i, 3) in N for positions and N m for gradients. more: as in `PointElements.force`."""
        force = np.empty_like(Q)
        for own, e in self._runs:
            F, C = self._strained(own, Q[e], [(c, X[e]) for c, X in more])
            T = np.empty_like(F)
            rubber.stresses(self._law, self.shear, F, C, own.volume, T)
            f = T.reshape(3 * len(F), -1) @ own.gradient.T
            force[e] = f.reshape(len(F), 3, -1).swapaxes(1, 2)
        return force

    def tangent(self, Q: np.ndarray, more: Terms = ()) -> Iterator[np.ndarray]:
        """Yield the packed tangents span by span; see `packing`. more: as in `force`."""
        n = Q.shape[1]
        m, c = len(pairs(n).first), pairs(n).crossed
        for start in range(0, len(Q), SPAN):
            size = min(SPAN, len(Q) - start)
            packed = np.empty(size * (6 * m + 3 * c))
            upper, lower = packed[: size * 6 * m].reshape(size, 6, m), packed[size * 6 * m :].reshape(size, 3, c)
            for own, e in self._runs:
                if start <= e.start < start + SPAN:
                    F, C = self._strained(own, Q[e], [(c, X[e]) for c, X in more])
                    part = slice(e.start - start, e.stop - start)
                    self._tangent(own, F, C, upper[part], lower[part])
            yield packed

    def volume_ratios(self, Q: np.ndarray) -> np.ndarray:
        """J (q,) at the points of a single element with nodal vectors Q (i, 3)."""
        ((own, _),) = self._runs
        _, C = self._strained(own, Q[None])
        return np.sqrt(np.linalg.det(C[0][SYMMETRIC].transpose(2, 0, 1)))

    def _tangent(self, own: Form, F: np.ndarray, C: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> None:
        """Fill the packed tangents (e, 6, m) and (e, 3, c) of elements of one form."""
        columns, products = own.columns, own.products
        e, s, c = len(F), len(columns.zeta), products.count
        A = np.empty((e * products.rows.sum() * c // moduli.LANES, moduli.LANES))
        T, compliance = np.empty((e, 3, s, c)), np.empty((e, len(own.volume)))
        points = F, C, rubber.inverse_roots(C), own.volume, own.R, columns.zeta, columns.levels, own.scale
        moduli.elasticity(self._law, self.shear, self.relax, *points, products.rows, A, T, compliance)
        products.tangents(A, upper, lower)
        if self.relax:
            H, L = (compliance @ own.b_b).reshape(e, 4, 4), np.empty((e, 3, 4, len(columns.in_z)))
            for number, ((functions, _), table) in enumerate(zip(products.functions, own.N_b, strict=True)):
                part = T[:, :, slots(number)].reshape(3 * e, -1) @ table
                L[..., functions] = part.reshape(e, 3, 4, -1)
            relaxation.add_low_rank(H, L, upper, lower)

    def _strained(self, own: Form, Q: np.ndarray, more: Terms = ()) -> tuple[np.ndarray, np.ndarray]:
        """Deformation gradient F (e, 3, 3, q) and C (e, 6, q), of elements of one form, relaxed where they are."""
        F, C = _gradient(own, Q), np.zeros((len(Q), 6, len(own.volume)))
        rubber.add_cauchy_green(F, 1.0, C)
        for c, X in more:
            rubber.add_cauchy_green(_gradient(own, X), c, C)
        if self.shear != 1.0:
            C[:, 3:5] *= self.shear
        if self.relax:
            relaxation.relax(self._law, C, own.volume, own.b)
        return F, C

    @property
    def _law(self) -> tuple[float, float, float]:
        return float(self.material.mu10), float(self.material.mu01), float(self.material.bulk)

    @cached_property
    def _runs(self) -> tuple[tuple[Form, slice], ...]:
        """Consecutive elements of one form, at most POINTS points of one span each."""
        changes = np.flatnonzero(np.diff(self.form_of)) + 1
        cuts = np.union1d(changes, np.arange(0, len(self.form_of), SPAN)).tolist()
        found = []
        for first, last in zip(cuts, [*cuts[1:], len(self.form_of)], strict=True):
            own = self.forms[self.form_of[first]]
            most = max(1, POINTS // len(own.volume))
            found += [(own, slice(start, min(start + most, last))) for start in range(first, last, most)]
        return tuple(found)


def _gradient(own: Form, Q: np.ndarray) -> np.ndarray:
    """Deformation gradient F_ap (e, 3, 3, q) of nodal vectors Q (e, i, 3)."""
    components = np.ascontiguousarray(Q.swapaxes(1, 2)).reshape(-1, Q.shape[1])
    return (components @ own.gradient).reshape(len(Q), 3, 3, -1)


@dataclass(frozen=True, eq=False)
class SplitElements:
    """Elements whose energy without change of volume and whose volumetric energy have rules of their own."""

    isochoric: HyperelasticElements
    volumetric: HyperelasticElements

    def energy(self, Q: np.ndarray) -> float:
        """As that of `HyperelasticElements`."""
        return self.isochoric.energy(Q) + self.volumetric.energy(Q)

    def force(self, Q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """As that of `HyperelasticElements`."""
        return self.isochoric.force(Q, more) + self.volumetric.force(Q, more)

    def tangent(self, Q: np.ndarray, more: Terms = ()) -> Iterator[np.ndarray]:
        """As that of `HyperelasticElements`."""
        pairs_of_spans = zip(self.isochoric.tangent(Q, more), self.volumetric.tangent(Q, more), strict=True)
        return (one + other for one, other in pairs_of_spans)
