"""Dead loads with piecewise-linear histories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Load:
    """A constant generalised force (3 v,) times a factor that is linear between the points `history` (t, factor)."""

    force: np.ndarray
    history: tuple[tuple[float, float], ...]

    def factor(self, t: float) -> float:
        """Factor at time t; before the first and after the last point it keeps their values."""
        times, values = zip(*self.history, strict=True)
        return float(np.interp(t, times, values))


def brought_up(load: Load, t: float) -> Load:
    """The load's value at time t, brought up linearly from nothing over a parameter from 0 to 1."""
    return Load(load.factor(t) * load.force, ((0.0, 0.0), (1.0, 1.0)))


def spread(row: np.ndarray, force: Sequence[float], history) -> Load:
    """Load of a total force (3,) in N spread as the functional `row` (v,)."""
    return Load(np.outer(row, force).ravel(), tuple(history))


def gravity(mass_row: np.ndarray, acceleration: Sequence[float], history) -> Load:
    """Load of an acceleration (3,) on all mass; mass_row (v,) in kg is the integral of rho S."""
    return Load(np.outer(mass_row, acceleration).ravel(), tuple(history))
