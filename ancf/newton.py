"""Equilibrium: Newton's method with a stated tolerance and named failures.

Where factors are reused, an old one is corrected by BFGS updates (Matthies, Strang 1979; two-loop form of Nocedal
1980), across iterations and time steps.

Where a time step turns far and leaves Newton's method lost, `approach` starts it closer. Its tangent and residual
leave out the stress that the part quadratic in an iteration's step has brought: the stretch of what turned along a
tangent, which exceeds everything else by far (Magisano, Leonetti, Garcea, IJNME 2017, "mixed integration points").
On the cantilever at a hundred times its load, steps of 0.25 s are then cut into 5 instead of 35. In statics it saved
no load step in any case tried.

Points that touch and part make the residual bend sharply; `correct_searching` then goes along a step only as far as the
residual does not pull back.

A residual has converged when its size in newtons (gradients divided by their lengths, see `System`)
is at most TOLERANCE times the largest of the forces that balance in it, or round-off of the internal
force of the undeformed plate and of the inertia.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ancf.element import Terms
from ancf.linear_solver import LinearSolver, SingularMatrix, Solve
from ancf.system import System

if TYPE_CHECKING:
    from ancf import contact

TOLERANCE = 1e-9
FULL_LIMIT = 40
OLD_LIMIT = 80
PATIENCE = 4
MOST_PATIENCE = 20
BAND_PER_ITERATION = 45
PAIRS = 8
CURVATURE = 1e-12
SYMMETRIC = 1e-13
NEAR_LIMIT = 20
CLOSE = 1e-2
FEW = 3
OVERSHOT = 0.5
HIT = 0.2
TRIALS = 8
FAST = 0.1
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


class Problem(NamedTuple):
    """An equilibrium to be found: balance(q, more), residual = loads - what resists, and jacobian(q, more),
    values (nnz,) of minus its derivative. more: what the stress has beyond that of q, see `System.force_internal`;
    the part quadratic in a step (3 v,) enters it with the factor `quadratic`. patience: see `correct`.
    """

    balance: Callable[[np.ndarray, Terms], Balance]
    jacobian: Callable[[np.ndarray, Terms], np.ndarray]
    quadratic: float = 1.0
    patience: int = PATIENCE


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
    problem: Problem,
    factor: Factor | None = None,
    reuse: bool = False,
    least: int = 0,
) -> Correction:
    """Solve balance(q).residual = 0 from q.

    least: iterations that are made at least.
    reuse: keep a factorisation, also the one handed over, until at the rate of the last iteration too many further
    ones would follow: more than the problem's patience, or where the band is wide, and a factorisation dear, one for
    each BAND_PER_ITERATION of it up to MOST_PATIENCE. Otherwise every iteration has its own.
    """
    patience = max(problem.patience, min(MOST_PATIENCE, solver.bandwidth / BAND_PER_ITERATION))
    q, free = q.copy(), system.assembly.free
    iterations = factorisations = 0
    residual, tolerance = problem.balance(q, ())
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
                factor = Factor(solver.factorise(problem.jacobian(q, ())))
            except SingularMatrix:
                return ended(SINGULAR)
            factorisations += 1
        step = factor(residual)
        q[free] += step
        iterations += 1
        before, last = residual, norm
        residual, tolerance = problem.balance(q, ())
        norm = system.norm(residual)
        factor.learn(step, before - residual)
        if not reuse or _too_slow(norm, last, tolerance, patience):
            factor = None
    return ended(INVERTED if system.is_inverted(q) else OK)


def _too_slow(norm: float, last: float, tolerance: float, patience: float) -> bool:
    """Whether a residual that has come from `last` to `norm` needs more than `patience` iterations like that."""
    return not norm < last or (norm > tolerance and math.log(tolerance / norm) < patience * math.log(norm / last))


def approach(system: System, solver: LinearSolver, q: np.ndarray, problem: Problem) -> Correction:
    """A point near the equilibrium, from q; ok where a step of Newton's method was CLOSE to none."""
    start, free, more, factor = q, system.assembly.free, (), None
    for count in range(1, NEAR_LIMIT + 1):
        try:
            factor = Factor(solver.factorise(problem.jacobian(q, more)))
        except SingularMatrix:
            return Correction(q, SINGULAR, count, count - 1, None)
        change = np.zeros_like(q)
        change[free] = factor(problem.balance(q, more).residual)
        q, more = q + change, ((-problem.quadratic, change),)
        size = float(np.abs(change).max())
        if not np.isfinite(size):
            return Correction(q, NOT_FINITE, count, count, None)
        if size <= CLOSE * float(np.abs(q - start).max()):
            return Correction(q, OK, count, count, factor)
    return Correction(q, DIVERGED, NEAR_LIMIT, NEAR_LIMIT, None)


def correct_from_afar(system: System, solver: LinearSolver, q: np.ndarray, problem: Problem) -> Correction:
    """`correct`, reusing factorisations, from what `approach` reaches from q; without a factor for the next step
    where that took more than FEW iterations, so that the next one begins from afar as well."""
    near = approach(system, solver, q, problem)
    if near.status != OK:
        return near
    found = plus(near, correct(system, solver, near.q, problem, near.factor, reuse=True))
    return found if near.iterations <= FEW else found._replace(factor=None)


def plus(before: Correction, found: Correction) -> Correction:
    """What was found, with the work spent before."""
    return found._replace(
        iterations=before.iterations + found.iterations,
        factorisations=before.factorisations + found.factorisations,
    )


def with_contact(
    system: System, problem: Problem, step: contact.Step, share: float = 1.0, relative: float = TOLERANCE
) -> Problem:
    """The problem with `share` of the contact's forces in its balance, for `correct_searching`.

    relative: size of a residual beside the contact's forces that counts as none.
    """

    def balance(q: np.ndarray, more: Terms) -> Balance:
        residual, tolerance = problem.balance(q, more)
        force = share * system.on_unknowns(step.force_contact(q))
        least = relative * system.norm(force) + share * step.round_off(q)
        return Balance(residual + force, max(tolerance, least))

    def jacobian(q: np.ndarray, more: Terms) -> tuple[np.ndarray, np.ndarray | None]:
        data, touched = problem.jacobian(q, more), step.tangent_contact(q)
        if touched is None:
            return data, None
        lower, upper = touched
        is_symmetric = np.abs(lower - upper).max(initial=0.0) <= SYMMETRIC * np.abs(lower).max(initial=0.0)
        return data + share * lower, None if is_symmetric else data + share * upper

    return problem._replace(balance=balance, jacobian=jacobian)


def correct_searching(
    system: System, solver: LinearSolver, q: np.ndarray, problem: Problem, factor: Factor | None = None, least: int = 0
) -> Correction:
    """`correct` where the residual bends sharply, for a problem whose jacobian is (lower triangle, that of the
    transpose or None). A factorisation is kept, and corrected, while each step leaves less than FAST of the residual.
    """
    iterations = factorisations = 0
    residual, tolerance = problem.balance(q, ())
    norm = system.norm(residual)

    def ended(status: str) -> Correction:
        return Correction(q, status, iterations, factorisations, factor)

    while iterations < least or not norm <= tolerance:
        if not np.isfinite(norm):
            return ended(NOT_FINITE)
        if iterations == FULL_LIMIT:
            return ended(DIVERGED)
        if factor is None:
            try:
                factor = Factor(solver.factorise(*problem.jacobian(q, ())))
            except SingularMatrix:
                return ended(SINGULAR)
            factorisations += 1
        change = np.zeros_like(q)
        change[system.assembly.free] = factor(residual)
        start, before, last = q, residual, norm
        q, (residual, tolerance) = _search(system, q, change, residual, problem)
        iterations, norm = iterations + 1, system.norm(residual)
        factor.learn((q - start)[system.assembly.free], before - residual)
        factor = factor if norm <= FAST * last else None
    return ended(INVERTED if system.is_inverted(q) else OK)


def _search(system: System, q: np.ndarray, change: np.ndarray, residual: np.ndarray, problem: Problem):
    """Where to go along a change (3 v,) of q, and the Balance there.

    The whole way, unless the residual there pulls back along it by more than OVERSHOT of its pull at the start; then
    to where it has HIT or less of it left, by regula falsi with the Illinois rule.
    """
    way, end = change[system.assembly.free], q + change
    pull, whole = float(way @ residual), problem.balance(end, ())
    back = float(way @ whole.residual)
    if pull <= 0 or back >= -OVERSHOT * pull or system.norm(whole.residual) <= OVERSHOT * system.norm(residual):
        return end, whole
    (low, at_low), (high, at_high) = (0.0, pull), (1.0, back)
    for _ in range(TRIALS):
        part = (low * at_high - high * at_low) / (at_high - at_low)
        part = part if np.isfinite(part) else (low + high) / 2
        end = q + part * change
        found = problem.balance(end, ())
        here = float(way @ found.residual)
        if abs(here) <= HIT * pull:
            break
        if here > 0:
            (low, at_low), at_high = (part, here), at_high / 2
        else:
            (high, at_high), at_low = (part, here), at_low / 2
    return end, found


class Path(NamedTuple):
    """Equilibrium reached at the load parameter t: q (3 v,), work (J) of the loads and of a rim's stated motion,
    status, steps, iterations, the state of what touches, and the forces (3 v,) that keep a rim's motion."""

    t: float
    q: np.ndarray
    work: float
    status: str
    steps: int
    iterations: int
    touches: tuple[contact.Touch, ...] = ()
    pull: np.ndarray | None = None


def equilibrium(
    system: System,
    solver: LinearSolver,
    q: np.ndarray,
    t: float,
    until: float,
    step: float,
    touches: tuple[contact.Touch, ...] = (),
    pull: np.ndarray | None = None,
) -> Path:
    """Follow the static equilibrium from q at t, with what touches and pulls there, to `until` by load steps.

    A step that fails is halved, down to SMALLEST_CUT of the given one; after a success it doubles
    again up to that. The status is that of the last failure where the path could not be followed. Where loads change
    one iteration is made at least: one below round-off of the internal force still has its displacement.
    """
    cut, work, steps, iterations, meeting = 1.0, 0.0, 0, 0, None
    while t < until - 1e-12 * step:
        target = min(t + cut * step, until)
        target = until if until - target < 1e-9 * step else target
        before = system.loads_total(t) + system.following_total(q, t)
        after = system.loads_total(target) + system.following_total(q, target)
        problem, least = _statics(system, target), int(np.any(before != after))
        start = q if system.rim is None else system.rim.placed(q, system.rim.motion(target).q)
        if system.contact is None:
            found = correct(system, solver, start, problem, least=least)
        else:
            meeting = system.contact.at_rest(q, touches)
            found = correct_searching(system, solver, start, with_contact(system, problem, meeting), least=least)
        iterations += found.iterations
        if found.status == OK:
            acting = system.loads_total(target) + system.following_total(found.q, target)
            work += float((before + acting) @ (found.q - q)) / 2
            if system.rim is not None:
                old, pull = pull, system.internal_total(found.q) - acting
                pull -= 0.0 if meeting is None else meeting.force_contact(found.q)
                work += system.rim.work(t, target, old, pull)
            touches = touches if system.contact is None else meeting.touched(found.q)
            t, q, steps, cut = target, found.q, steps + 1, min(1.0, 2 * cut)
        elif cut > SMALLEST_CUT:
            cut /= 2
        else:
            return Path(t, q, work, found.status, steps, iterations, touches, pull)
    return Path(until, q, work, OK, steps, iterations, touches, pull)


def _statics(system: System, t: float) -> Problem:
    """F(q, t) - f(q), and minus its derivative."""
    dead = system.loads_total(t)

    def balance(q: np.ndarray, more: Terms) -> Balance:
        return static_balance(system, dead + system.following_total(q, t), q)

    return Problem(balance, lambda q, more: system.tangent_loaded(q, t))


def static_balance(system: System, loads: np.ndarray, q: np.ndarray) -> Balance:
    """F - f(q) of the loads F (3 v,)."""
    total = system.internal_total(q)
    external, internal = system.on_unknowns(loads), system.on_unknowns(total)
    size = max(system.norm(external), system.norm(internal), 0.0 if system.rim is None else system.rim.size(total))
    return Balance(external - internal, max(TOLERANCE * size, system.force_floor(q)))
