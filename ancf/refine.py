"""Where unknowns are worth their cost: grid lines on groove edges, and layer functions chosen by an indicator.

Indicator. K u = F is the linear response to a load from rest with the nodal vectors in use. A further one, of
residual r (3,) and own stiffness k (3, 3), would add r^T k^-1 r / 2 to the energy of the response if it alone
were free: the energy norm of the error falls by so much, and the deflection under the load grows by twice that
over the load. The vectors of the largest gains are taken into use in passes, each of which solves anew, until
what the others promise is small.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from ancf.assembly import Pattern
from ancf.feature import Feature
from ancf.layer import KIND
from ancf.linear_solver import LinearSolver
from ancf.system import System

NEAR = 0.5  # of the even spacing: an even line this near to a band's edge gives way to it
WIDE = 4  # times the distance of a line beside an edge: so far away is the next edge at least
BULK = 0.5  # of the promised gain: what one pass takes into use
EVEN = 1e-6  # relative: gains this near to each other are both taken
LEAST = 1e-10  # of the largest stiffness: less is none


def fitted(
    span: tuple[float, float], count: int, edges: Sequence[float], beside: Sequence[float] = (), apart: float = 0.0
) -> np.ndarray:
    """Grid lines: the ends of `span`, the edges inside it, lines beside them, and `count` even intervals.

    Edges at most `apart` from each other or an end share a line. A line at the distance d `beside` an edge is left
    out where the next edge is nearer than WIDE d, an even line where another one is nearer than half its spacing.

    >>> fitted((0.0, 1.0), 4, [0.2, 0.3, 0.7, 0.8], [0.04]).round(12).tolist()
    [0.0, 0.16, 0.2, 0.3, 0.34, 0.5, 0.66, 0.7, 0.8, 0.84, 1.0]
    """
    first, last = span
    kept = [first]
    for edge in sorted(edges):
        if edge - kept[-1] > apart and last - edge > apart:
            kept.append(edge)
    lines = [*kept, last]
    for low, high in pairwise([*kept, last]):
        near = [distance for distance in beside if high - low >= WIDE * distance * (1 - EVEN)]
        lines += [low + distance for distance in near if low > first]
        lines += [high - distance for distance in near if high < last]
    fixed = np.unique(lines)
    even, near = np.linspace(first, last, count + 1), NEAR * (last - first) / count
    return np.sort([*fixed, *(line for line in even if np.abs(fixed - line).min() >= near * (1 - EVEN))])


def band_edges(bands: Sequence[Feature], axis: int) -> list[float]:
    """Edges and finite ends of the bands on an axis, the least and greatest coordinates of outlines."""
    return [float(limit) for band in bands for limit in band.limits(axis) if np.isfinite(limit)]


def chosen(trial: System, share: float, inertia: float = 0.0) -> np.ndarray:
    """Nodal vectors (v,), whether each layer vector of the trial system is worth it (False for all others).

    share: the part of the gain promised at first that has to be realised or promised no longer. inertia
    (1/s2): this times the mass is added to the stiffness; a plate without supports needs some.
    """
    problem = _Problem(trial, inertia)
    found = np.zeros(len(problem.layers), dtype=bool)
    first = None
    while not found.all():
        gains = np.where(found, 0.0, problem.gains(found))
        total = gains.sum()
        first = total if first is None else first
        if total <= (1 - share) * first or total == 0:
            break
        found |= _largest(gains, BULK * total)
    worth = np.zeros(len(trial.body.mesh.kinds), dtype=bool)
    worth[problem.layers[found]] = True
    return worth


def _largest(gains: np.ndarray, wanted: float) -> np.ndarray:
    """Which gains add up to at least the wanted sum, the largest first; equal ones go together."""
    order = np.argsort(-gains)
    needed = min(int(np.searchsorted(np.cumsum(gains[order]), wanted)), len(gains) - 1)
    return (gains >= gains[order[needed]] * (1 - EVEN)) & (gains > 0)


def _peak(history: Sequence[tuple[float, float]]) -> float:
    """Time of the largest factor."""
    return max(history, key=lambda point: abs(point[1]))[0]


class _Problem:
    """Linear response of a trial system, by sets of free layer vectors."""

    def __init__(self, trial: System, inertia: float):
        mesh, sums = trial.body.mesh, trial.assembly
        rest = mesh.vectors.ravel()
        values = trial.tangent(rest) + inertia * trial.mass_values
        self.K = sums.pattern.full(values).tocsr()
        peaks = [load.force * load.factor(_peak(load.history)) for load in trial.loads]
        peaks += [moment.force(rest, _peak(moment.history)) for moment in (*trial.moments, *trial.pressures)]
        self.F = np.array(peaks).reshape(len(peaks), len(rest)).T[sums.free]
        unknown_of = sums.unknown_of.reshape(-1, 3)
        is_layer = (mesh.kinds == KIND) & np.all(unknown_of >= 0, axis=1)
        self.blocks = self._blocks(unknown_of[is_layer])
        stiff = np.linalg.eigvalsh(self.blocks)
        some = stiff[:, 0] > LEAST * stiff[:, -1]
        self.layers, self.blocks = np.flatnonzero(is_layer)[some], self.blocks[some]
        self.unknowns = unknown_of[self.layers]
        self.base = np.setdiff1d(np.arange(len(sums.free)), unknown_of[(mesh.kinds == KIND)])

    def _blocks(self, unknowns: np.ndarray) -> np.ndarray:
        """Own stiffness (n, 3, 3) of layer vectors with unknowns (n, 3)."""
        if not len(unknowns):
            return np.empty((0, 3, 3))
        rows, columns = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
        return np.asarray(self.K[rows.ravel(), columns.ravel()]).reshape(-1, 3, 3)

    def gains(self, found: np.ndarray) -> np.ndarray:
        """r^T k^-1 r / 2 (n,) of every layer vector where those found are in use, summed over the loads."""
        free = np.sort(np.concatenate([self.base, self.unknowns[found].ravel()]))  # in the mesh's order: a narrow band
        K = sp.tril(self.K[free][:, free], format="csc")
        K.sort_indices()
        u = np.zeros_like(self.F)
        u[free] = LinearSolver(Pattern(K.indptr, K.indices)).factorise(K.data)(self.F[free])
        r = (self.F - self.K @ u)[self.unknowns]
        return 0.5 * np.einsum("nal,nal->n", r, np.linalg.solve(self.blocks, r))
