"""St. Venant-Kirchhoff elements as a quadratic form of their Gram matrix, integrated once.

With Q (i, 3) the nodal vectors of an element, D = Q Q^T its Gram matrix and G_ip = dS_i/dX_p, the
Green-Lagrange strain is linear in D,

    E_pr = 1/2 G_ip G_jr (D - D0)_ij,

so the energy of a St. Venant-Kirchhoff solid is a quadratic form of D with a constant tensor

    A_ijkn = integral G_ip G_jr C_prst G_ks G_nt dV,
    P = 1/2 A : (D - D0),    U = 1/4 (D - D0) : P,
    f_ia = P_ij Q_ja,        df_ia/dQ_kb = P_ik delta_ab + A_ijkn Q_ja Q_nb.

All rules, subdomains, grooves and enhanced strains are spent when A is integrated; elements of equal
shape and groove share it, and the whole mesh is a few matrix products.

D, P and A are symmetric in (i, j), so 136 pairs of 16 functions suffice. The tangent maps the
matrices Q_ja Q_nb (j, n) to matrices (i, k) and commutes with transposition, so it splits into a
symmetric part on 136 pairs and an antisymmetric part on 120.

Positions are measured from the element's first node: A does not see a translation, and small numbers
lose no digits. Function 0, the first node's position, then drops out of D: 120 and 105 pairs go in,
all 136 and 120 come out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ancf.element import Integrand, Terms, relaxed
from ancf.material import SaintVenantKirchhoff
from ancf.packing import DIRECTIONS, PORTION, SPAN, Pairs, pairs

VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


@dataclass(frozen=True, eq=False)
class QuadraticForm:
    """Tensors of one element shape, applied from the right: rows are pairs without function 0, columns all pairs.

    D0 (120,): Gram matrix of the reference shape. stress (120, 136): P = (D - D0) stress. symmetric
    (120, 136) and antisymmetric (105, 120): the two parts of the tangent. The counts are those of 16
    functions.
    """

    D0: np.ndarray
    stress: np.ndarray
    symmetric: np.ndarray
    antisymmetric: np.ndarray


def quadratic_form(
    parts: Integrand, material: SaintVenantKirchhoff, vectors: np.ndarray, positions: tuple[int, ...]
) -> QuadraticForm:
    """Integrate A over one undeformed element with reference nodal vectors (i, 3).

    positions: which of them are positions (their functions sum to one); 0 is one of them.
    """
    n = parts.G.shape[1]
    pair = pairs(n)
    A = _integrate(parts, material, pair)
    full = A[pair.of[:, :, None, None], pair.of].transpose(0, 2, 1, 3)
    straight = full[pair.first, pair.second][:, pair.first, pair.second]
    swapped = full[pair.first, pair.second][:, pair.second, pair.first]
    rows, odd_rows = pair.moving, pair.moving[: pair.moving_crossed]
    weight = pair.weight[rows, None]
    Q = from_first_node(vectors[None], positions)[0]
    return QuadraticForm(
        D0=np.einsum("ma,ma->m", Q[pair.first[rows]], Q[pair.second[rows]]),
        stress=weight * A[rows],
        symmetric=weight * (straight + swapped)[rows] / 2,
        antisymmetric=(straight - swapped)[odd_rows, : pair.crossed] / 2,
    )


def _integrate(parts: Integrand, material: SaintVenantKirchhoff, pair: Pairs) -> np.ndarray:
    """A (m, m), symmetrised in each pair."""
    first, second = parts.G[:, pair.first], parts.G[:, pair.second]
    E_m = np.stack([(first[..., p] * second[..., r] + first[..., r] * second[..., p]) / 2 for p, r in VOIGT], axis=-1)
    C = material.tangent(np.zeros((3, 3)))
    C_voigt = np.array([[C[p, r, s, t] for s, t in VOIGT] for p, r in VOIGT])
    both = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    C_voigt = C_voigt * both * both[:, None]
    q, m, _ = E_m.shape
    E_m = E_m.transpose(0, 2, 1)
    M = np.stack([parts.M[:, p, r] for p, r in VOIGT], axis=1)
    CM = (C_voigt @ M * parts.volume[:, None, None]).reshape(6 * q, -1)
    E = relaxed(E_m.reshape(6 * q, m), M.reshape(6 * q, -1), CM)
    CE = C_voigt @ E.reshape(q, 6, m) * parts.volume[:, None, None]
    A = E_m.reshape(6 * q, m).T @ CE.reshape(6 * q, m)
    return (A + A.T) / 2


def from_first_node(Q: np.ndarray, positions: tuple[int, ...]) -> np.ndarray:
    """Nodal vectors (e, i, 3) with the positions measured from the element's first node; a copy."""
    Q = Q.copy()
    Q[:, positions] -= Q[:, positions[:1]]
    return Q


@dataclass(frozen=True, eq=False)
class Run:
    """Consecutive elements `e` (slice) that share one form, or have one each (slice `forms`)."""

    e: slice
    forms: slice

    def apply(self, vectors: np.ndarray, tensors: np.ndarray, out: np.ndarray) -> None:
        """out (e, ..., n) = vectors (e, ..., m) times the tensors (g, m, n) of this run."""
        x, y, tensor = vectors[self.e], out[self.e], tensors[self.forms]
        g, m, n = tensor.shape
        np.matmul(x.reshape(g, -1, m), tensor, out=y.reshape(g, -1, n))


def _runs(form_of: np.ndarray) -> list[Run]:
    """Runs of one portion, in order."""
    starts = np.flatnonzero(np.r_[True, np.diff(form_of) != 0])
    stops = np.r_[starts[1:], len(form_of)]
    runs: list[Run] = []
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        g = int(form_of[start])
        last = runs[-1] if runs else None
        alone = stop - start == 1
        if alone and last and last.forms.stop == g and last.e.stop - last.e.start == last.forms.stop - last.forms.start:
            runs[-1] = Run(slice(last.e.start, stop), slice(last.forms.start, g + 1))
        else:
            runs.append(Run(slice(start, stop), slice(g, g + 1)))
    return runs


@dataclass(frozen=True, eq=False)
class Portion:
    """Elements `e` that are computed together: their runs, D0 (e, 120) and work arrays.

    packed: tangents of the whole span; upper (e, 6, 136) and lower (e, 3, 120) are this portion's part.
    """

    e: slice
    runs: list[Run]
    D0: np.ndarray
    work: dict[str, np.ndarray]
    packed: np.ndarray
    upper: np.ndarray
    lower: np.ndarray


@dataclass(frozen=True, eq=False)
class QuadraticElements:
    """Elements evaluated through their quadratic forms, in portions that fit the cache.

    D0, stress, symmetric, antisymmetric: those of each distinct QuadraticForm, stacked (g, ...);
    form_of (e,): the form of each element, in the order of `element_order`. positions: as in
    `quadratic_form`. The work arrays are reused from call to call: an instance is not for two threads.
    """

    D0: np.ndarray
    stress: np.ndarray
    symmetric: np.ndarray
    antisymmetric: np.ndarray
    form_of: np.ndarray
    functions: int
    positions: tuple[int, ...]

    def energy(self, Q: np.ndarray) -> float:
        """Strain energy (J) of all elements with nodal vectors Q (e, i, 3)."""
        pair = pairs(self.functions)
        total = 0.0
        for portion in self._portions:
            self._stress(Q, portion)
            strain, P = portion.work["D"], portion.work["P"][:, pair.moving]
            total += 0.5 * float(np.einsum("em,em,m->", strain, P, pair.weight[pair.moving]))
        return total

    def force(self, Q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (e, i, 3) in N for positions and N m for gradients.

        more: pairs (c, X) of a number and an array (e, i, 3); the stress is then that of Q Q^T + c X X^T. The mean
        of the Gram matrices of Q - X and Q + X is Q Q^T + X X^T, and what Q + X has beyond its part linear in X
        is X X^T.
        """
        n, of = self.functions, pairs(self.functions).of.ravel()
        force = np.empty_like(Q)
        for portion in self._portions:
            self._stress(Q, portion, more)
            work = portion.work
            P = work["P"].take(of, axis=1, out=work["gram"].reshape(-1, n * n), mode="clip")
            np.matmul(P.reshape(-1, n, n), work["Q"], out=force[portion.e])
        return force

    def tangent(self, Q: np.ndarray, more: Terms = ()) -> Iterator[np.ndarray]:
        """Yield the packed tangents span by span; see `packing`. The array is reused. more: as in `force`."""
        for portion in self._portions:
            self._stress(Q, portion, more)
            self._tangent(portion)
            if portion.e.stop % SPAN == 0 or portion.e.stop == len(Q):
                yield portion.packed

    def _stress(self, Q: np.ndarray, portion: Portion, more: Terms = ()) -> None:
        """Fill Q from the first node, D - D0 (e, 120) and P (e, 136) of one portion."""
        n, pair, work = self.functions, pairs(self.functions), portion.work
        own, D, gram = work["Q"], work["D"], work["gram"]
        np.copyto(own, Q[portion.e])
        own[:, self.positions] -= own[:, self.positions[:1]]
        np.matmul(own, own.swapaxes(1, 2), out=gram)
        for c, X in more:
            other = from_first_node(X[portion.e], self.positions)
            gram += c * (other @ other.swapaxes(1, 2))
        gram.reshape(-1, n * n).take((pair.first * n + pair.second)[pair.moving], axis=1, out=D, mode="clip")
        D -= portion.D0
        for run in portion.runs:
            run.apply(D, self.stress, work["P"])

    def _tangent(self, portion: Portion) -> None:
        """Fill the packed tangents of one portion from its Q and P; D is overwritten."""
        pair, work = pairs(self.functions), portion.work
        c, moving_c = pair.crossed, pair.moving_crossed
        rows = np.ascontiguousarray(work["Q"].swapaxes(1, 2))
        left = rows.take(pair.first[pair.moving], axis=2, out=work["left"], mode="clip")
        right = rows.take(pair.second[pair.moving], axis=2, out=work["right"], mode="clip")
        even, odd, swapped = work["even"], work["odd"], work["D"]
        np.multiply(left, right, out=even[:, :3])
        even[:, :3] *= 2.0
        for k, (a, b) in enumerate(DIRECTIONS[3:]):
            np.multiply(left[:, a], right[:, b], out=even[:, 3 + k])
            np.multiply(right[:, a], left[:, b], out=swapped)
            np.subtract(even[:, 3 + k, :moving_c], swapped[:, :moving_c], out=odd[:, k])
            even[:, 3 + k] += swapped
        upper, lower, odd_part = portion.upper, portion.lower, work["odd part"]
        for run in portion.runs:
            run.apply(even, self.symmetric, upper)
            run.apply(odd, self.antisymmetric, odd_part)
        upper[:, :3] += work["P"][:, None]
        np.subtract(upper[:, 3:, :c], odd_part, out=lower)
        upper[:, 3:, :c] += odd_part

    @cached_property
    def _portions(self) -> list[Portion]:
        """Portions in order; those of equal size share their work arrays, spans of equal size their packed ones."""
        m, c = len(pairs(self.functions).first), pairs(self.functions).crossed
        count = len(self.form_of)
        work = {e: _work(e, self.functions) for e in {min(PORTION, count), count % PORTION} if e}
        packed = {e: np.empty(e * (6 * m + 3 * c)) for e in {min(SPAN, count), count % SPAN} if e}
        portions = []
        for start in range(0, count, PORTION):
            forms = self.form_of[start : start + PORTION]
            first = start - start % SPAN
            span = packed[min(SPAN, count - first)]
            size = len(span) // (6 * m + 3 * c)
            own = slice(start - first, start - first + len(forms))
            upper = span[: size * 6 * m].reshape(size, 6, m)[own]
            lower = span[size * 6 * m :].reshape(size, 3, c)[own]
            e = slice(start, start + len(forms))
            portions.append(Portion(e, _runs(forms), self.D0[forms], work[len(forms)], span, upper, lower))
        return portions


def _work(e: int, n: int) -> dict[str, np.ndarray]:
    """Work arrays of a portion of e elements."""
    pair = pairs(n)
    m, c, moving, moving_c = len(pair.first), pair.crossed, len(pair.moving), pair.moving_crossed
    shapes = {"Q": (n, 3), "gram": (n, n), "D": (moving,), "P": (m,), "left": (3, moving), "right": (3, moving)}
    shapes |= {"even": (6, moving), "odd": (3, moving_c), "odd part": (3, c)}
    return {name: np.empty((e, *shape)) for name, shape in shapes.items()}
