"""Statics past limit points: a path of equilibria followed by arc length.

The load parameter t is an unknown beside the displacements. With loads F(t) = F_0 + t F_1 a step of length l solves

    f(q) = F(t),    |q - q_n| = l

by Newton's method with both equations linearised (cylindrical arc length; Crisfield 1981, Ramm 1981):

    dq = K^-1 r + dt K^-1 F_1,    2 (q - q_n) . dq = l^2 - |q - q_n|^2

with the residual r. Lengths weigh gradients by the element's sides (see `System.lengths`), so that they are metres.
The parameter may fall and rise again. Where paths cross (bifurcation) the one that is straight on is followed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ancf.linear_solver import LinearSolver, SingularMatrix
from ancf.newton import (
    DIVERGED,
    FULL_LIMIT,
    INVERTED,
    NOT_FINITE,
    OK,
    SINGULAR,
    SMALLEST_CUT,
    Balance,
    Problem,
    correct,
    static_balance,
)
from ancf.system import System

TOO_LONG = "path_too_long"
LONGEST = 100  # times the linear response to the whole load
STRAIGHT = 0.5  # least cosine of the angle between a step and its prediction
ON_SPHERE = 1e-9  # relative error of the length of a step


class Point(NamedTuple):
    """Equilibrium on a path: load parameter t, length of the path so far, q (3 v,), work of the loads (J), status,
    iterations spent since the point before.

    length: in units of the linear response to a load parameter of 1, so that it is t where the plate is linear.
    """

    t: float
    length: float
    q: np.ndarray
    work: float
    status: str
    iterations: int


@dataclass(frozen=True, eq=False)
class _Track:
    """What a path is followed on: loads start + t growth (3 v,), and the length `unit` (m) of the response to t = 1."""

    system: System
    solver: LinearSolver
    start: np.ndarray
    growth: np.ndarray
    unit: float = 1.0

    def balance(self, q: np.ndarray, t: float) -> Balance:
        """Residual at q and t."""
        return static_balance(self.system, self.start + t * self.growth, q)

    def response(self, q: np.ndarray, residual: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """Displacements (3 v,) of the tangent at q under growth, and under a residual (u,). Raises SingularMatrix."""
        free, moved = self.system.assembly.free, []
        solve = self.solver.factorise(self.system.tangent(q))
        for force in (self.growth[free], residual):
            moved.append(np.zeros_like(q))
            moved[-1][free] = 0.0 if force is None else solve(force)
        return tuple(moved)

    def metres(self, change: np.ndarray) -> np.ndarray:
        """Changes (3 v,) of free components as lengths (u,) in m."""
        return change[self.system.assembly.free] * self.system.lengths

    def length(self, change: np.ndarray) -> float:
        """Size (m) of a change (3 v,)."""
        return float(np.linalg.norm(self.metres(change)))

    def beyond(self, here: Point, q: np.ndarray, t: float, status: str, iterations: int) -> Point:
        """The point at q and t, one step from here."""
        loads = self.start + (here.t + t) / 2 * self.growth
        length = here.length + self.length(q - here.q) / self.unit
        return Point(t, length, q, here.work + float(loads @ (q - here.q)), status, iterations)


def follow(system: System, solver: LinearSolver, q: np.ndarray, until: float, step: float) -> Iterator[Point]:
    """Equilibria beyond q, that of t = 0, up to the first whose t is `until`; the last one may be a failure.

    The loads must be linear in t from 0 to `until`. Steps are as long as the linear response to an increment
    `step` of t; one that fails is halved, down to SMALLEST_CUT, and after a success doubled up to that. Loads that
    move nothing, as where everything is held, take a single step of no displacement.
    """
    start = system.loads_total(0.0)
    track = _Track(system, solver, start, (system.loads_total(until) - start) / until)
    here, before, cut, spent = Point(0.0, 0.0, q, 0.0, OK, 0), None, 1.0, 0
    try:
        track = _Track(system, solver, start, track.growth, track.length(track.response(q)[0]))
    except SingularMatrix:
        yield here._replace(status=SINGULAR)
        return
    if track.unit == 0:
        yield here._replace(t=until, length=until)
        return
    while here.status == OK and here.t < until:
        found = _step(track, here, before, cut * step * track.unit, until)
        spent += found.iterations
        if found.status != OK and cut > SMALLEST_CUT:
            cut /= 2
            continue
        if found.status == OK:
            before, cut = here, min(1.0, 2 * cut)
            status = OK if found.length <= LONGEST * until else TOO_LONG
            here = found._replace(status=status, iterations=spent)
        else:
            here = here._replace(status=found.status, iterations=spent)
        spent = 0
        yield here


def _step(track: _Track, here: Point, before: Point | None, length: float, until: float) -> Point:
    """The point a length (m) from here, or that of `until` where it comes first."""
    try:
        found = _on_sphere(track, here, before, length)
    except SingularMatrix:
        return here._replace(status=SINGULAR, iterations=1)
    if found.status != OK or found.t < until:
        return found
    part = (until - here.t) / (found.t - here.t)
    problem = Problem(lambda q, more: track.balance(q, until), track.system.tangent)
    end = correct(track.system, track.solver, here.q + part * (found.q - here.q), problem)
    overshoot = track.length(end.q - here.q) > length
    status = DIVERGED if end.status == OK and overshoot else end.status
    return track.beyond(here, end.q, until, status, found.iterations + end.iterations)


def _on_sphere(track: _Track, here: Point, before: Point | None, length: float) -> Point:
    """The equilibrium a length (m) from here, ahead. Raises SingularMatrix."""
    ahead, _ = track.response(here.q)
    dt = length / track.length(ahead)
    if before is not None and track.metres(ahead) @ track.metres(here.q - before.q) < 0:
        dt = -dt
    q, t, predicted = here.q + dt * ahead, here.t + dt, dt * track.metres(ahead)
    for count in range(2, FULL_LIMIT + 1):
        residual, tolerance = track.balance(q, t)
        norm, way = track.system.norm(residual), track.metres(q - here.q)
        missing = length**2 - way @ way
        if not np.isfinite(norm):
            return track.beyond(here, q, t, NOT_FINITE, count)
        if norm <= tolerance and abs(missing) <= 2 * ON_SPHERE * length**2:
            status = INVERTED if track.system.is_inverted(q) else OK
            status = status if way @ predicted >= STRAIGHT * length**2 else DIVERGED
            return track.beyond(here, q, t, status, count)
        by_load, by_residual = track.response(q, residual)
        dt = (missing / 2 - way @ track.metres(by_residual)) / (way @ track.metres(by_load))
        q, t = q + by_residual + dt * by_load, t + dt
    return track.beyond(here, q, t, DIVERGED, count)
