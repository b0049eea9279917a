"""Elements of Mooney-Rivlin material, integrated point by point with whole-mesh array operations.

With Q_a the a-th components of the nodal vectors of all elements that share an undeformed shape, F_ap = G_p^T Q_a is
one matrix product for all their points. The law is evaluated component by component (`ancf.rubber`), and what comes
out of it goes back by matrix products too:

    f_ia = sum over q of G_ip T_ap,    T_ap = F_ar S_rp dV,
    K_ia,kb = sum over q of G_ip A_apbt G_kt,    A_apbt = (S_pt delta_ab + F_ar C_rpst F_bs) dV.

The products G_ip G_kt are tabulated for the pairs i <= k, split like the tangents (`ancf.packing`) into a part even in
(p, t), 6 combinations, and an odd one, 3. G is taken in a frame of its own at each point, whose third direction n
is the normal of the undeformed mid-surface: the law is isotropic.

An element that corrects the shear factor (`Plate.shear`) has the transverse shears of E times sqrt(5/6): a straight
director shears evenly, and then has the energy 5/6 of which faces without traction leave it (Reissner).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ancf.element import Integrand, Terms
from ancf.material import MooneyRivlin
from ancf.packing import DIRECTIONS, SPAN, packing, pairs
from ancf.relaxation import relaxed
from ancf.rubber import VOIGT, Six, State, energy, moduli, state, stress

POINTS = 4096  # points that are computed together
SHEAR = np.sqrt(5 / 6)
OF = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  # place of (p, r) in VOIGT
Moduli = dict[tuple[int, int], np.ndarray]  # by the places (m, n), m <= n, in VOIGT
EVEN = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
ODD = EVEN[3:]


@dataclass(frozen=True, eq=False)
class Form:
    """One undeformed element: G (3, i, q) in the frame of each point, volume (q,) in m3, b (4, q) of `relaxation`.

    even (6 q, m), odd (3 q, c): products of G for the pairs of functions.
    """

    G: np.ndarray
    volume: np.ndarray
    b: np.ndarray

    @cached_property
    def b_b(self) -> np.ndarray:
        """b_k b_l (16, q)."""
        return (self.b[:, None] * self.b).reshape(16, -1)

    @cached_property
    def G_b(self) -> np.ndarray:
        """G_ip b_k (3, 4 i, q)."""
        return np.ascontiguousarray(self.G[:, None] * self.b[:, None]).reshape(3, -1, len(self.volume))

    @cached_property
    def even(self) -> np.ndarray:
        """(G_ip G_kt + G_it G_kp) for p < t, G_ip G_kp for p = t."""
        pair = pairs(self.G.shape[1])
        one, other = self.G[:, pair.first], self.G[:, pair.second]
        rows = [one[p] * other[t] + (one[t] * other[p] if p != t else 0.0) for p, t in EVEN]
        return np.ascontiguousarray(np.concatenate([row.T for row in rows]))

    @cached_property
    def odd(self) -> np.ndarray:
        """(G_ip G_kt - G_it G_kp) for p < t and i < k."""
        pair = pairs(self.G.shape[1])
        one, other = self.G[:, pair.first[: pair.crossed]], self.G[:, pair.second[: pair.crossed]]
        return np.ascontiguousarray(np.concatenate([(one[p] * other[t] - one[t] * other[p]).T for p, t in ODD]))


def form(parts: Integrand) -> Form:
    """Form of an Integrand."""
    frame = _frames(parts.g_z)
    G = (parts.G @ frame).transpose(2, 1, 0)
    return Form(np.ascontiguousarray(G), parts.volume, parts.bilinear.T / np.einsum("qp,qp->q", parts.g_z, parts.g_z))


def _frames(g_z: np.ndarray) -> np.ndarray:
    """Orthonormal columns (q, 3, 3) whose third is along g_z (q, 3)."""
    n = g_z / np.linalg.norm(g_z, axis=1)[:, None]
    least = np.eye(3)[np.abs(n).argmin(axis=1)]
    first = np.cross(least, n)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(n, first), n], axis=2)


@dataclass(frozen=True, eq=False)
class Run:
    """Consecutive elements `e` of one form; their points, (q, e) one after the other, are `points` of a portion."""

    form: Form
    e: slice
    points: slice

    def block(self, array: np.ndarray) -> np.ndarray:
        """This run's part (..., q, e) of an array (..., points) of the portion."""
        part = array[..., self.points]
        return part.reshape(*part.shape[:-1], len(self.form.volume), -1)


@dataclass(frozen=True, eq=False)
class Portion:
    """Runs that are computed together; volume (points,)."""

    runs: tuple[Run, ...]
    volume: np.ndarray

    @property
    def e(self) -> slice:
        """The elements."""
        return slice(self.runs[0].e.start, self.runs[-1].e.stop)

    def own(self, run: Run) -> slice:
        """The elements of a run among those of the portion."""
        return slice(run.e.start - self.e.start, run.e.stop - self.e.start)

    def moments(self, values: np.ndarray) -> np.ndarray:
        """Sums (4, e) of b_k values over the points of each element, values (points,)."""
        return np.concatenate([run.form.b @ run.block(values) for run in self.runs], axis=1)

    def second_moments(self, values: np.ndarray) -> np.ndarray:
        """Sums (e, 4, 4) of b_k b_l values."""
        flat = np.concatenate([run.form.b_b @ run.block(values) for run in self.runs], axis=1)
        return np.ascontiguousarray(flat.T).reshape(-1, 4, 4)

    def bilinear(self, beta: np.ndarray) -> np.ndarray:
        """sum_k b_k beta_k (points,) of beta (4, e)."""
        found = np.empty_like(self.volume)
        for run in self.runs:
            np.matmul(run.form.b.T, beta[:, self.own(run)], out=run.block(found))
        return found


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
        states = ((portion, self._state(portion, self._gradient(Q, portion))) for portion in self._portions)
        return float(sum(portion.volume @ energy(self.material, at) for portion, at in states))

    def force(self, Q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (e, i, 3) in N for positions and N m for gradients. more: as in `PointElements.force`."""
        force = np.empty_like(Q)
        for portion in self._portions:
            F = self._gradient(Q, portion)
            S = self._stress(self._state(portion, F, self._more(portion, more)), portion)
            force[portion.e] = _back(portion, F, S)
        return force

    def tangent(self, Q: np.ndarray, more: Terms = ()) -> Iterator[np.ndarray]:
        """Yield the packed tangents span by span; see `packing`. more: as in `force`."""
        n = Q.shape[1]
        m, c = len(pairs(n).first), pairs(n).crossed
        for start in range(0, len(Q), SPAN):
            size = min(SPAN, len(Q) - start)
            packed = np.empty(size * (6 * m + 3 * c))
            upper, lower = packed[: size * 6 * m].reshape(size, 6, m), packed[size * 6 * m :].reshape(size, 3, c)
            for portion in self._portions:
                if start <= portion.e.start < start + SPAN:
                    own = slice(portion.e.start - start, portion.e.stop - start)
                    self._tangent(Q, portion, more, upper[own], lower[own])
            yield packed

    def volume_ratios(self, Q: np.ndarray) -> np.ndarray:
        """J (q,) at the points of a single element with nodal vectors Q (i, 3)."""
        (portion,) = self._portions
        return self._state(portion, self._gradient(Q[None], portion)).J

    def _gradient(self, Q: np.ndarray, portion: Portion) -> np.ndarray:
        """Deformation gradient F_ap (3, 3, points)."""
        F = np.empty((3, 3, len(portion.volume)))
        for run in portion.runs:
            own = np.ascontiguousarray(Q[run.e].transpose(2, 1, 0))
            np.matmul(run.form.G.swapaxes(1, 2)[None], own[:, None], out=run.block(F))
        return F

    def _more(self, portion: Portion, more: Terms) -> list[tuple[float, np.ndarray]]:
        """The terms with the gradients of their arrays."""
        return [(c, self._gradient(X, portion)) for c, X in more]

    def _state(self, portion: Portion, F: np.ndarray, more: Sequence[tuple[float, np.ndarray]] = ()) -> State:
        """State of the law at the points of a portion."""
        C = list(_cauchy_green(F))
        for c, F_X in more:
            C = [own + c * other for own, other in zip(C, _cauchy_green(F_X), strict=True)]
        C[3], C[4] = self.shear * C[3], self.shear * C[4]
        if self.relax:
            return relaxed(self.material, tuple(C), portion)
        return state(self.material, tuple(C))

    def _stress(self, at: State, portion: Portion) -> list[np.ndarray]:
        """S dV that does work on the strain of the displacement, six arrays (points,) in N m."""
        S = [part * portion.volume for part in stress(at)]
        S[3], S[4] = self.shear * S[3], self.shear * S[4]
        return S

    def _tangent(self, Q: np.ndarray, portion: Portion, more: Terms, upper: np.ndarray, lower: np.ndarray) -> None:
        """Fill the packed tangents (e, 6, m) and (e, 3, c) of a portion."""
        F = self._gradient(Q, portion)
        at = self._state(portion, F, self._more(portion, more))
        C = self._moduli(at, portion.volume)
        low_rank = _condense(C, F, portion) if self.relax else None
        A_even, A_odd = _elasticity(F, self._stress(at, portion), C)
        crossed = lower.shape[2]
        for run in portion.runs:
            own = portion.own(run)
            e = own.stop - own.start
            even = run.block(A_even).reshape(6, -1, e).swapaxes(1, 2) @ run.form.even
            odd = run.block(A_odd).reshape(3, -1, e).swapaxes(1, 2) @ run.form.odd
            upper[own] = even.swapaxes(0, 1)
            odd = odd.swapaxes(0, 1)
            np.subtract(upper[own, 3:, :crossed], odd, out=lower[own])
            upper[own, 3:, :crossed] += odd
        if low_rank is not None:
            _add_products(low_rank, upper, lower)

    def _moduli(self, at: State, volume: np.ndarray) -> Moduli:
        """Moduli dV by the strain of the displacement, in N m."""
        factors = [self.shear if m in (3, 4) else 1.0 for m in range(6)]
        rows = moduli(self.material, at)
        weights = {1.0: volume, self.shear: self.shear * volume, self.shear**2: self.shear**2 * volume}
        return {
            (m, n): part * weights[factors[m] * factors[n]]
            for m, row in enumerate(rows)
            for n, part in enumerate(row, start=m)
        }

    @cached_property
    def _portions(self) -> tuple[Portion, ...]:
        """Portions in the order of the elements, none across the end of a span."""
        portions: list[Portion] = []
        runs: list[Run] = []
        for start, stop, own in self._stretches():
            q = len(own.volume)
            filled = runs[-1].points.stop if runs else 0
            if runs and (filled + q * (stop - start) > POINTS or start % SPAN == 0):
                portions.append(_portion(runs))
                runs, filled = [], 0
            runs.append(Run(own, slice(start, stop), slice(filled, filled + q * (stop - start))))
        return (*portions, _portion(runs))

    def _stretches(self) -> Iterator[tuple[int, int, Form]]:
        """Consecutive elements of one form, at most POINTS points of one span each."""
        changes = np.flatnonzero(np.diff(self.form_of)) + 1
        cuts = np.union1d(changes, np.arange(0, len(self.form_of), SPAN))
        for first, last in zip(cuts, [*cuts[1:], len(self.form_of)], strict=True):
            own = self.forms[self.form_of[first]]
            most = max(1, POINTS // len(own.volume))
            yield from ((start, min(start + most, last), own) for start in range(int(first), int(last), most))


def _portion(runs: list[Run]) -> Portion:
    repeated = [np.repeat(run.form.volume, run.e.stop - run.e.start) for run in runs]
    return Portion(tuple(runs), np.concatenate(repeated))


def _cauchy_green(F: np.ndarray) -> Six:
    """C = F^T F."""
    return tuple(F[0, p] * F[0, r] + F[1, p] * F[1, r] + F[2, p] * F[2, r] for p, r in VOIGT)


def _pushed(F: np.ndarray, S: Sequence[np.ndarray]) -> np.ndarray:
    """T_ap = F_ar S_rp (3, 3, points) of six arrays S."""
    T = np.empty_like(F)
    for p in range(3):
        for a in range(3):
            np.add(F[a, 0] * S[OF[0, p]] + F[a, 1] * S[OF[1, p]], F[a, 2] * S[OF[2, p]], out=T[a, p])
    return T


def _back(portion: Portion, F: np.ndarray, S: Sequence[np.ndarray]) -> np.ndarray:
    """Forces (e, i, 3) of the stress S (six arrays, with dV) at the points of a portion: G_ip F_ar S_rp."""
    T = _pushed(F, S)
    found = [np.matmul(run.form.G[None], run.block(T)).sum(axis=1).transpose(2, 1, 0) for run in portion.runs]
    return np.concatenate(found)


def _condense(C: Moduli, F: np.ndarray, portion: Portion) -> np.ndarray:
    """Take the normal stress out of the moduli; returns R (e, 4, 3 i), whose R^T R belongs to the tangent."""
    D = C[2, 2]
    ratio = [C.pop((min(m, 2), max(m, 2))) for m in range(6)]
    unit = [part / D for part in ratio]
    for m, n in C:
        C[m, n] = C[m, n] - ratio[m] * unit[n]
    unit[2] = np.ones_like(D)
    T = _pushed(F, [portion.volume * part for part in unit])
    H = portion.second_moments(portion.volume**2 / D)
    L = []
    for run in portion.runs:
        product = np.matmul(run.form.G_b[None], run.block(T)).sum(axis=1)
        L.append(product.reshape(3, 4, -1, product.shape[-1]).transpose(3, 1, 2, 0))
    L = np.concatenate(L).reshape(len(H), 4, -1)
    if not (np.isfinite(H).all() and np.isfinite(L).all()):
        return np.full_like(L, np.nan)
    return np.linalg.solve(np.linalg.cholesky(H), L)


def _elasticity(F: np.ndarray, S: Sequence[np.ndarray], C: Moduli) -> tuple[np.ndarray, np.ndarray]:
    """Even part (6, 6, points) and odd part (3, 3, points) of A for the directions (a, b) of `packing`."""
    even, odd = np.empty((6, 6, F.shape[2])), np.empty((3, 3, F.shape[2]))
    FC = {
        (a, p, n): _total(F[a, r] * C[key] for r in range(3) if (key := tuple(sorted((OF[r, p], n)))) in C)
        for a in range(3)
        for p in range(3)
        for n in {m for key in C for m in key}
    }

    def entry(a: int, p: int, b: int, t: int) -> np.ndarray:
        return _total(FC[key] * F[b, s] for s in range(3) if (key := (a, p, int(OF[t, s]))) in FC)

    for k, (a, b) in enumerate(DIRECTIONS):
        for j, (p, t) in enumerate(EVEN):
            one = entry(a, p, b, t)
            if a == b:
                np.add(one, S[j], out=even[k, j])
            elif p == t:
                even[k, j] = one
            else:
                other = entry(a, t, b, p)
                np.multiply(one + other, 0.5, out=even[k, j])
                np.multiply(one - other, 0.5, out=odd[k - 3, j - 3])
    return even, odd


def _total(terms: Iterator[np.ndarray]) -> np.ndarray:
    """Sum of fresh arrays, in the first of them."""
    total = next(terms)
    for term in terms:
        total += term
    return total


def _add_products(R: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> None:
    """Add R^T R of R (e, 4, 3 i) to packed tangents."""
    rows, columns, second = packing(R.shape[2] // 3)
    entries = (R.swapaxes(1, 2) @ R).reshape(len(R), -1).take(rows * R.shape[2] + columns, axis=1)
    upper += entries[:, :second].reshape(upper.shape)
    lower += entries[:, second:].reshape(lower.shape)


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
