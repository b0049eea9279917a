"""Implicit time integration of M a + f(u) = p(t): trapezoidal Newmark and generalized-alpha.

Newmark: u_{n+1} = u_n + h v_n + h² ((1/2 - beta) a_n + beta a_{n+1}), v likewise with gamma.
Balance: (1 - alpha_m) M a_{n+1} + alpha_m M a_n + (1 - alpha_f) (f - p)_{n+1} + alpha_f (f - p)_n = 0
(Chung, Hulbert 1993). All alphas zero with beta = 1/4, gamma = 1/2 is the trapezoidal rule; so is alpha_f = 1/2,
beta = 1/2, gamma = 1, where a is the mean acceleration of a step instead of the one at its end.

Obstacles add - C to the balance, the mean contact force of a step (contact.py). An acceleration at the end of a step
would then have to jump by twice its mean, forth and back; so with obstacles the trapezoidal rule is `MEAN`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from reference_fe.newton import Equation, Memory, NewtonFailure, solve
from reference_fe.pace import Attempt, Trial, equal_steps
from reference_fe.system import System

if TYPE_CHECKING:
    from reference_fe.contact import Stretch, Touch

EASY = 1 / 16  # of the allowed error: a step of twice the length has 8 times the error, half of what is allowed


@dataclass(frozen=True)
class Scheme:
    """Parameters of the generalized-alpha family. Second order for all that `generalized_alpha` makes."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    order: int = 2


TRAPEZOIDAL = Scheme(0.0, 0.0, 0.25, 0.5)
MEAN = Scheme(0.0, 0.5, 0.5, 1.0)


def generalized_alpha(spectral_radius: float = 0.8) -> Scheme:
    """Chung and Hulbert's scheme of this spectral radius at infinite frequency (1 none, 0 full damping)."""
    alpha_m = (2 * spectral_radius - 1) / (spectral_radius + 1)
    alpha_f = spectral_radius / (spectral_radius + 1)
    return Scheme(alpha_m, alpha_f, (1 - alpha_m + alpha_f) ** 2 / 4, 0.5 - alpha_m + alpha_f)


@dataclass(frozen=True)
class State:
    """Motion at one time: u, v, a (f, 3) of the free nodes; force (f, 3) = internal minus applied; energies (J).

    touch: what contact remembers, with obstacles. With a rim: whole (f, 3), the force on held components too, and
    rest (f, 3), what keeps the rim's stated motion, a mean over the last step where the scheme balances one.
    """

    time: float
    u: np.ndarray
    v: np.ndarray
    a: np.ndarray
    force: np.ndarray
    kinetic: float
    strain: float
    external: float
    touch: Touch | None = None
    whole: np.ndarray | None = None
    rest: np.ndarray | None = None


def begin(system: System, velocity: np.ndarray, time: float = 0.0) -> State:
    """State at rest position with the velocity (f, 3) in m/s; its acceleration satisfies the balance."""
    u = np.zeros_like(velocity)
    internal, strain = system.internal(u)
    force, touch = internal - system.balanced(system.acting(u, time)), None
    unbalanced = force
    if system.contact is not None:
        touch = system.contact.begin(system.expand(u))
        unbalanced = force - system.free(system.contact.force_now(touch, system.expand(u), system.expand(velocity)))
    kinetic = system.kinetic(velocity)
    if system.rim is not None:
        return _begin_on_rim(system, State(time, u, velocity, u, force, kinetic, strain, 0.0, touch), unbalanced)
    a = -system.solve_mass(unbalanced) if np.any(unbalanced) else np.zeros_like(u)
    return State(time, u, velocity, a, force, kinetic, strain, 0.0, touch)


def _begin_on_rim(system: System, state: State, unbalanced: np.ndarray) -> State:
    """The first state with a rim, whose stated acceleration is none of the balance's."""
    a = system.rim.spread(system.rim.stated(state.time)[2], len(state.u))
    a = a - system.solve_mass(unbalanced + system.inertia(a))
    whole = system.residual(state.u, state.time)
    rest = whole + system.inertia_everywhere(a)
    if state.touch is not None:
        full = system.expand(state.u)
        rest -= system.contact.force_now(state.touch, full, system.expand(state.v))[system.pattern.free]
    return replace(state, a=a, whole=whole, rest=rest)


def advance(
    system: System, scheme: Scheme, state: State, until: float, step_length: float, memory: Memory
) -> tuple[State, int]:
    """State at `until` by `pace.equal_steps` (s), and how many were made. Raises NewtonFailure."""
    return equal_steps(state, until, step_length, lambda state, time: step(system, scheme, state, time, memory))


def within(system: System, scheme: Scheme, allowed: float, memory: Memory) -> Attempt:
    """Steps for pace.march that are rejected where `local_error` is above `allowed` (m) or no equilibrium is found."""

    def attempt(state: State, until: float) -> Trial:
        try:
            found = step(system, scheme, state, until, memory)
        except NewtonFailure as failure:
            return Trial(state, False, 1, failure)
        ratio = local_error(scheme, state, found) / allowed
        if ratio > 1:
            return Trial(state, False, math.ceil(math.log2(ratio) / (scheme.order + 1)))
        return Trial(found, True, -1 if ratio <= EASY else 0)

    return attempt


def first_step(scheme: Scheme, state: State, allowed: float) -> float:
    """A first step (s) whose `local_error` stays allowed (m) should it change the acceleration by as much as
    there is; infinite at rest. A suddenly loaded node moves off so fast that Newton fails at a long step."""
    fastest = float(np.linalg.norm(state.a, axis=1).max())
    return math.sqrt(allowed / (_error_factor(scheme) * fastest)) if fastest else math.inf


def local_error(scheme: Scheme, before: State, after: State) -> float:
    """Largest nodal displacement error (m) that the step between two states adds.

    Newmark's update less the third-order one, whose acceleration varies linearly (Zienkiewicz, Xie,
    Earthq. Eng. Struct. Dyn. 20 (1991) 871): h² (beta - 1/6) (a_{n+1} - a_n). The accelerations of
    generalized-alpha belong to the times t + (alpha_m - alpha_f) h, which adds half that fraction to beta.
    """
    h = after.time - before.time
    return _error_factor(scheme) * h**2 * float(np.linalg.norm(after.a - before.a, axis=1).max())


def _error_factor(scheme: Scheme) -> float:
    """Local displacement error over h² (a_{n+1} - a_n)."""
    return abs(scheme.beta + (scheme.alpha_m - scheme.alpha_f) / 2 - 1 / 6)


def step(system: System, scheme: Scheme, state: State, until: float, memory: Memory) -> State:
    """One step of the scheme to the time `until`. Raises NewtonFailure."""
    h = until - state.time
    alpha_m, alpha_f, beta, gamma = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma
    dead = system.applied(until)
    predicted = state.u + h * state.v + h**2 * (0.5 - beta) * state.a
    guess, swing = state.u + h * state.v + 0.5 * h**2 * state.a, 0.0
    if system.rim is not None:
        stated = system.rim.stated(until)
        drift, swing = system.rim.lack(system.rim.stated(state.time), stated, h, beta, gamma)
        guess, predicted = system.rim.placed(guess, stated[0]), predicted + system.rim.spread(drift, len(predicted))
        swing = system.rim.spread(swing, len(predicted))
    known = alpha_m * system.inertia(state.a) + alpha_f * state.force
    stretch = None if system.contact is None else system.contact.during(state.touch, h, 1 - 2 * alpha_f)
    latest = {}

    def residual(unknowns: np.ndarray) -> np.ndarray:
        u = unknowns.reshape(-1, 3)
        internal, strain = system.internal(u)
        a = (u - predicted) / (beta * h**2)
        latest.update(u=u, a=a, force=internal - dead - system.following(u, until), strain=strain)
        rest = (1 - alpha_m) * system.inertia(a) + (1 - alpha_f) * latest["force"] + known
        if stretch is not None:
            pressing, latest["grip"] = system.pressed(stretch, u)
            rest -= pressing
        return rest.ravel()

    def tangent(unknowns: np.ndarray) -> np.ndarray:
        mass = (1 - alpha_m) / (beta * h**2)
        return system.tangent_loaded(unknowns.reshape(-1, 3), until, 1 - alpha_f, mass, stretch=stretch)

    def grip() -> np.ndarray:
        return latest["grip"] * (beta * h**2 / (1 - alpha_m)) / system.mass.diagonal()

    memory.prepare(h)
    solve(Equation(residual, tangent, system.scale, None if stretch is None else grip), guess.ravel(), memory)
    system.refuse_inversion(latest["u"])
    v = state.v + h * ((1 - gamma) * state.a + gamma * latest["a"]) + swing
    kinetic = system.kinetic(v)
    mean = (system.acting(state.u, state.time) + system.acting(latest["u"], until)) / 2
    external = state.external + float(np.sum(mean * (latest["u"] - state.u)))
    touch = None if stretch is None else stretch.settle(system.expand(latest["u"]))
    after = State(until, latest["u"], v, latest["a"], latest["force"], kinetic, latest["strain"], external, touch)
    return after if system.rim is None else _kept(system, scheme, state, after, stretch)


def _kept(system: System, scheme: Scheme, before: State, after: State, stretch: Stretch | None) -> State:
    """A state behind a step with what kept the rim's stated motion, and with its work."""
    alpha_m, alpha_f = scheme.alpha_m, scheme.alpha_f
    whole = system.residual(after.u, after.time)
    rest = system.inertia_everywhere((1 - alpha_m) * after.a + alpha_m * before.a)
    rest += (1 - alpha_f) * whole + alpha_f * before.whole
    if stretch is not None:
        rest -= stretch.force(system.expand(after.u))[0][system.pattern.free]
    mean = rest if alpha_f else (before.rest + rest) / 2
    external = after.external + system.rim.work(mean, before.time, after.time)
    return replace(after, whole=whole, rest=rest, external=external)
