"""Which elements of a portion are multiplied together: those that share a form, or have one each.

The products are views of the portion's work arrays, made once; their numbers of rows decide how fast BLAS is.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ancf.packing import pairs

FEW = 3  # rows


def runs_of(form_of: np.ndarray) -> list[tuple[slice, slice]]:
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

    A shared form: (rows, m), (m, n), (rows, n), or (m,), (m, n), (n,) of one row. A form each: (g, rows, m), (g, m, n),
    (g, rows, n).
    """

    vectors: np.ndarray
    tensors: np.ndarray
    out: np.ndarray

    def compute(self) -> None:
        """Fill `out`."""
        np.matmul(*self)


def products(runs: list[tuple[slice, slice]], vectors: np.ndarray, tensors: np.ndarray, out: np.ndarray):
    """Products of all runs for out (e, ..., n) = vectors (e, ..., m) times the element's tensor of tensors (g, m, n).

    Up to FEW rows that share a form are computed one by one: BLAS first copies a matrix for its product with another
    one, which takes as long as multiplying it with three vectors.
    """
    _, m, n = tensors.shape
    found = []
    for e, forms in runs:
        count = forms.stop - forms.start
        shared = (-1,) if count == 1 else (count, -1)
        own = tensors[forms.start] if count == 1 else tensors[forms]
        left, right = vectors[e].reshape(*shared, m), out[e].reshape(*shared, n)
        if count == 1 and len(left) <= FEW:
            found += [Product(row, own, result) for row, result in zip(left, right, strict=True)]
        else:
            found.append(Product(left, own, right))
    return found


class Flipped(NamedTuple):
    """A run of a portion's elements that are images of their form with other signs: those of the entries of their nodal
    vectors (3 i,) and of their packed tangents, upper (6 x 136,) and lower (3 x 120,)."""

    e: slice
    nodal: np.ndarray
    upper: np.ndarray
    lower: np.ndarray


def flipped(signs: np.ndarray) -> list[Flipped]:
    """Runs of elements with signs (e, i) of which some are negative, in order."""
    pair, runs = pairs(signs.shape[1]), []
    starts = np.flatnonzero(np.r_[True, (np.diff(signs, axis=0) != 0).any(axis=1)]).tolist()
    for start, stop in pairwise([*starts, len(signs)]):
        own = signs[start]
        if own.min() < 0:
            of_pairs = own[pair.first] * own[pair.second]
            tangent = np.tile(of_pairs, 6), np.tile(of_pairs[: pair.crossed], 3)
            runs.append(Flipped(slice(start, stop), np.repeat(own, 3), *tangent))
    return runs


def turn(array: np.ndarray, e: slice, signs: np.ndarray) -> None:
    """Multiply the entries of each of the elements `e` by signs, in place: rows as long as all of them are fast."""
    own = array[e].reshape(-1, len(signs))
    own *= signs
