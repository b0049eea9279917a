"""Static equilibrium f(u) = p by load steps; time is only the parameter of the load histories."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reference_fe.newton import Equation, Memory, NewtonFailure, solve, solve_mixed
from reference_fe.pace import Attempt, Trial
from reference_fe.system import System

HALVINGS = 8
EASY, HARD = 10, 30  # iterations of a load step


@dataclass(frozen=True)
class Balance:
    """Equilibrium at one load parameter `time`: u (f, 3) in m, applied force (f, 3) in N, energies (J)."""

    time: float
    u: np.ndarray
    applied: np.ndarray
    strain: float
    external: float


def begin(system: System, time: float = 0.0) -> Balance:
    """The unloaded body, before the loads at `time` act."""
    u = np.zeros((system.pattern.free.size, 3))
    return Balance(time, u, np.zeros_like(u), 0.0, 0.0)


def advance(system: System, state: Balance, until: float, step: float, memory: Memory) -> tuple[Balance, int]:
    """Equilibrium at `until` by equal load steps no longer than `step`, and how many were made.

    A step without an equilibrium is halved, HALVINGS times at most. Raises NewtonFailure.
    """
    count = max(1, int(np.ceil((until - state.time) / step - 1e-9)))
    start, made = state.time, 0
    for k in range(count):
        state, more = _step(system, state, start + (until - start) * (k + 1) / count, memory, HALVINGS)
        made += more
    return state, made


def _step(system: System, state: Balance, until: float, memory: Memory, halvings: int) -> tuple[Balance, int]:
    """One load step to `until`, in halves where it fails."""
    try:
        return balance(system, state, until, memory), 1
    except NewtonFailure as failure:
        if halvings == 0 or failure.status == "singular_tangent":
            raise
    middle = (state.time + until) / 2
    state, first = _step(system, state, middle, memory, halvings - 1)
    state, second = _step(system, state, until, memory, halvings - 1)
    return state, first + second


def by_iterations(system: System, memory: Memory) -> Attempt:
    """Load steps for pace.march: shorter after more than HARD iterations or none that succeed, longer after EASY."""

    def attempt(state: Balance, until: float) -> Trial:
        before = memory.iterations
        try:
            found = balance(system, state, until, memory)
        except NewtonFailure as failure:
            if failure.status == "singular_tangent":
                raise
            return Trial(state, False, 1, failure)
        needed = memory.iterations - before
        return Trial(found, True, 1 if needed > HARD else -1 if needed <= EASY else 0)

    return attempt


def balance(system: System, state: Balance, until: float, memory: Memory) -> Balance:
    """The equilibrium at `until` that Newton reaches from `state`. Raises NewtonFailure."""
    dead = system.applied(until)
    applied = dead + system.turning(state.u, until)
    latest = {"u": state.u, "strain": state.strain}

    def residual(unknowns: np.ndarray, step: np.ndarray | None = None) -> np.ndarray:
        u = unknowns.reshape(-1, 3)
        internal, strain = system.internal(u, None if step is None else step.reshape(-1, 3))
        latest.update(u=u, strain=strain)
        return (internal - dead - system.turning(u, until)).ravel()

    def tangent(unknowns: np.ndarray, step: np.ndarray | None = None) -> np.ndarray:
        return system.tangent_static(unknowns.reshape(-1, 3), until, None if step is None else step.reshape(-1, 3))

    if np.any(applied != state.applied):
        near = solve_mixed(residual, tangent, state.u.ravel(), system.scale, memory)
        solve(Equation(residual, tangent, system.scale), near, memory)
        system.refuse_inversion(latest["u"])
        applied = dead + system.turning(latest["u"], until)
    external = state.external + 0.5 * float(np.sum((state.applied + applied) * (latest["u"] - state.u)))
    return Balance(until, latest["u"], applied, latest["strain"], external)
