"""Implicit time integration: trapezoidal rule and generalized-alpha as one family, and an energy-momentum scheme.

With q1 = q0 + dt v0 + dt^2 ((1/2 - beta) a0 + beta a1) and v1 = v0 + dt ((1 - gamma) a0 + gamma a1),
the acceleration a1 solves (Chung and Hulbert 1993)

    M ((1 - alpha_m) a1 + alpha_m a0) + (1 - alpha_f) (f1 - F1) + alpha_f (f0 - F0) = 0.

The energy-momentum scheme (Simo and Tarnow 1992) takes the mean velocity and the mean stress of both ends,

    q1 - q0 = dt (v0 + v1) / 2,    M (v1 - v0) / dt + P(D_mean) Q_mean = (F0 + F1) / 2.

Because D1 - D0 = dQ Q_mean^T + Q_mean dQ^T with dQ = Q1 - Q0 (see `ancf.quadratic_form`), the mean stress P
does exactly the work U1 - U0 on dQ: for St. Venant-Kirchhoff solids energy and both momenta are kept for any dt, up to
Newton's tolerance, which is round-off here. Its derivative by Q1 has Q1 beside Q_mean; the tangent at the middle,
which is symmetric, stands for it and errs by the angle that a step turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ancf.element import Terms
from ancf.linear_solver import LinearSolver
from ancf.newton import (
    OK,
    TOLERANCE,
    Balance,
    Correction,
    Factor,
    Problem,
    correct,
    correct_from_afar,
    correct_searching,
    plus,
    with_contact,
)
from ancf.system import EPSILON, System

if TYPE_CHECKING:
    from ancf import contact
    from ancf.rim import Rim

SMALLEST_CUT = 2.0**-6
PATIENCE = 10  # iterations: a fresh factor of the symmetric tangent makes the energy-momentum scheme little faster


class Scheme(NamedTuple):
    """Coefficients of an integrator and its order of accuracy."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    order: int


def generalized_alpha(radius: float) -> Scheme:
    """Generalized-alpha with spectral radius rho_inf at high frequency, 0 <= radius <= 1."""
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    return Scheme(alpha_m, alpha_f, (1 - alpha_m + alpha_f) ** 2 / 4, 0.5 - alpha_m + alpha_f, 2)


class EnergyMomentum(NamedTuple):
    """The scheme that keeps energy and momenta, and its order of accuracy."""

    order: int = 2


SCHEMES = {
    "trapezoidal": Scheme(0.0, 0.0, 0.25, 0.5, 2),
    "generalized-alpha": generalized_alpha(0.8),
    "energy-momentum": EnergyMomentum(),
}


class State(NamedTuple):
    """Time (s), components q, v, a (3 v,), unbalanced force f - F (u,), work of the loads so far (J), what touches,
    and the forces (3 v,) that keep a rim's stated motion.

    Behind an energy-momentum step a and the force are their means over the step. The force has the contact's in it.
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    force: np.ndarray
    work: float
    touches: tuple[contact.Touch, ...] = ()
    pull: np.ndarray | None = None


class Step(NamedTuple):
    """State after a step, its status, Newton iterations, factorisations, and the factor for the next step."""

    state: State
    status: str
    iterations: int
    factorisations: int
    factor: Factor | None


def initial_state(system: System, solver: LinearSolver, q: np.ndarray, v: np.ndarray) -> State:
    """State at t = 0 with accelerations from M a = F(0) - f(q). Raises SingularMatrix without mass."""
    total, touches = system.internal_total(q) - _loads(system, q, 0.0), ()
    if system.contact is not None:
        meeting = system.contact.at_end(q, system.contact.untouched(), v, 0.0, 0.0)
        total, touches = total - meeting.force_contact(q), meeting.touched(q)
    force, a, pull = system.on_unknowns(total), np.zeros_like(q), None
    if system.rim is not None:
        a = system.rim.motion(0.0).a
    a[system.assembly.free] += solver.factorise(system.mass_values)(-force - system.inertia(a))
    if system.rim is not None:
        pull = total + system.inertia_total(a)
    return State(0.0, q, v, a, force, 0.0, touches, pull)


def step(
    system: System,
    solver: LinearSolver,
    scheme: Scheme | EnergyMomentum,
    state: State,
    dt: float,
    factor: Factor | None = None,
) -> Step:
    """One step of length dt (s). The state is unchanged where the status is not ok."""
    if isinstance(scheme, EnergyMomentum):
        return _conserving_step(system, solver, state, dt, factor)
    alpha_m, alpha_f, beta, gamma, _ = scheme
    t, dead = state.t + dt, system.force_external(state.t + dt)
    inertial = (1 - alpha_m) / (beta * dt**2)
    drift = state.q + dt * state.v + dt**2 * (0.5 - beta) * state.a
    coast = state.v + dt * (1 - gamma) * state.a  # the velocity is coast + dt gamma a1
    if system.rim is not None:
        more = _stated(system.rim, scheme, state.t, dt)
        drift, coast = drift + more[0], coast + more[1]
    force, floor = state.force, _floor(system, state.q, inertial)
    begun, least = (alpha_m * state.a, alpha_f * state.force), max(floor, TOLERANCE * system.norm(dead))

    def balance(q: np.ndarray, more: Terms) -> Balance:
        nonlocal force
        internal, external, size = system.force_internal(q, more), dead, least
        if system.following:
            external = dead + system.force_following(q, t)
            size = max(floor, TOLERANCE * system.norm(external))
        force = internal - external
        inertia = system.inertia(inertial * (q - drift) + begun[0])
        residual = -(inertia + (1 - alpha_f) * force + begun[1])
        return Balance(residual, max(size, *(TOLERANCE * system.norm(x) for x in (internal, inertia))))

    def jacobian(q: np.ndarray, more: Terms) -> np.ndarray:
        return inertial * system.mass_values + (1 - alpha_f) * system.tangent_loaded(q, t, more)

    problem, guess, meeting = Problem(balance, jacobian), drift + beta * dt**2 * state.a, None
    begin = state.q
    if system.rim is not None:
        guess, begin = (system.rim.placed(q, system.rim.motion(t).q) for q in (guess, begin))
    if system.contact is not None:
        rate = gamma / (beta * dt)
        meeting = system.contact.at_end(state.q, state.touches, coast - rate * drift, rate, dt)
        touching = with_contact(system, problem, meeting, 1 - alpha_f)
        found = _touching(system, solver, guess, begin, touching, factor)
    else:
        found = correct(system, solver, guess, problem, factor, reuse=True)
        if found.status != OK:
            found = plus(found, correct_from_afar(system, solver, begin, problem))
    a = (found.q - drift) / (beta * dt**2)
    return _taken(system, state, dt, found, coast + dt * gamma * a, a, force, meeting)


def _stated(rim: Rim, scheme: Scheme, t: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """What a step's drift and coast (3 v,) lack so that a rim's stated motion has its own velocity and acceleration at
    the end, not those that the scheme makes of its places; zero elsewhere, and where its velocity is constant."""
    before, after = rim.motion(t), rim.motion(t + dt)
    mean = (0.5 - scheme.beta) * before.a + scheme.beta * after.a
    change = dt * ((1 - scheme.gamma) * before.a + scheme.gamma * after.a)
    return after.q - before.q - dt * before.v - dt**2 * mean, after.v - before.v - change


def _conserving_step(system: System, solver: LinearSolver, state: State, dt: float, factor: Factor | None) -> Step:
    """One energy-momentum step; without a factor from the step before it begins from afar."""
    inertial = 2 / dt**2
    external = (system.force_external(state.t) + system.force_external(state.t + dt)) / 2
    force, floor = state.force, _floor(system, state.q, inertial)

    def middle(q: np.ndarray, more: Terms) -> tuple[np.ndarray, Terms]:
        return (state.q + q) / 2, ((1.0, (q - state.q) / 2), *more)

    def balance(q: np.ndarray, more: Terms) -> Balance:
        nonlocal force
        force = system.force_internal(*middle(q, more)) - external
        return Balance(-(system.inertia(inertial * (q - state.q - dt * state.v)) + force), floor)

    def jacobian(q: np.ndarray, more: Terms) -> np.ndarray:
        return inertial * system.mass_values + 0.5 * system.tangent(*middle(q, more))

    problem, found, meeting = Problem(balance, jacobian, quadratic=0.5, patience=PATIENCE), None, None
    guess = state.q + dt * state.v + dt**2 / 2 * state.a
    if system.contact is not None:
        meeting = system.contact.in_mean(state.q, state.touches, dt)
        touching = with_contact(system, problem, meeting, relative=0.0)
        found = _touching(system, solver, guess, state.q, touching, factor)
    else:
        if factor is not None:
            found = correct(system, solver, guess, problem, factor, reuse=True)
        if found is None or found.status != OK:
            afar = correct_from_afar(system, solver, state.q, problem)
            found = afar if found is None else plus(found, afar)
    v = 2 / dt * (found.q - state.q) - state.v
    return _taken(system, state, dt, found, v, (v - state.v) / dt, force, meeting)


def _touching(
    system: System, solver: LinearSolver, guess: np.ndarray, begin: np.ndarray, problem: Problem, factor: Factor | None
) -> Correction:
    """The end of a step that may touch something, from a guess of it, else from where it begins."""
    found = correct_searching(system, solver, guess, problem, factor)
    return found if found.status == OK else plus(found, correct_searching(system, solver, begin, problem))


def _floor(system: System, q: np.ndarray, inertial: float) -> float:
    """Round-off (N) of the internal force and of an inertia that is `inertial` M times a difference of positions."""
    return system.force_floor(q) + EPSILON * inertial * system.body.total_mass * np.abs(q).max()


def _taken(
    system: System,
    state: State,
    dt: float,
    found: Correction,
    v: np.ndarray,
    a: np.ndarray,
    force: np.ndarray,
    meeting: contact.Step | None,
) -> Step:
    """The step to the equilibrium that was found; force: f - F without the contact's."""
    if found.status != OK:
        return Step(state, found.status, found.iterations, found.factorisations, None)
    t = state.t + dt
    loads = (_loads(system, state.q, state.t) + _loads(system, found.q, t)) / 2
    work, touches, pull = state.work + float(loads @ (found.q - state.q)), (), None
    pressing = 0.0 if meeting is None else meeting.force_contact(found.q)
    if meeting is not None:
        touches = meeting.touched(found.q)
        force = force - system.on_unknowns(pressing)
    if system.rim is not None:
        pull = system.internal_total(found.q) - _loads(system, found.q, t) + system.inertia_total(a) - pressing
        work += system.rim.work(state.t, t, state.pull, pull)
    after = State(t, found.q, v, a, force, work, touches, pull)
    return Step(after, OK, found.iterations, found.factorisations, found.factor)


def _loads(system: System, q: np.ndarray, t: float) -> np.ndarray:
    """All loads (3 v,) at time t."""
    return system.loads_total(t) + system.following_total(q, t)


class Motion(NamedTuple):
    """State reached, its status, and the steps, iterations and factorisations spent; the factor to go on with."""

    state: State
    status: str
    steps: int
    iterations: int
    factorisations: int
    factor: Factor | None


def advance(
    system: System,
    solver: LinearSolver,
    scheme: Scheme | EnergyMomentum,
    state: State,
    until: float,
    dt: float,
    factor: Factor | None,
) -> Motion:
    """Steps of length dt from the state to the time `until`, a whole number of steps away.

    A step that fails is repeated as halved ones, down to SMALLEST_CUT dt.
    """
    spent = np.zeros(3, dtype=int)
    for k in range(round((until - state.t) / dt), 0, -1):
        target, cut = until - (k - 1) * dt, 1.0
        while state.t < target - 1e-9 * dt:
            length = min(cut * dt, target - state.t)
            taken = step(system, solver, scheme, state, length, factor if cut == 1.0 else None)
            spent += (taken.status == OK, taken.iterations, taken.factorisations)
            if taken.status == OK:
                state = taken.state
            elif cut > SMALLEST_CUT:
                cut /= 2
            else:
                return Motion(state, taken.status, *spent.tolist(), None)
            factor = taken.factor if cut == 1.0 else None
        state = state._replace(t=target)
    return Motion(state, OK, *spent.tolist(), factor)
