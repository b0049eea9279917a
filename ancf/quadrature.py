"""Quadrature rules that state what they promise; rules compose by product, mapping and union."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from numpy.typing import ArrayLike

NO_PROMISE = -1


@dataclass(frozen=True, eq=False)
class Rule:
    """Integral of f over a domain ~ sum over q of weights[q] f(points[q]).

    points (q, d), weights (q,). degree: every polynomial of at most this degree in each of the d
    coordinates is integrated exactly; NO_PROMISE where not even a constant is.
    """

    points: np.ndarray
    weights: np.ndarray
    degree: int

    def __post_init__(self):
        if self.points.ndim != 2 or self.weights.shape != self.points.shape[:1]:
            raise ValueError(f"points {self.points.shape} and weights {self.weights.shape} do not belong together")


@lru_cache(maxsize=64)
def gauss(count: int) -> Rule:
    """Gauss-Legendre rule of `count` points on [-1, 1], exact to degree 2 count - 1."""
    if count < 1:
        raise ValueError(f"a Gauss rule needs at least one point, got {count}")
    points, weights = np.polynomial.legendre.leggauss(count)
    points.flags.writeable = weights.flags.writeable = False
    return Rule(points[:, None], weights, 2 * count - 1)


def tensor(*rules: Rule) -> Rule:
    """Product rule; the coordinates of the first rule vary slowest."""
    return reduce(_product, rules)


def _product(first: Rule, second: Rule) -> Rule:
    q, p = len(first.weights), len(second.weights)
    points = np.hstack([np.repeat(first.points, p, axis=0), np.tile(second.points, (q, 1))])
    return Rule(points, np.outer(first.weights, second.weights).ravel(), min(first.degree, second.degree))


def onto_cell(rule: Rule, cell: ArrayLike) -> Rule:
    """The rule of [-1, 1]^d mapped onto the box cell (d, 2) = ((x0, x1), (y0, y1), ...).

    Raises ValueError where the cell has another dimension or a reversed or empty side.
    """
    low, high = np.asarray(cell, dtype=float).T
    if low.shape != rule.points.shape[1:]:
        raise ValueError(f"a rule in {rule.points.shape[1]} dimensions does not fit the cell {cell}")
    if not np.all(low < high):
        raise ValueError(f"the cell {cell} has a side without length")
    half = (high - low) / 2
    return Rule((low + high) / 2 + half * rule.points, rule.weights * half.prod(), rule.degree)


def join(*rules: Rule) -> Rule:
    """Rule of the union of disjoint domains; it promises what its weakest part does."""
    points = np.concatenate([rule.points for rule in rules])
    weights = np.concatenate([rule.weights for rule in rules])
    return Rule(points, weights, min(rule.degree for rule in rules))
