"""How element tangents are stored: each distinct entry once, for a span of the mesh at a time.

Elements are computed in portions that fit the cache and summed in spans that touch neighbouring
unknowns; within a span they are sorted by form, so that few products serve a portion.

Pairs i < k of functions come first, then the pairs i = k.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

PORTION = 128
SPAN = 1024
DIRECTIONS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs (i <= k) of n functions: first and second index (m,), and the pair of each (i, k) (n, n).

    weight (m,): 1/2 where i = k, else 1. crossed: number of pairs with i < k, which come first.
    moving (m1,): the pairs without function 0; moving_crossed: number of those with i < k, again first.
    grams (m1,): their places n i + k in a Gram matrix (n, n).
    """

    first: np.ndarray
    second: np.ndarray
    of: np.ndarray
    weight: np.ndarray
    crossed: int
    moving: np.ndarray
    moving_crossed: int
    grams: np.ndarray


@lru_cache(maxsize=8)
def pairs(n: int) -> Pairs:
    """The pairs of n functions."""
    off = np.triu_indices(n, 1)
    first, second = (np.concatenate([index, np.arange(n)]) for index in off)
    of = np.empty((n, n), dtype=np.intp)
    of[first, second] = of[second, first] = np.arange(len(first))
    crossed, moving = len(off[0]), np.flatnonzero(first)
    weight = np.where(first == second, 0.5, 1.0)
    grams = (first * n + second)[moving]
    return Pairs(first, second, of, weight, crossed, moving, int((moving < crossed).sum()), grams)


def element_order(form_of: np.ndarray, image_of: np.ndarray) -> np.ndarray:
    """Permutation (e,) that puts equal forms side by side within each span of SPAN elements, and equal images of it."""
    return np.lexsort((image_of, form_of, np.arange(len(form_of)) // SPAN))


def packing(n: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Row and column (3 i + a) of each entry of a packed tangent of n functions, and where its second part begins.

    A tangent is symmetric: its distinct entries are the blocks (a, b) of DIRECTIONS for all pairs
    (i <= k), and for a < b also the entries (k, i) of the pairs i < k. A span of elements stores
    the first part of all of them, then the second part of all of them.
    """
    pair = pairs(n)
    c = pair.crossed
    parts = [(pair.first, pair.second, a, b) for a, b in DIRECTIONS]
    parts += [(pair.second[:c], pair.first[:c], a, b) for a, b in DIRECTIONS[3:]]
    rows = np.concatenate([3 * i + a for i, _, a, _ in parts])
    columns = np.concatenate([3 * k + b for _, k, _, b in parts])
    return rows, columns, 6 * len(pair.first)
