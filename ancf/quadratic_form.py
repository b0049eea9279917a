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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import lapack

from ancf.element import Integrand, Terms
from ancf.material import SaintVenantKirchhoff
from ancf.packing import DIRECTIONS, PORTION, SPAN, Pairs, pairs
from ancf.products import Flipped, Product, flipped, products, runs_of, turn

if TYPE_CHECKING:
    from ancf.parity import Split

ALL = slice(None)
Coupled = tuple[slice, slice | np.ndarray]
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
    pair, (straight, swapped) = pairs(n), _exchanged(n)
    A = integrate(parts, material, pair)
    weight = pair.weight[pair.moving, None]
    straight, swapped = A.take(straight), A.take(swapped)
    odd = (straight - swapped)[: pair.moving_crossed, : pair.crossed]
    straight += swapped
    straight *= weight / 2
    odd *= 0.5
    Q = from_first_node(vectors[None], positions)[0]
    return QuadraticForm(
        D0=np.einsum("ma,ma->m", Q[pair.first[pair.moving]], Q[pair.second[pair.moving]]),
        stress=weight * A[pair.moving],
        symmetric=straight,
        antisymmetric=odd,
    )


@lru_cache(maxsize=8)
def _exchanged(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places in A of A_ijkn and A_inkj (m1, m) for the pairs (i, k), rows without function 0, and (j, n)."""
    pair = pairs(n)
    i, k, m = pair.first[pair.moving, None], pair.second[pair.moving, None], len(pair.first)
    one, other = pair.of[i, pair.first], pair.of[i, pair.second]
    return one * m + pair.of[k, pair.second], other * m + pair.of[k, pair.first]


def integrate(
    parts: Integrand, material: SaintVenantKirchhoff, pair: Pairs | Split, coupled: Sequence[Coupled] = ((ALL, ALL),)
) -> np.ndarray:
    """A (m, m), symmetrised in each pair: with H = R R^T of the enhanced strains (see `ancf.enhanced`) and C = L L^T,

    A = X^T X - Y^T Y,  X = L^T E sqrt(dV),  Y = R^-1 (M : C : E dV), rows by component and point.

    coupled: the pairs that are coupled, those of one slice with each other, and the enhanced strains that act on them;
    the rest of A is zero.
    """
    C = material.tangent(np.zeros((3, 3)))
    L_t = np.linalg.cholesky([[C[p, r, s, t] for s, t in VOIGT] for p, r in VOIGT]).T
    X, A = _rows(L_t, _strain_of_pairs(parts, pair)), np.zeros(2 * (len(pair.first),))
    M = np.stack([parts.M[:, p, r] * (1.0 if p == r else 2.0) for p, r in VOIGT])
    LM = _rows(L_t, M * np.sqrt(parts.volume)[:, None])
    for block, acting in coupled:
        own, enhanced = X[:, block], LM[:, acting]
        A[block, block] = own.T @ own
        if enhanced.size:
            Y, _ = lapack.dtrtrs(np.linalg.cholesky(enhanced.T @ enhanced), enhanced.T @ own, lower=1)
            A[block, block] -= Y.T @ Y
    return A


def _rows(L_t: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """L^T E (6 q, m) of strains (6, q, m)."""
    _, q, m = strain.shape
    return (L_t @ strain.reshape(6, q * m)).reshape(6 * q, m)


def _strain_of_pairs(parts: Integrand, pair: Pairs | Split) -> np.ndarray:
    """E_pr sqrt(dV) (6, q, m), symmetrised in each pair, E_pr + E_rp for p < r."""
    G = np.ascontiguousarray((parts.G * parts.volume[:, None, None] ** 0.25).transpose(2, 0, 1))
    first, second = G.take(pair.first, axis=2), G.take(pair.second, axis=2)
    E, beside = np.empty((6, *first.shape[1:])), np.empty(first.shape[1:])
    np.multiply(first, second, out=E[:3])
    for (p, r), own in zip(VOIGT[3:], E[3:], strict=True):
        np.multiply(first[p], second[r], out=own)
        own += np.multiply(first[r], second[p], out=beside)
    return E


def from_first_node(Q: np.ndarray, positions: tuple[int, ...]) -> np.ndarray:
    """Nodal vectors (e, i, 3) with the positions measured from the element's first node; a copy."""
    Q = Q.copy()
    Q[:, positions] -= Q[:, positions[:1]]
    return Q


@dataclass(frozen=True, eq=False)
class Portion:
    """Elements `e` that are computed together: D0 (e, 120), work arrays, and the products that fill them.

    stress: D to P. tangent: even and odd to their parts of the tangent. packed: tangents of the whole span;
    upper (e, 6, 136) and lower (e, 3, 120) are this portion's part. flipped: the runs of elements that have other
    signs than their form.
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


class Portioned:
    """What elements have in common that are computed portion by portion, from tensors of their forms."""

    def tangent(self, Q: np.ndarray, more: Terms = ()) -> Iterator[np.ndarray]:
        """Yield the packed tangents span by span; see `packing`. The array is reused. more: as in `force`."""
        for portion in self._portions:
            self._stress(Q, portion, more)
            self._tangent(portion)
            if portion.e.stop % SPAN == 0 or portion.e.stop == len(Q):
                yield portion.packed

    @cached_property
    def _at(self) -> np.ndarray | None:
        """Where a single portion's D and P were last computed (e, i, 3), so that a tangent or an energy there is spared
        them; not a number where they are of nowhere. None where portions share their work arrays."""
        return np.full((*self.signs.shape, 3), np.nan) if len(self._portions) == 1 else None

    @cached_property
    def _places(self) -> slice:
        """The positions, which lie equally far apart and begin with 0."""
        return slice(0, self.positions[-1] + 1, self.positions[1])


@dataclass(frozen=True, eq=False)
class QuadraticElements(Portioned):
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

    @cached_property
    def functions(self) -> int:
        """Number of functions of an element."""
        return self.signs.shape[1]

    def energy(self, Q: np.ndarray) -> float:
        """Strain energy (J) of all elements with nodal vectors Q (e, i, 3)."""
        pair = pairs(self.functions)
        total = 0.0
        for portion in self._portions:
            self._stress(Q, portion)
            P = portion.work["P"].take(pair.moving, axis=1)
            total += 0.5 * float(np.vdot(portion.work["D"] * pair.weight[pair.moving], P))
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
                turn(own, run.e, run.nodal)
        return force

    def _stress(self, Q: np.ndarray, portion: Portion, more: Terms = ()) -> None:
        """Fill Q from the first node, D - D0 (e, 120) and P (e, 136) of one portion."""
        n, pair, work = self.functions, pairs(self.functions), portion.work
        own, D, gram, at = work["Q"], work["D"], work["gram"], self._at
        if at is not None and not more and (at == Q).all():
            return
        self._own(Q, portion, own)
        np.matmul(own, own.swapaxes(1, 2), out=gram)
        for c, X in more:
            other = self._own(X, portion, np.empty_like(own))
            gram += c * (other @ other.swapaxes(1, 2))
        gram.reshape(-1, n * n).take(pair.grams, axis=1, out=D, mode="clip")
        D -= portion.D0
        for product in portion.stress:
            product.compute()
        if at is not None:
            np.copyto(at, np.nan if more else Q)

    def _own(self, Q: np.ndarray, portion: Portion, out: np.ndarray) -> np.ndarray:
        """Fill out with a portion's nodal vectors as their forms know them, from the first node."""
        np.copyto(out, Q[portion.e])
        out[:, self._places] -= out[:, :1]
        for run in portion.flipped:
            turn(out, run.e, run.nodal)
        return out

    def _tangent(self, portion: Portion) -> None:
        """Fill the packed tangents of one portion from its Q and P; D is overwritten."""
        pair, work = pairs(self.functions), portion.work
        if self._at is not None:
            self._at.fill(np.nan)
        c, moving_c = pair.crossed, pair.moving_crossed
        rows = np.ascontiguousarray(work["Q"].swapaxes(1, 2))
        rows.take(pair.first[pair.moving], axis=2, out=work["left"], mode="clip")
        rows.take(pair.second[pair.moving], axis=2, out=work["right"], mode="clip")
        gram_products(work, moving_c, work["D"])
        upper, lower, odd_part = portion.upper, portion.lower, work["odd part"]
        for product in portion.tangent:
            product.compute()
        upper[:, :3] += work["P"][:, None]
        np.subtract(upper[:, 3:, :c], odd_part, out=lower)
        upper[:, 3:, :c] += odd_part
        for run in portion.flipped:
            turn(upper, run.e, run.upper)
            turn(lower, run.e, run.lower)

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
            e, arrays, runs = slice(start, start + len(forms)), work[len(forms)], runs_of(forms)
            stress = products(runs, arrays["D"], self.stress, arrays["P"])
            tangent = products(runs, arrays["even"], self.symmetric, upper)
            tangent += products(runs, arrays["odd"], self.antisymmetric, arrays["odd part"])
            parts = span, upper, lower, flipped(self.signs[e])
            portions.append(Portion(e, self.D0[forms], arrays, stress, tangent, *parts))
        return portions


def gram_products(work: dict[str, np.ndarray], crossed: int, beside: np.ndarray) -> None:
    """Fill even (e, 6, m), Q_ja Q_nb + Q_na Q_jb of each pair (j, n) and each of DIRECTIONS, and odd (e, 3, crossed),
    the difference for a < b and j < n, from left and right (e, 3, m), Q_ja and Q_na. beside (e, m) is overwritten."""
    left, right, even, odd = (work[name] for name in ("left", "right", "even", "odd"))
    np.multiply(left, right, out=even[:, :3])
    even[:, :3] *= 2.0
    for k, (a, b) in enumerate(DIRECTIONS[3:]):
        np.multiply(left[:, a], right[:, b], out=even[:, 3 + k])
        np.multiply(right[:, a], left[:, b], out=beside)
        np.subtract(even[:, 3 + k, :crossed], beside[:, :crossed], out=odd[:, k])
        even[:, 3 + k] += beside


def _work(e: int, n: int) -> dict[str, np.ndarray]:
    """Work arrays of a portion of e elements."""
    pair = pairs(n)
    m, c, moving, moving_c = len(pair.first), pair.crossed, len(pair.moving), pair.moving_crossed
    shapes = {"Q": (n, 3), "gram": (n, n), "D": (moving,), "P": (m,), "left": (3, moving), "right": (3, moving)}
    shapes |= {"even": (6, moving), "odd": (3, moving_c), "odd part": (3, c)}
    return {name: np.empty((e, *shape)) for name, shape in shapes.items()}
