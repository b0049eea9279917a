"""The quadratic forms of `ancf.quadratic_form` in blocks of one parity: see `ancf.parity`.

Fewer operations, and less to read: a form of 24 functions takes 1.9 MB whole and 0.2 MB where all three mirrors hold.
Against that there are more, smaller products, and tangents are brought back to the nodal vectors element by element.
CPU time (microseconds per element) on one busy core, whole and split in turn:

    3 x 3 enriched, free edges      share 0.28     force 22.3, 16.2     tangent 127, 81
    8 x 8 enriched, free edges      share 0.18     force 10.3, 6.0      tangent 74, 61
    8 x 8 enriched, grooved         share 0.39     force 11.7, 7.7      tangent 77, 74
    16 x 16 conforming              share 0.14     force 2.2, 3.8       tangent 18, 27

Tensors of 16 functions stay in the cache and are multiplied as fast as BLAS can: they are not worth splitting.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ancf.element import Integrand, Terms
from ancf.fold import fold
from ancf.material import SaintVenantKirchhoff
from ancf.packing import SPAN, pairs
from ancf.parity import Mirrors, Split, basis, share, split
from ancf.products import Product
from ancf.quadratic_form import ALL, Portioned, from_first_node, gram_products, integrate
from ancf.shape import Plate

LARGE = 16  # functions: more than that are split
WORTH = 0.5  # share of entries that elements have on average, at most, where they are
FEWER = 32  # elements of a portion: their tangents before and after T^T K' T fit the cache


@dataclass(frozen=True, eq=False)
class SplitForm:
    """Tensors of one element shape, block by block: as in `quadratic_form.QuadraticForm`, on all pairs of `split`.

    gram0 (m, m): Gram matrix of T times the reference vectors.
    """

    mirrors: Mirrors
    gram0: np.ndarray
    stress: tuple[np.ndarray, ...]
    symmetric: tuple[np.ndarray, ...]
    antisymmetric: tuple[np.ndarray, ...]


def split_form(
    parts: Integrand, material: SaintVenantKirchhoff, vectors: np.ndarray, shape: Plate, mirrors: Mirrors
) -> SplitForm:
    """Integrate A over one undeformed element with reference nodal vectors (i, 3), its own image in `mirrors`."""
    pair, T = split(shape, mirrors), basis(shape).T
    few, parities = fold(parts, mirrors)
    acting = [ALL if parities is None else parities == own for own in pair.parities]
    A = integrate(replace(few, G=T @ few.G), material, pair, list(zip(pair.blocks, acting, strict=True)))
    Q = T @ from_first_node(vectors[None], shape.positions)[0]
    found = []
    for block, crossed, (straight, swapped) in zip(
        pair.blocks, pair.crossed_blocks, _exchanged(shape, mirrors), strict=True
    ):
        weight, count = pair.weight[block, None], crossed.stop - crossed.start
        straight, swapped = A.take(straight), A.take(swapped)
        odd = (straight - swapped)[:count, :count] / 2
        found.append((weight * A[block, block], (straight + swapped) * (weight / 2), odd))
    return SplitForm(mirrors, Q @ Q.T, *zip(*found, strict=True))


@lru_cache(maxsize=8)
def _exchanged(shape: Plate, mirrors: Mirrors) -> list[tuple[np.ndarray, np.ndarray]]:
    """By block, places in A of A_ijkn and A_inkj for its pairs (i, k) and (j, n)."""
    pair, found = split(shape, mirrors), []
    m = len(pair.first)
    for block in pair.blocks:
        j, n = pair.first[block], pair.second[block]
        i, k = j[:, None], n[:, None]
        found.append((pair.of[i, j] * m + pair.of[k, n], pair.of[i, n] * m + pair.of[k, j]))
    return found


def is_split(shape: Plate, mirrors: Sequence[Mirrors]) -> bool:
    """Whether elements that have these mirrors each are cheaper as split forms."""
    return len(shape.kinds) > LARGE and sum(share(shape, own) for own in mirrors) <= WORTH * len(mirrors)


class Run(NamedTuple):
    """Consecutive elements of a portion that share a form, and its pairs; of, crossed (m m,): `Split.of`, where i = k
    another one."""

    e: slice
    pair: Split
    of: np.ndarray
    crossed: np.ndarray


@dataclass(frozen=True, eq=False)
class Portion:
    """Elements `e` that are computed together: see `quadratic_form.Portion`. turned (e, 1, i, i): the signs of the
    entries of their tangents, None where all are positive."""

    e: slice
    gram0: np.ndarray
    work: dict[str, np.ndarray]
    runs: list[Run]
    stress: list[Product]
    tangent: list[Product]
    packed: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    signs: np.ndarray | None
    turned: np.ndarray | None


@dataclass(frozen=True, eq=False)
class SplitFormElements(Portioned):
    """Elements evaluated through their split forms; see `quadratic_form.QuadraticElements`, whose interface it has."""

    forms: tuple[SplitForm, ...]
    form_of: np.ndarray
    signs: np.ndarray
    shape: Plate

    def energy(self, Q: np.ndarray) -> float:
        """Strain energy (J) of all elements with nodal vectors Q (e, i, 3)."""
        total = 0.0
        for portion in self._portions:
            self._stress(Q, portion)
            weight = portion.runs[0].pair.weight  # of every form: pairs i = k come last
            total += 0.5 * float(np.vdot(portion.work["D"] * weight, portion.work["P"]))
        return total

    def force(self, Q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (e, i, 3). more: as in `QuadraticElements.force`."""
        T, force = self._T, np.empty_like(Q)
        for portion in self._portions:
            self._stress(Q, portion, more)
            work = portion.work
            gram = work["gram"].reshape(-1, len(T) ** 2)
            for run in portion.runs:
                work["P"][run.e].take(run.of, axis=1, out=gram[run.e], mode="clip")
            rows = np.matmul(work["rows"], work["gram"], out=work["f"]).reshape(-1, len(T))
            own = np.matmul(rows, T, out=work["nodal"].reshape(-1, T.shape[1])).reshape(-1, 3, T.shape[1])
            if portion.signs is not None:
                own *= portion.signs
            force[portion.e] = own.swapaxes(1, 2)
        return force

    def _stress(self, Q: np.ndarray, portion: Portion, more: Terms = ()) -> None:
        """Fill rows (T Q)^T, D - D0 and P of one portion."""
        work, at = portion.work, self._at
        if at is not None and not more and (at == Q).all():
            return
        rows, gram = self._rows(Q, portion, work["rows"]), work["gram"]
        np.matmul(rows.swapaxes(1, 2), rows, out=gram)
        for c, X in more:
            other = self._rows(X, portion, np.empty_like(rows))
            gram += c * (other.swapaxes(1, 2) @ other)
        gram -= portion.gram0
        flat = gram.reshape(len(gram), -1)
        for run in portion.runs:
            flat[run.e].take(run.pair.grams, axis=1, out=work["D"][run.e], mode="clip")
        for product in portion.stress:
            np.matmul(*product)
        if at is not None:
            np.copyto(at, np.nan if more else Q)

    @property
    def positions(self) -> tuple[int, ...]:
        """Functions of positions."""
        return self.shape.positions

    @cached_property
    def _T(self) -> np.ndarray:
        return basis(self.shape).T

    def _rows(self, Q: np.ndarray, portion: Portion, out: np.ndarray) -> np.ndarray:
        """Fill out (e, 3, m) with T times a portion's nodal vectors as their forms know them, from the first node."""
        own, T = portion.work["nodal"], self._T
        np.copyto(own, Q[portion.e].swapaxes(1, 2))
        own[..., self._places] -= own[..., :1]
        if portion.signs is not None:
            own *= portion.signs
        np.matmul(own.reshape(-1, T.shape[1]), T.T, out=out.reshape(-1, len(T)))
        return out

    def _tangent(self, portion: Portion) -> None:
        """Fill the packed tangents of one portion from its rows and P."""
        T, work = self._T, portion.work
        n, crossed = T.shape[1], portion.runs[0].pair.crossed
        rows = work["rows"]
        for run in portion.runs:
            for name, chosen in (("left", run.pair.first), ("right", run.pair.second)):
                rows[run.e].take(chosen, axis=2, out=work[name][run.e], mode="clip")
        gram_products(work, crossed, work["beside"])
        for product in portion.tangent:
            np.matmul(*product)
        work["upper"][:, :3] += work["P"][:, None]
        whole, half = work["whole"], work["half"]
        for run in portion.runs:
            work["upper"][run.e].take(run.of, axis=2, out=whole[run.e], mode="clip")
            work["lower"][run.e].take(run.crossed, axis=2, out=half[run.e], mode="clip")
        half *= _antisymmetric(len(T))
        whole[:, 3:] += half
        np.matmul(whole.reshape(-1, len(T)), T, out=work["T"])
        K = np.matmul(T.T, work["T"].reshape(-1, 6, len(T), n), out=work["K"])
        if portion.turned is not None:
            K *= portion.turned
        K = K.reshape(-1, 6, n * n)
        above, below = _packed(n)
        K.take(above, axis=2, out=portion.upper, mode="clip")
        K[:, 3:].take(below, axis=2, out=portion.lower, mode="clip")

    @cached_property
    def _portions(self) -> list[Portion]:
        """Portions in order; those of equal size share their work arrays, spans of equal size their packed ones."""
        n, count = self.signs.shape[1], len(self.form_of)
        m, c = len(pairs(n).first), pairs(n).crossed
        work = {e: _work(e, n) for e in {min(FEWER, count), count % FEWER} if e}
        packed = {e: np.empty(e * (6 * m + 3 * c)) for e in {min(SPAN, count), count % SPAN} if e}
        portions = []
        for start in range(0, count, FEWER):
            e, first = slice(start, min(start + FEWER, count)), start - start % SPAN
            span = packed[min(SPAN, count - first)]
            size, own = len(span) // (6 * m + 3 * c), slice(start - first, e.stop - first)
            upper, lower = span[: size * 6 * m].reshape(size, 6, m), span[size * 6 * m :].reshape(size, 3, c)
            arrays, signs = work[e.stop - start], self.signs[e, None]
            flips = bool(np.any(signs < 0))
            runs, stress, tangent = self._runs(self.form_of[e], arrays)
            gram0 = np.stack([self.forms[g].gram0 for g in self.form_of[e]])
            turned = (signs * signs.swapaxes(1, 2))[:, None] if flips else None
            parts = span, upper[own], lower[own], signs if flips else None, turned
            portions.append(Portion(e, gram0, arrays, runs, stress, tangent, *parts))
        return portions

    def _runs(self, form_of: np.ndarray, work: dict[str, np.ndarray]) -> tuple[list[Run], list[Product], list[Product]]:
        """Runs of elements of one form, and the products for their stress and their tangents."""
        runs, stress, tangent = [], [], []
        for start, stop in pairwise([0, *np.flatnonzero(np.diff(form_of)) + 1, len(form_of)]):
            form, e = self.forms[form_of[start]], slice(int(start), int(stop))
            pair = split(self.shape, form.mirrors)
            of = pair.of.ravel()
            runs.append(Run(e, pair, of, np.minimum(of, pair.crossed - 1)))
            stress += _products(work["D"][e], form.stress, pair.blocks, work["P"][e])
            tangent += _products(work["even"][e], form.symmetric, pair.blocks, work["upper"][e])
            tangent += _products(work["odd"][e], form.antisymmetric, pair.crossed_blocks, work["lower"][e])
        return runs, stress, tangent


def _products(vectors: np.ndarray, tensors: Sequence[np.ndarray], blocks: Sequence[slice], out: np.ndarray):
    """Products of vectors (e, ..., m) with each block, for the same columns of out (e, ..., m)."""
    left, right = vectors.reshape(-1, vectors.shape[-1]), out.reshape(-1, out.shape[-1])
    return [
        Product(left[:, block], own, right[:, block]) for block, own in zip(blocks, tensors, strict=True) if own.size
    ]


@lru_cache(maxsize=8)
def _antisymmetric(n: int) -> np.ndarray:
    """1 above the diagonal of an n x n matrix, -1 below it (n n,)."""
    return (np.triu(np.ones((n, n)), 1) - np.tril(np.ones((n, n)), -1)).ravel()


@lru_cache(maxsize=8)
def _packed(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places in a flat n x n block of the packed entries above (m,) and below (c,) its diagonal; see `packing`."""
    pair = pairs(n)
    return pair.first * n + pair.second, (pair.second * n + pair.first)[: pair.crossed]


def _work(e: int, n: int) -> dict[str, np.ndarray]:
    """Work arrays of a portion of e elements of n functions."""
    m = n - 1
    pair = pairs(m)
    count, c = len(pair.first), pair.crossed
    shapes = {"nodal": (3, n), "rows": (3, m), "f": (3, m), "gram": (m, m), "D": (count,), "P": (count,)}
    shapes |= {name: (3, count) for name in ("left", "right")} | {name: (6, count) for name in ("even", "upper")}
    shapes |= {"beside": (count,), "odd": (3, c), "lower": (3, c), "whole": (6, m * m), "half": (3, m * m)}
    shapes |= {"K": (6, n, n)}
    return {name: np.empty((e, *shape)) for name, shape in shapes.items()} | {"T": np.empty((e * 6 * m, n))}
