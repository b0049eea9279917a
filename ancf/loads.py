"""Loads with piecewise-linear histories: dead ones, and moments that turn with the edge they act on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Load:
    """A constant generalised force (3 v,) times a factor that is linear between the points `history` (t, factor)."""

    force: np.ndarray
    history: tuple[tuple[float, float], ...]

    def factor(self, t: float) -> float:
        """Factor at time t; before the first and after the last point it keeps their values."""
        return factor_at(self.history, t)


@dataclass(frozen=True, eq=False)
class EdgeMoment:
    """A moment (3,) in N m, times its history, on an edge whose director is d = row @ vectors, row (v,).

    With the moment's size M and axis a, a unit vector, and d' the component of d normal to a, the potential is
    -M times the angle of d' about a. Force and stiffness by d:

        g = M (a x d') / d'^2,    g_d = -M [(a x d') d'^T + d' (a x d')^T] / d'^4.
    """

    row: np.ndarray
    moment: np.ndarray
    history: tuple[tuple[float, float], ...]

    def factor(self, t: float) -> float:
        """As that of `Load`."""
        return factor_at(self.history, t)

    def force(self, q: np.ndarray, t: float) -> np.ndarray:
        """Generalised force (3 v,) at the components q (3 v,)."""
        lever, turned = self._levers(q)
        return np.outer(self.row, self.factor(t) * turned / (lever @ lever)).ravel()

    def stiffness(self, q: np.ndarray, t: float) -> np.ndarray:
        """Derivative (3, 3) of the force by the director."""
        lever, turned = self._levers(q)
        return -self.factor(t) * (np.outer(turned, lever) + np.outer(lever, turned)) / (lever @ lever) ** 2

    def _levers(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """d' and M a x d' (3,)."""
        d, axis = self.row @ q.reshape(-1, 3), self.moment / np.linalg.norm(self.moment)
        lever = d - axis * (axis @ d)
        return lever, np.cross(self.moment, lever)


def factor_at(history: tuple[tuple[float, float], ...], t: float) -> float:
    """Factor of a history at time t; before the first and after the last point it keeps their values."""
    if t <= history[0][0]:
        return history[0][1]
    for (t0, before), (t1, after) in pairwise(history):
        if t <= t1:
            return before + (t - t0) / (t1 - t0) * (after - before)
    return history[-1][1]


def brought_up(load: Any, t: float) -> Any:
    """A load whose value is that of `load` at time t, brought up linearly from nothing over a parameter from 0 to 1."""
    return replace(load, history=((0.0, 0.0), (1.0, load.factor(t))))


def spread(row: np.ndarray, force: Sequence[float], history) -> Load:
    """Load of a total force (3,) in N spread as the functional `row` (v,)."""
    return Load(np.outer(row, force).ravel(), tuple(history))


def gravity(mass_row: np.ndarray, acceleration: Sequence[float], history) -> Load:
    """Load of an acceleration (3,) on all mass; mass_row (v,) in kg is the integral of rho S."""
    return Load(np.outer(mass_row, acceleration).ravel(), tuple(history))


def pressure(row: np.ndarray, size: float, history) -> Load:
    """Load of a pressure (Pa); row (v, 3) is the integral of S times the inward normal."""
    return Load(size * row.ravel(), tuple(history))
