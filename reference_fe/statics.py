"""Static equilibrium f(u) = p by load steps; time is only the parameter of the load histories."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from reference_fe.elasticity import Lame
from reference_fe.newton import Equation, Memory, solve, solve_mixed
from reference_fe.pace import equal_steps
from reference_fe.system import System

if TYPE_CHECKING:
    from reference_fe.contact import Touch


@dataclass(frozen=True)
class Balance:
    """Equilibrium at one load parameter `time`: u (f, 3) in m, loads (f, 3) in N, energies (J).

    touch: what contact remembers, with obstacles. rest (f, 3): forces in N that keep a rim's stated motion.
    """

    time: float
    u: np.ndarray
    applied: np.ndarray
    strain: float
    external: float
    touch: Touch | None = None
    rest: np.ndarray | None = None


def begin(system: System, time: float = 0.0) -> Balance:
    """The unloaded body, before the loads at `time` act."""
    u = np.zeros((system.pattern.free.size, 3))
    touch = None if system.contact is None else system.contact.begin(system.expand(u))
    return Balance(time, u, np.zeros_like(u), 0.0, 0.0, touch)


def advance(system: System, state: Balance, until: float, step: float, memory: Memory) -> tuple[Balance, int]:
    """Equilibrium at `until` by `pace.equal_steps` of the load, and how many were made. Raises NewtonFailure."""
    return equal_steps(state, until, step, lambda state, time: balance(system, state, time, memory))


def balance(system: System, state: Balance, until: float, memory: Memory) -> Balance:
    """The equilibrium at `until` that Newton reaches from `state`. Raises NewtonFailure."""
    dead = system.applied(until)
    applied = system.acting(state.u, until)
    stretch = None if system.contact is None else system.contact.at_rest(state.touch)
    latest = {"u": state.u, "strain": state.strain}

    def residual(unknowns: np.ndarray, step: np.ndarray | None = None) -> np.ndarray:
        u = unknowns.reshape(-1, 3)
        internal, strain = system.internal(u, None if step is None else step.reshape(-1, 3))
        latest.update(u=u, strain=strain)
        rest = internal - dead - system.following(u, until)
        if stretch is not None:
            rest -= system.pressed(stretch, u)[0]
        return rest.ravel()

    def tangent(unknowns: np.ndarray, step: np.ndarray | None = None) -> np.ndarray:
        change = None if step is None else step.reshape(-1, 3)
        return system.tangent_loaded(unknowns.reshape(-1, 3), until, step=change, stretch=stretch)

    begin = state.u if system.rim is None else system.rim.placed(state.u, system.rim.stated(until)[0])
    if stretch is not None or np.any(applied != state.applied) or np.any(begin != state.u):
        near = begin.ravel()
        if isinstance(system.material, Lame):
            near = solve_mixed(residual, tangent, near, system.scale, memory)
        solve(Equation(residual, tangent, system.scale), near, memory)
        system.refuse_inversion(latest["u"])
        applied = system.acting(latest["u"], until)
    external = state.external + 0.5 * float(np.sum((state.applied + applied) * (latest["u"] - state.u)))
    touch = None if stretch is None else stretch.settle(system.expand(latest["u"]))
    rest = None
    if system.rim is not None:
        rest = system.residual(latest["u"], until)
        rest -= 0.0 if stretch is None else stretch.force(system.expand(latest["u"]))[0][system.pattern.free]
        begun = state.rest is not None
        mean = (rest + (state.rest if begun else 0.0)) / 2
        external += system.rim.work(mean, state.time if begun else None, until)
    return Balance(until, latest["u"], applied, latest["strain"], external, touch, rest)
