"""Fewer points for the same moments: Caratheodory's theorem as an algorithm.

Of many points with positive weights some few, with other positive weights, have the same m moments: where more
points than moments are left, a combination of their weights has no moments, and added until the first weight
vanishes it takes a point away. In groups of points, which are halved round by round, this costs few small singular
value decompositions (Litterer and Lyons, High order recombination and an application to cubature on Wiener space,
2012).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander2d

ZERO = 1e-14  # of the largest singular value


def fewer(points: np.ndarray, weights: np.ndarray, degree: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers and new weights of some points (q, 2) that integrate every x^i y^j, i and j up to `degree`, as all do.

    At most as many as there are such products are left.
    """
    count = (degree[0] + 1) * (degree[1] + 1)
    if len(weights) <= count:
        return np.arange(len(weights)), weights
    low, high = points.min(axis=0), points.max(axis=0)
    local = 2 * (points - low) / np.where(high > low, high - low, 1.0) - 1
    chosen, kept, portion = np.empty(0, dtype=int), np.empty(0), 64 * count
    for start in range(0, len(weights), portion):  # so that the moments of all points need not be held at once
        own = np.arange(start, min(start + portion, len(weights)))
        chosen, kept = np.concatenate([chosen, own]), np.concatenate([kept, weights[own]])
        moments = legvander2d(*local[chosen].T, list(degree))
        some, kept = _recombined(moments, kept)
        chosen = chosen[some]
    return chosen, kept


def _recombined(moments: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the points that stay, at most m, and their weights, for moments (q, m)."""
    index, count = np.arange(len(weights)), moments.shape[1]
    while len(index) > count:
        groups = np.array_split(np.arange(len(index)), min(2 * count, len(index)))
        starts = np.array([group[0] for group in groups])
        mass = np.add.reduceat(weights, starts)
        means = np.add.reduceat(weights[:, None] * moments[index], starts, axis=0) / mass[:, None]
        new = _eliminated(means, mass)
        factor = np.repeat(new / mass, [len(group) for group in groups])
        stays = factor > 0
        if np.all(stays):
            break
        index, weights = index[stays], (weights * factor)[stays]
    return index, weights


def _eliminated(moments: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weights (q,), at most m of which are not zero, with the same moments (q, m)."""
    _, singular, rows = np.linalg.svd(moments.T, full_matrices=True)
    null = rows[np.count_nonzero(singular > ZERO * singular[0]) :].T.copy()
    weights, alive = weights.copy(), np.ones(len(weights), dtype=bool)
    for last in range(null.shape[1] - 1, -1, -1):
        v = null[:, last]
        rising = alive & (v > 0)
        if not np.any(rising):
            v, rising = -v, alive & (v < 0)
        ratio = np.full(len(v), np.inf)
        np.divide(weights, v, out=ratio, where=rising)
        gone = int(np.argmin(ratio))
        weights = np.maximum(weights - ratio[gone] * v, 0.0)
        weights[gone], alive[gone] = 0.0, False
        pivot = int(np.argmax(np.abs(null[gone, : last + 1])))
        null[:, [pivot, last]] = null[:, [last, pivot]]
        null[:, :last] -= np.outer(null[:, last], null[gone, :last] / null[gone, last])
        null[gone, :last] = 0.0
    return weights
