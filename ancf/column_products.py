"""Packed tangents as matrix products of moduli summed over columns (`ancf.moduli`) with products of gradients.

With the functions N of an element's columns and the slots of their factors in z (`ancf.columns`), a tangent falls into
blocks of two factors. Between functions of different factors all products N_is N_kt are tabulated, of nine directions
(a, b). Among those of one factor the pairs i <= k suffice, split into a part even in (P, T), of six directions, and an
odd one, of three.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ancf.columns import Columns
from ancf.moduli import LANES
from ancf.packing import pairs
from ancf.rubber import compiled

CROSSING = ((1, 2), (0, 2), (0, 1))  # parameters P < T, in the order of the six components


@dataclass(frozen=True, eq=False)
class Cross:
    """Functions of two factors in z: table (s t c, n) of N_is N_kt for all n pairs of them.

    at (n,): places of the pairs in `packing`; turned (n,): where the function of the second factor comes first.
    """

    table: np.ndarray
    at: np.ndarray
    turned: np.ndarray

    @property
    def parts(self) -> tuple[tuple[int, np.ndarray], ...]:
        """Number of directions and table of its products: the six of `packing`, then (b, a) of a < b."""
        return ((9, self.table),)

    def place(self, products: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> None:
        """Put products (e, 9, n) into packed tangents."""
        place_cross(products, self.at, self.turned, upper, lower)


@dataclass(frozen=True, eq=False)
class Same:
    """Functions of one factor in z: tables even (6 c or 3 c, n) of pairs i <= k and odd (3 c or c, n') of i < k.

    at (n,): places of the pairs in `packing`, those of i < k first.
    """

    even: np.ndarray
    odd: np.ndarray
    at: np.ndarray

    @property
    def parts(self) -> tuple[tuple[int, np.ndarray], ...]:
        """Number of directions and table of its products: the six of `packing`, and of these a < b."""
        return (6, self.even), (3, self.odd)

    def place(self, even: np.ndarray, odd: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> None:
        """Put products (e, 6, n) and (e, 3, n') into packed tangents."""
        place_same(even, odd, self.at, upper, lower)


@dataclass(frozen=True, eq=False)
class ColumnProducts:
    """All blocks of an element's tangent, in the order of `moduli.add_up`."""

    columns: Columns

    @cached_property
    def N(self) -> np.ndarray:
        """N (3, i, c) of the columns, filled up by zeros to a multiple of LANES columns."""
        return np.pad(self.columns.N, ((0, 0), (0, 0), (0, -self.columns.count % LANES)))

    @property
    def count(self) -> int:
        """Number of columns c, filled up."""
        return self.N.shape[2]

    @cached_property
    def functions(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """By factor in z the functions (i,) that have it, and their N (s, c, i)."""
        every = (np.flatnonzero(self.columns.in_z == number) for number in range(self.columns.in_z.max() + 1))
        return [(own, self.N[: 3 if number else 2, own].swapaxes(1, 2)) for number, own in enumerate(every)]

    @cached_property
    def blocks(self) -> tuple[Cross | Same, ...]:
        """Of each factor in z those with the factors before it, then its own."""
        found = []
        for second in range(len(self.functions)):
            found += [self._cross(first, second) for first in range(second)]
            found.append(self._same(second))
        return tuple(found)

    @cached_property
    def parts(self) -> list[tuple[int, np.ndarray]]:
        """Each table, and the number of directions of its products."""
        return [part for block in self.blocks for part in block.parts]

    @cached_property
    def rows(self) -> np.ndarray:
        """Rows of moduli of each table."""
        return np.array([directions * len(table) // self.count for directions, table in self.parts])

    def tangents(self, A: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> None:
        """Fill packed tangents (e, 6, m) and (e, 3, c) of elements with the moduli A of `moduli.elasticity`."""
        e, ends = len(upper), np.cumsum(self.rows) * len(upper) * self.count // LANES
        own = zip(np.split(A, ends[:-1]), self.parts, strict=True)
        products = ((part.reshape(e * d, -1) @ table).reshape(e, d, -1) for part, (d, table) in own)
        for block in self.blocks:
            block.place(*(next(products) for _ in block.parts), upper, lower)

    def _cross(self, first: int, second: int) -> Cross:
        (i, N), (k, other) = self.functions[first], self.functions[second]
        table = np.einsum("sci,tck->stcik", N, other).reshape(-1, len(i) * len(k))
        i, k = (index.ravel() for index in np.broadcast_arrays(i[:, None], k))
        return Cross(table, pairs(len(self.columns.in_z)).of[i, k], i > k)

    def _same(self, number: int) -> Same:
        own, N = self.functions[number]
        pair = pairs(len(own))
        one, other = N[..., pair.first], N[..., pair.second]
        even, odd = list(one * other), []
        for p, t in CROSSING if number else CROSSING[2:]:
            forth, back = one[p] * other[t], one[t] * other[p]
            even.append(forth + back)
            odd.append((forth - back)[:, : pair.crossed])
        at = pairs(len(self.columns.in_z)).of[own[pair.first], own[pair.second]]
        return Same(np.concatenate(even), np.concatenate(odd), at)


@compiled
def place_cross(products, at, turned, upper, lower):
    """Put products (e, 9, n) into upper (e, 6, m) and lower (e, 3, c)."""
    for e in range(len(products)):
        for d in range(3):
            for n in range(len(at)):
                upper[e, d, at[n]] = products[e, d, n]
        for d in range(3, 6):
            for n in range(len(at)):
                one, other = products[e, d, n], products[e, d + 3, n]
                if turned[n]:
                    one, other = other, one
                upper[e, d, at[n]], lower[e, d - 3, at[n]] = one, other


@compiled
def place_same(even, odd, at, upper, lower):
    """Put products even (e, 6, n) and odd (e, 3, n') into upper (e, 6, m) and lower (e, 3, c)."""
    crossed = odd.shape[2]
    for e in range(len(even)):
        for d in range(6):
            for n in range(crossed if d > 2 else 0, len(at)):
                upper[e, d, at[n]] = even[e, d, n]
        for d in range(3):
            for n in range(crossed):
                one, other = even[e, d + 3, n], odd[e, d, n]
                upper[e, d + 3, at[n]], lower[e, d, at[n]] = one + other, one - other
