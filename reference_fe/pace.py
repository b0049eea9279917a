"""Step lengths that follow what the steps show: halved where a step was poor, doubled where it was easy.

`equal_steps` halves only what fails; in a `march` each step is judged. Every length is a stretch between two
stops divided by a power of two, so a march has few distinct lengths (a factorisation serves one) and meets
each stop exactly. A length is doubled only after some easy steps in a row, and where the doubled step still
ends on its own grid.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference_fe.newton import NewtonFailure

HALVINGS = 16  # of the largest step, down to the smallest one
FAILURES = 8  # steps in a row without an equilibrium
ROUND_OFF = 1e-9  # relative, of lengths


@dataclass(frozen=True)
class Trial:
    """What became of a step: the state behind it where it is accepted, the one before where it is rejected.

    halvings: how often the next step should be halved; -1 where this one was easy. failure: why no
    equilibrium was found, if that is why it is rejected.
    """

    state: Any
    accepted: bool
    halvings: int
    failure: NewtonFailure | None = None


Attempt = Callable[[Any, float], Trial]


@dataclass
class Pace:
    """The step length that is wanted now and a record of those made so far (s).

    largest: no step is longer. stops: increasing times besides the end of a march where a step must end.
    patience: easy steps in a row before a longer one.
    """

    largest: float
    stops: tuple[float, ...] = ()
    patience: int = 3
    wanted: float = math.inf
    calm: int = 0
    failures: int = 0
    rejected: int = 0
    shortest: float = math.inf
    longest: float = 0.0

    @property
    def smallest(self) -> float:
        """The least length that a step is shortened to (s)."""
        return self.largest / 2**HALVINGS

    def halvings(self, span: float) -> int:
        """How often a stretch (s) must be halved for a step of at most the wanted length."""
        if self.wanted >= span:
            return 0
        return min(HALVINGS, math.ceil(math.log2(span / self.wanted) - ROUND_OFF))

    def refuse(self, trial: Trial, length: float) -> None:
        """Shorten the next step after a rejected one. Raises its failure, or NewtonFailure "step_too_small"."""
        self.rejected += 1
        self.calm = 0
        self.failures = self.failures + 1 if trial.failure else 0
        too_small = length <= self.smallest * (1 + ROUND_OFF)
        if trial.failure and (too_small or self.failures == FAILURES):
            raise trial.failure
        if too_small:
            raise NewtonFailure("step_too_small", f"the error of a step of {length:.3g} s is above what is allowed")
        self.wanted = max(length / 2**trial.halvings, self.smallest)

    def accept(self, trial: Trial, length: float, even: bool) -> None:
        """Choose the next step after an accepted one; `even`: whether one of twice the length may begin now."""
        self.failures = 0
        self.shortest, self.longest = min(self.shortest, length), max(self.longest, length)
        self.calm = self.calm + 1 if trial.halvings < 0 else 0
        if trial.halvings > 0:
            self.wanted = max(length / 2**trial.halvings, self.smallest)
        elif self.calm >= self.patience and even:
            self.wanted, self.calm = 2 * length, 0


def equal_steps(state: Any, until: float, largest: float, step: Callable[[Any, float], Any]) -> tuple[Any, int]:
    """The state at `until` by equal steps no longer than `largest`, and how many were made; step(state, time) -> state.

    A step that raises NewtonFailure is made in halves, and those again. Raises that of FAILURES in a row.
    """

    def attempt(state: Any, time: float) -> Trial:
        try:
            return Trial(step(state, time), True, -1)
        except NewtonFailure as failure:
            return Trial(state, False, 1, failure)

    start, made = state.time, 0
    count = _count(until - start, largest)
    for k in range(1, count + 1):
        pace = Pace(largest, patience=1)
        state, more = _stretch(pace, state, start + (until - start) * k / count, attempt)
        made += more
    return state, made


def _count(span: float, largest: float) -> int:
    """Number of equal steps over a span, none longer than the largest (s)."""
    return max(1, math.ceil(span / largest - ROUND_OFF))


def march(pace: Pace, state: Any, until: float, attempt: Attempt) -> tuple[Any, int]:
    """The state at `until` and how many steps were accepted; attempt(state, time) tries one step to a time.

    Raises NewtonFailure: that of a step which fails however short it is, or "step_too_small".
    """
    made = 0
    slack = ROUND_OFF * pace.largest
    ends = [stop for stop in pace.stops if state.time + slack < stop < until - slack]
    for end in [*ends, until]:
        for stop in np.linspace(state.time, end, _count(end - state.time, pace.largest) + 1)[1:]:
            state, more = _stretch(pace, state, float(stop), attempt)
            made += more
    return state, made


def _stretch(pace: Pace, state: Any, end: float, attempt: Attempt) -> tuple[Any, int]:
    """The state at `end`, at most the largest step away; `at` counts in the smallest parts of the stretch."""
    start, span, parts, at, made = state.time, end - state.time, 2**HALVINGS, 0, 0
    while at < parts:
        width = parts >> pace.halvings(span)
        target = end if at + width == parts else start + span * ((at + width) / parts)
        trial, length = attempt(state, target), span * (width / parts)
        if not trial.accepted:
            pace.refuse(trial, length)
            continue
        state, at, made = trial.state, at + width, made + 1
        pace.accept(trial, length, at % (2 * width) == 0)
    return state, made
