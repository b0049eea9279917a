"""Elements that are their own mirror images: functions that are even or odd under each of their mirrors.

A plain rectangular element looks the same from both ends of each of its axes, one with a free edge still along that
edge and through the thickness. Sums and differences of mirrored nodal functions are even or odd under each mirror; the
product of two of them is even or odd in turn, and the energy couples only strains of one parity. So the tensors of
`ancf.quadratic_form` fall into up to eight blocks of an eighth of the pairs, with an eighth of all entries in them.

    S' = T S,   Q' = T Q,   f = T^T f',   K = T^T K' T,   T T^T = 1

The mean of the positions, which the strain does not see, is left out: n functions make n - 1.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from ancf.image import ALONG_X, ALONG_Y, images
from ancf.shape import Plate

Mirrors = tuple[bool, bool, bool]  # whether an element is its own image along x, y and z
NONE: Mirrors = (False, False, False)
FLAT = ("r", "r_x", "r_y", "r_xy")  # kinds of vectors that the mirror along z leaves as they are


class Basis(NamedTuple):
    """T (m, n) and whether each of its functions is odd along x, y and z (m, 3)."""

    T: np.ndarray
    odd: np.ndarray


@lru_cache(maxsize=8)
def basis(shape: Plate) -> Basis:
    """Even and odd functions of a shape. Of those that are even throughout the mean position is left out."""
    own, one, rows, odd = images(shape, square=False), np.eye(len(shape.kinds)), [], []
    mirrors = [own[k].signs[:, None] * one[own[k].order] for k in (ALONG_X, ALONG_Y)]
    for x, y in product((False, True), repeat=2):
        both = (one + (-1) ** x * mirrors[0]) @ (one + (-1) ** y * mirrors[1])
        for i, row in enumerate(both):
            is_mean = shape.kinds[i] == "r" and not (x or y)
            if row.any() and np.flatnonzero(row)[0] == i and not is_mean:
                rows.append(row / np.linalg.norm(row))
                odd.append((x, y, shape.kinds[i] not in FLAT))
    return Basis(np.array(rows), np.array(odd))


class Split(NamedTuple):
    """Pairs (i <= k) of the functions of a basis in blocks of one parity, those with i < k first.

    first, second (m,), of (i, k), weight (m,), crossed: as in `packing.Pairs`. grams (m,): place of each pair in a
    flat Gram matrix. blocks: the slices of one parity; crossed_blocks: of the pairs with i < k alone. parities: that of
    each block, 1, 2 and 4 for odd along x, y and z.
    """

    first: np.ndarray
    second: np.ndarray
    of: np.ndarray
    weight: np.ndarray
    crossed: int
    grams: np.ndarray
    blocks: tuple[slice, ...]
    crossed_blocks: tuple[slice, ...]
    parities: tuple[int, ...]


@lru_cache(maxsize=32)
def split(shape: Plate, mirrors: Mirrors) -> Split:
    """The pairs of a shape's functions by their parity under an element's own mirrors."""
    label = (basis(shape).odd & np.array(mirrors)) @ np.array([1, 2, 4])
    n = len(label)
    first, second = np.triu_indices(n)
    parity = label[first] ^ label[second]
    order = np.lexsort((first == second, parity, parity == 0))  # even pairs last, of which those with i = k
    first, second, parity = first[order], second[order], parity[order]
    of = np.empty((n, n), dtype=np.intp)
    of[first, second] = of[second, first] = np.arange(len(first))
    starts = np.append(0, np.flatnonzero(np.diff(parity)) + 1).tolist()
    crossed = len(first) - n
    blocks = tuple(slice(a, b) for a, b in pairwise([*starts, len(first)]))
    within = tuple(slice(block.start, min(block.stop, crossed)) for block in blocks)
    weight = np.where(first == second, 0.5, 1.0)
    parities = tuple(parity[starts].tolist())
    return Split(first, second, of, weight, crossed, first * n + second, blocks, within, parities)


def share(shape: Plate, mirrors: Mirrors) -> float:
    """Part of a tensor's entries that an element's mirrors leave."""
    pair = split(shape, mirrors)
    return sum((block.stop - block.start) ** 2 for block in pair.blocks) / len(pair.first) ** 2
