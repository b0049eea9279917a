"""Equilibrium: Newton's method with a stated tolerance and named failures.

Where factors are reused, an old one is corrected by BFGS updates (Matthies, Strang 1979; two-loop form of Nocedal
1980), across iterations and time steps.

A residual has converged when its size in newtons (gradients divided by their lengths, see `System`)
is at most TOLERANCE times the largest of the forces that balance in it, or round-off of the internal
force of the undeformed plate and of the inertia.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ancf.linear_solver import LinearSolver, SingularMatrix, Solve
from ancf.system import System

TOLERANCE = 1e-9
FULL_LIMIT = 40
OLD_LIMIT = 80
PATIENCE = 4
MOST_PATIENCE = 20
BAND_PER_ITERATION = 45
PAIRS = 8
CURVATURE = 1e-12
SMALLEST_CUT = 2.0**-10

OK = "ok"
DIVERGED = "newton_diverged"
SINGULAR = "singular_tangent"
NOT_FINITE = "not_finite"
INVERTED = "inverted_element"


class Balance(NamedTuple):
    """Residual (u,) of an equilibrium, and the size (N) below which it counts as none."""

    residual: np.ndarray
    tolerance: float


class Factor:
    """Steps (u,) for residuals (u,) from one factorisation and what the residual did since it was made."""

    def __init__(self, solve: Solve):
        self.solve = solve
        self.pairs: deque[tuple[np.ndarray, np.ndarray, float]] = deque(maxlen=PAIRS)

    def __call__(self, residual: np.ndarray) -> np.ndarray:
        rest, weights = residual.copy(), []
        for step, change, inverse in reversed(self.pairs):
            weights.append(inverse * (step @ rest))
            rest -= weights[-1] * change
        move = self.solve(rest)
        for (step, change, inverse), weight in zip(self.pairs, reversed(weights), strict=True):
            move += (weight - inverse * (change @ move)) * step
        return move

    def learn(self, step: np.ndarray, change: np.ndarray) -> None:
        """Remember that `step` took `change` off the residual, unless the curvature is not positive."""
        curvature = float(step @ change)
        if curvature > CURVATURE * math.sqrt(float(step @ step) * float(change @ change)):
            self.pairs.append((step, change, 1 / curvature))


class Correction(NamedTuple):
    """Where Newton ended: q (3 v,), status, iterations, factorisations, and the factor it used last."""

    q: np.ndarray
    status: str
    iterations: int
    factorisations: int
    factor: Factor | None


def correct(
    system: System,
    solver: LinearSolver,
    q: np.ndarray,
    balance: Callable[[np.ndarray], Balance],
    jacobian: Callable[[np.ndarray], np.ndarray],
    factor: Factor | None = None,
    reuse: bool = False,
    least: int = 0,
) -> Correction:
    """Solve balance(q).residual = 0 from q.

    balance: residual = loads - what resists. jacobian(q): values (nnz,) of minus its derivative.
    least: iterations that are made at least.
    reuse: keep a factorisation, also the one handed over, until at the rate of the last iteration too many further
    ones would follow: more than PATIENCE, or where the band is wide, and a factorisation dear, one for each
    BAND_PER_ITERATION of it up to MOST_PATIENCE. Otherwise every iteration has its own.
    """
    patience = max(PATIENCE, min(MOST_PATIENCE, solver.bandwidth / BAND_PER_ITERATION))
    q, free = q.copy(), system.assembly.free
    iterations = factorisations = 0
    residual, tolerance = balance(q)
    norm = system.norm(residual)
    factor = factor if reuse else None

    def ended(status: str) -> Correction:
        return Correction(q, status, iterations, factorisations, factor)

    while iterations < least or not norm <= tolerance:
        if not np.isfinite(norm):
            return ended(NOT_FINITE)
        if iterations == (OLD_LIMIT if reuse else FULL_LIMIT):
            return ended(DIVERGED)
        if factor is None:
            try:
                factor = Factor(solver.factorise(jacobian(q)))
            except SingularMatrix:
                return ended(SINGULAR)
            factorisations += 1
        step = factor(residual)
        q[free] += step
        iterations += 1
        before, last = residual, norm
        residual, tolerance = balance(q)
        norm = system.norm(residual)
        factor.learn(step, before - residual)
        if not reuse or _too_slow(norm, last, tolerance, patience):
            factor = None
    return ended(INVERTED if system.is_inverted(q) else OK)


def _too_slow(norm: float, last: float, tolerance: float, patience: float) -> bool:
    """Whether a residual that has come from `last` to `norm` needs more than `patience` iterations like that."""
    return not norm < last or math.log(tolerance / norm) < patience * math.log(norm / last)


class Path(NamedTuple):
    """Equilibrium reached at the load parameter t: q (3 v,), work of the loads (J), status, steps, iterations."""

    t: float
    q: np.ndarray
    work: float
    status: str
    steps: int
    iterations: int


def equilibrium(system: System, solver: LinearSolver, q: np.ndarray, t: float, until: float, step: float) -> Path:
    """Follow the static equilibrium from q at t to `until` by load steps.

    A step that fails is halved, down to SMALLEST_CUT of the given one; after a success it doubles
    again up to that. The status is that of the last failure where the path could not be followed. Where loads change
    one iteration is made at least: one below round-off of the internal force still has its displacement.
    """
    cut, work, steps, iterations = 1.0, 0.0, 0, 0
    while t < until - 1e-12 * step:
        target = min(t + cut * step, until)
        target = until if until - target < 1e-9 * step else target
        balance, tangent = _statics(system, target)
        before = system.loads_total(t) + system.moments_total(q, t)
        after = system.loads_total(target) + system.moments_total(q, target)
        found = correct(system, solver, q, balance, tangent, least=int(np.any(before != after)))
        iterations += found.iterations
        if found.status == OK:
            loads = before + system.loads_total(target) + system.moments_total(found.q, target)
            work += float(loads @ (found.q - q)) / 2
            t, q, steps, cut = target, found.q, steps + 1, min(1.0, 2 * cut)
        elif cut > SMALLEST_CUT:
            cut /= 2
        else:
            return Path(t, q, work, found.status, steps, iterations)
    return Path(until, q, work, OK, steps, iterations)


def _statics(system: System, t: float) -> tuple[Callable[[np.ndarray], Balance], Callable[[np.ndarray], np.ndarray]]:
    """F(q, t) - f(q), and minus its derivative (nnz,)."""
    dead = system.loads_total(t)

    def balance(q: np.ndarray) -> Balance:
        external = (dead + system.moments_total(q, t))[system.assembly.free]
        internal = system.force_internal(q)
        tolerance = max(TOLERANCE * max(system.norm(external), system.norm(internal)), system.force_floor(q))
        return Balance(external - internal, tolerance)

    return balance, lambda q: system.tangent_static(q, t)
