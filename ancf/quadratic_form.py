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
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ancf.element import Integrand, Terms
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
    i, k = pair.first[:, None], pair.second[:, None]
    straight = A[pair.of[i, pair.first], pair.of[k, pair.second]]
    swapped = A[pair.of[i, pair.second], pair.of[k, pair.first]]
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
    """A (m, m), symmetrised in each pair: with H = R R^T of the enhanced strains (see `ancf.enhanced`) and C = L L^T,

    A = X^T X - Y^T Y,  X = L^T E sqrt(dV),  Y = R^-1 (M : C : E dV).
    """
    first, second = parts.G[:, pair.first], parts.G[:, pair.second]
    E = np.stack([(first[..., p] * second[..., r] + first[..., r] * second[..., p]) / 2 for p, r in VOIGT], axis=1)
    C = material.tangent(np.zeros((3, 3)))
    both = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    C_voigt = np.array([[C[p, r, s, t] for s, t in VOIGT] for p, r in VOIGT]) * both * both[:, None]
    L_t = np.linalg.cholesky(C_voigt).T * np.sqrt(parts.volume)[:, None, None]
    X = (L_t @ E).reshape(6 * len(E), -1)
    LM = (L_t @ np.stack([parts.M[:, p, r] for p, r in VOIGT], axis=1)).reshape(len(X), -1)
    A = X.T @ X
    if LM.shape[1]:
        Y = np.linalg.solve(np.linalg.cholesky(LM.T @ LM), LM.T @ X)
        A -= Y.T @ Y
    return A


def from_first_node(Q: np.ndarray, positions: tuple[int, ...]) -> np.ndarray:
    """Nodal vectors (e, i, 3) with the positions measured from the element's first node; a copy."""
    Q = Q.copy()
    Q[:, positions] -= Q[:, positions[:1]]
    return Q


def _runs(form_of: np.ndarray) -> list[tuple[slice, slice]]:
    """Runs of one portion in order: consecutive elements that share one form, or have one each, and their forms."""
    starts = np.flatnonzero(np.r_[True, np.diff(form_of) != 0])
    stops = np.r_[starts[1:], len(form_of)]
    runs: list[tuple[slice, slice]] = []
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        g = int(form_of[start])
        e, forms = runs[-1] if runs else (slice(0, 0), slice(0, 0))
        alone = stop - start == 1 and e.stop - e.start == forms.stop - forms.start
        if runs and alone and forms.stop == g:
            runs[-1] = slice(e.start, stop), slice(forms.start, g + 1)
        else:
            runs.append((slice(start, stop), slice(g, g + 1)))
    return runs


class Product(NamedTuple):
    """out = vectors tensors of one run: views of a portion's work arrays, made once.

    A shared form: (rows, m), (m, n), (rows, n). A form each: (g, rows, m), (g, m, n), (g, rows, n).
    """

    vectors: np.ndarray
    tensors: np.ndarray
    out: np.ndarray

    def compute(self) -> None:
        """Fill `out`."""
        np.matmul(self.vectors, self.tensors, out=self.out)


def _products(runs: list[tuple[slice, slice]], vectors: np.ndarray, tensors: np.ndarray, out: np.ndarray):
    """Product of each run for out (e, ..., n) = vectors (e, ..., m) times the element's tensor of tensors (g, m, n)."""
    _, m, n = tensors.shape
    products = []
    for e, forms in runs:
        shared = (-1,) if forms.stop - forms.start == 1 else (forms.stop - forms.start, -1)
        own = tensors[forms.start] if len(shared) == 1 else tensors[forms]
        products.append(Product(vectors[e].reshape(*shared, m), own, out[e].reshape(*shared, n)))
    return products


class Flipped(NamedTuple):
    """A run of a portion's elements whose vectors times signs (i, 1) are those of their form; of the entries of
    packed tangents: upper (6 x 136,), lower (3 x 120,)."""

    e: slice
    signs: np.ndarray
    upper: np.ndarray
    lower: np.ndarray


def _flipped(signs: np.ndarray) -> list[Flipped]:
    """Runs of elements with signs (e, i) of which some are negative, in order."""
    pair, runs = pairs(signs.shape[1]), []
    starts = np.flatnonzero(np.r_[True, (np.diff(signs, axis=0) != 0).any(axis=1)]).tolist()
    for start, stop in pairwise([*starts, len(signs)]):
        own = signs[start]
        if own.min() < 0:
            of_pairs = own[pair.first] * own[pair.second]
            entries = np.tile(of_pairs, 6), np.tile(of_pairs[: pair.crossed], 3)
            runs.append(Flipped(slice(start, stop), own[:, None], *entries))
    return runs


@dataclass(frozen=True, eq=False)
class Portion:
    """Elements `e` that are computed together: D0 (e, 120), work arrays, and the products that fill them.

    stress: D to P. tangent: even and odd to their parts of the tangent. packed: tangents of the whole span;
    upper (e, 6, 136) and lower (e, 3, 120) are this portion's part. flipped: the runs of elements that are images
    of their form with other signs.
    """

    e: slice
    D0: np.ndarray
    work: dict[str, np.ndarray]
    stress: list[Product]
    tangent: list[Product]
    packed: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    flipped: list[Flipped]


@dataclass(frozen=True, eq=False)
class QuadraticElements:
    """Elements evaluated through their quadratic forms, in portions that fit the cache.

    D0, stress, symmetric, antisymmetric: those of each distinct QuadraticForm, stacked (g, ...);
    form_of (e,): the form of each element, in the order of `element_order`. signs (e, i): what its nodal vectors are
    multiplied by to become those of its form (`ancf.image`). positions: as in `quadratic_form`. The work arrays are
    reused from call to call: an instance is not for two threads.
    """

    D0: np.ndarray
    stress: np.ndarray
    symmetric: np.ndarray
    antisymmetric: np.ndarray
    form_of: np.ndarray
    signs: np.ndarray
    positions: tuple[int, ...]

    @property
    def functions(self) -> int:
        """Number of functions of an element."""
        return self.signs.shape[1]

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
            own = np.matmul(P.reshape(-1, n, n), work["Q"], out=force[portion.e])
            for run in portion.flipped:
                own[run.e] *= run.signs
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
        self._own(Q, portion, own)
        np.matmul(own, own.swapaxes(1, 2), out=gram)
        for c, X in more:
            other = self._own(X, portion, np.empty_like(own))
            gram += c * (other @ other.swapaxes(1, 2))
        gram.reshape(-1, n * n).take((pair.first * n + pair.second)[pair.moving], axis=1, out=D, mode="clip")
        D -= portion.D0
        for product in portion.stress:
            product.compute()

    def _own(self, Q: np.ndarray, portion: Portion, out: np.ndarray) -> np.ndarray:
        """Fill out with a portion's nodal vectors as their forms know them, from the first node."""
        np.copyto(out, Q[portion.e])
        out[:, self.positions] -= out[:, self.positions[:1]]
        for run in portion.flipped:
            out[run.e] *= run.signs
        return out

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
        for product in portion.tangent:
            product.compute()
        upper[:, :3] += work["P"][:, None]
        np.subtract(upper[:, 3:, :c], odd_part, out=lower)
        upper[:, 3:, :c] += odd_part
        for run in portion.flipped:
            for part, signs in ((upper, run.upper), (lower, run.lower)):
                own = part[run.e].reshape(-1, len(signs))  # a view: long rows are faster
                own *= signs

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
            e, arrays, runs = slice(start, start + len(forms)), work[len(forms)], _runs(forms)
            stress = _products(runs, arrays["D"], self.stress, arrays["P"])
            tangent = _products(runs, arrays["even"], self.symmetric, upper)
            tangent += _products(runs, arrays["odd"], self.antisymmetric, arrays["odd part"])
            flipped = _flipped(self.signs[e])
            portions.append(Portion(e, self.D0[forms], arrays, stress, tangent, span, upper, lower, flipped))
        return portions


def _work(e: int, n: int) -> dict[str, np.ndarray]:
    """Work arrays of a portion of e elements."""
    pair = pairs(n)
    m, c, moving, moving_c = len(pair.first), pair.crossed, len(pair.moving), pair.moving_crossed
    shapes = {"Q": (n, 3), "gram": (n, n), "D": (moving,), "P": (m,), "left": (3, moving), "right": (3, moving)}
    shapes |= {"even": (6, moving), "odd": (3, moving_c), "odd part": (3, c)}
    return {name: np.empty((e, *shape)) for name, shape in shapes.items()}
