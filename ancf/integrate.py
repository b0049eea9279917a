"""Implicit time integration: trapezoidal rule and generalized-alpha, as one family.

With q1 = q0 + dt v0 + dt^2 ((1/2 - beta) a0 + beta a1) and v1 = v0 + dt ((1 - gamma) a0 + gamma a1),
the acceleration a1 solves (Chung and Hulbert 1993)

    M ((1 - alpha_m) a1 + alpha_m a0) + (1 - alpha_f) (f1 - F1) + alpha_f (f0 - F0) = 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ancf.linear_solver import LinearSolver
from ancf.newton import OK, TOLERANCE, Balance, Factor, correct
from ancf.system import EPSILON, System

SMALLEST_CUT = 2.0**-6


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


SCHEMES = {"trapezoidal": Scheme(0.0, 0.0, 0.25, 0.5, 2), "generalized-alpha": generalized_alpha(0.8)}


class State(NamedTuple):
    """Time (s), components q, v, a (3 v,), unbalanced force f - F (u,), work of the loads so far (J)."""

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    force: np.ndarray
    work: float


class Step(NamedTuple):
    """State after a step, its status, Newton iterations, factorisations, and the factor for the next step."""

    state: State
    status: str
    iterations: int
    factorisations: int
    factor: Factor | None


def initial_state(system: System, solver: LinearSolver, q: np.ndarray, v: np.ndarray) -> State:
    """State at t = 0 with accelerations from M a = F(0) - f(q). Raises SingularMatrix without mass."""
    force = system.force_internal(q) - system.force_external(0.0)
    a = np.zeros_like(q)
    a[system.assembly.free] = solver.factorise(system.mass_values)(-force)
    return State(0.0, q, v, a, force, 0.0)


def step(
    system: System, solver: LinearSolver, scheme: Scheme, state: State, dt: float, factor: Factor | None = None
) -> Step:
    """One step of length dt (s). The state is unchanged where the status is not ok."""
    alpha_m, alpha_f, beta, gamma, _ = scheme
    t = state.t + dt
    external = system.force_external(t)
    inertial = (1 - alpha_m) / (beta * dt**2)
    drift = state.q + dt * state.v + dt**2 * (0.5 - beta) * state.a
    force = state.force
    floor = system.force_floor(state.q) + EPSILON * inertial * system.body.total_mass * np.abs(state.q).max()

    def acceleration(q: np.ndarray) -> np.ndarray:
        return (q - drift) / (beta * dt**2)

    def balance(q: np.ndarray) -> Balance:
        nonlocal force
        internal = system.force_internal(q)
        force = internal - external
        inertia = system.inertia((1 - alpha_m) * acceleration(q) + alpha_m * state.a)
        residual = -(inertia + (1 - alpha_f) * force + alpha_f * state.force)
        return Balance(residual, max(floor, *(TOLERANCE * system.norm(x) for x in (external, internal, inertia))))

    def jacobian(q: np.ndarray) -> np.ndarray:
        return inertial * system.mass_values + (1 - alpha_f) * system.tangent(q)

    guess = drift + beta * dt**2 * state.a
    found = correct(system, solver, guess, balance, jacobian, factor, reuse=True)
    if found.status != OK:
        return Step(state, found.status, found.iterations, found.factorisations, None)
    a = acceleration(found.q)
    v = state.v + dt * ((1 - gamma) * state.a + gamma * a)
    loads = (system.loads_total(state.t) + system.loads_total(t)) / 2
    work = state.work + float(loads @ (found.q - state.q))
    return Step(State(t, found.q, v, a, force, work), OK, found.iterations, found.factorisations, found.factor)


class Motion(NamedTuple):
    """State reached, its status, and the steps, iterations and factorisations spent; the factor to go on with."""

    state: State
    status: str
    steps: int
    iterations: int
    factorisations: int
    factor: Factor | None


def advance(
    system: System, solver: LinearSolver, scheme: Scheme, state: State, until: float, dt: float, factor: Factor | None
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
