"""Equilibrium by Newton's method that keeps an old factorisation as long as that pays.

A factorisation costs 20 to 40 times as much as a solution with it, so the last factor is corrected
by BFGS updates (Matthies, Strang 1979; two-loop form of Nocedal 1980) across iterations and steps.
A new tangent is formed when the observed contraction promises more than PATIENCE further iterations.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from reference_fe.linear_solver import SingularTangent

PATIENCE = 13
PAIRS = 20
MOST_FACTORS = 15
MOST_ITERATIONS = 150
TOLERANCE = 1e-10
CLOSE = 1e-2
FAR = 1e3  # of the allowed error: a step as long that raises the residual throws contact open or shut
HALVINGS = 4  # of such a step
GRIP = 0.5  # relative change of a node's stiffness by contact that an old factor still serves


class NewtonFailure(RuntimeError):
    """No equilibrium was found; `status` is its short name."""

    def __init__(self, status: str, message: str):
        super().__init__(message)
        self.status = status


@dataclass(frozen=True)
class Equation:
    """residual(u) -> (n,) in N and tangent(u) -> upper-triangle values (nnz,) at the unknowns u (n,) in m.

    scale: length (m) below which displacements do not matter. grip() -> (f,): stiffness of obstacles against the
    nodes where the residual was last asked for, over that of their inertia; it jumps where contact opens and closes.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    tangent: Callable[[np.ndarray], np.ndarray]
    scale: float
    grip: Callable[[], np.ndarray] | None = None


@dataclass
class Memory:
    """The last factorisation, what was learnt since, and counts of the work done so far.

    diagonal: places of the diagonal among the upper-triangle values. step: the time step (s) it is for.
    """

    solver: object
    diagonal: np.ndarray
    valid: bool = False
    step: float = 0.0
    pairs: list[tuple[np.ndarray, np.ndarray, float]] = field(default_factory=list)
    iterations: int = 0
    factorisations: int = 0
    seconds: dict[str, float] = field(
        default_factory=lambda: dict.fromkeys(("force", "tangent", "factor", "solve"), 0.0)
    )
    stiffness: float = 0.0
    grip: np.ndarray | None = None

    def forget(self) -> None:
        """Let the next iteration form a new tangent."""
        self.valid = False

    def prepare(self, step: float) -> None:
        """Forget a factorisation that was made for another time step."""
        if not math.isclose(step, self.step, rel_tol=1e-9):
            self.step = step
            self.forget()

    @contextmanager
    def clock(self, part: str) -> Iterator[None]:
        """Add the time spent inside to `seconds[part]`."""
        start = time.perf_counter()
        yield
        self.seconds[part] += time.perf_counter() - start

    def factorise(self, tangent: Callable[[np.ndarray], np.ndarray], u: np.ndarray) -> None:
        """Form and factorise the tangent at u."""
        with self.clock("tangent"):
            values = tangent(u)
        with self.clock("factor"):
            self.solver.factorise(values)
        self.stiffness = float(np.linalg.norm(values[self.diagonal]))
        self.pairs.clear()
        self.factorisations += 1
        self.valid = True

    def learn(self, step: np.ndarray, change: np.ndarray) -> None:
        """Remember that `step` changed the residual by `change`, unless the curvature is not positive."""
        curvature = float(step @ change)
        if curvature > 1e-12 * float(np.linalg.norm(step) * np.linalg.norm(change)):
            self.pairs.append((step, change, 1 / curvature))
            del self.pairs[:-PAIRS]

    def direction(self, residual: np.ndarray) -> np.ndarray:
        """Quasi-Newton step (n,) for the residual (n,): BFGS two-loop recursion around the old factor."""
        rest, weights = residual.copy(), []
        for step, change, inverse in reversed(self.pairs):
            weights.append(inverse * float(step @ rest))
            rest -= weights[-1] * change
        with self.clock("solve"):
            move = self.solver.solve(rest)
        for (step, change, inverse), weight in zip(self.pairs, reversed(weights), strict=True):
            move += (weight - inverse * float(change @ move)) * step
        return -move


def solve(equation: Equation, guess: np.ndarray, memory: Memory) -> np.ndarray:
    """Unknowns (n,) where the residual vanishes, from a guess (n,).

    The error that the contraction predicts is below TOLERANCE x the largest displacement, or the
    residual is at round-off. Raises NewtonFailure: "newton_diverged", "not_finite", "singular_tangent".
    """
    try:
        return _iterate(equation, guess, memory)
    except SingularTangent as error:
        memory.forget()
        raise NewtonFailure("singular_tangent", str(error)) from error
    except NewtonFailure:
        memory.forget()
        raise


def _iterate(equation: Equation, guess: np.ndarray, memory: Memory) -> np.ndarray:
    """The iteration of `solve`."""
    u, factors, size = guess, 0, math.inf
    residual = _residual(equation, u, memory)
    for _ in range(MOST_ITERATIONS):
        grip = None if equation.grip is None else equation.grip()
        if not memory.valid or _loosened(memory.grip, grip):
            if factors == MOST_FACTORS:
                break
            memory.factorise(equation.tangent, u)
            memory.grip = grip
            factors += 1
        step = memory.direction(residual)
        old, residual = residual, _residual(equation, u + step, memory)
        memory.iterations += 1
        last, size = size, float(np.abs(step).max())
        allowed = TOLERANCE * max(float(np.abs(u + step).max()), equation.scale)
        if equation.grip is not None and size > FAR * allowed and np.linalg.norm(residual) > np.linalg.norm(old):
            u, residual = _shortened(equation, u, step, old, memory)
            size = math.inf
            memory.forget()
            continue
        u = u + step
        if _settled(size, last, allowed) or np.linalg.norm(residual) <= _round_off(memory, u):
            return u
        memory.learn(step, residual - old)
        if _too_slow(size, last, allowed):
            if factors >= MOST_FACTORS:
                break
            memory.forget()
    raise NewtonFailure("newton_diverged", f"no equilibrium after {MOST_ITERATIONS} iterations or {factors} factors")


def solve_mixed(
    residual: Callable[[np.ndarray, np.ndarray], np.ndarray],
    tangent: Callable[[np.ndarray, np.ndarray], np.ndarray],
    guess: np.ndarray,
    scale: float,
    memory: Memory,
) -> np.ndarray:
    """A point near the equilibrium, by Newton with independent stresses at the integration points.

    residual(u, step) and tangent(u, step) use the stress that was predicted before the last step, which
    spares a thin body the spurious membrane stress of a large rotation (Magisano, Leonetti, Garcea,
    IJNME 2017, "mixed integration points"). Ends where the contraction is CLOSE; `solve` does the rest.
    Raises NewtonFailure like `solve`.
    """
    u, step = guess, np.zeros_like(guess)
    for _ in range(MOST_FACTORS):
        try:
            memory.factorise(lambda u, step=step: tangent(u, step), u)
            with memory.clock("force"):
                rest = residual(u, step)
            step = memory.direction(rest)
        except SingularTangent as error:
            memory.forget()
            raise NewtonFailure("singular_tangent", str(error)) from error
        u = u + step
        memory.iterations += 1
        size = float(np.abs(step).max())
        if not math.isfinite(size):
            raise NewtonFailure("not_finite", "a Newton step is not finite")
        if size < CLOSE * max(float(np.abs(u - guess).max()), scale):
            return u
    raise NewtonFailure("newton_diverged", f"no equilibrium after {MOST_FACTORS} factorisations")


def _residual(equation: Equation, u: np.ndarray, memory: Memory) -> np.ndarray:
    """The residual, or a failure where it is not finite."""
    with memory.clock("force"):
        residual = equation.residual(u)
    if not np.isfinite(residual).all():
        raise NewtonFailure("not_finite", "the residual is not finite")
    return residual


def _settled(size: float, last: float, allowed: float) -> bool:
    """Whether the error left after a step of this size, rate / (1 - rate) of it, is allowed."""
    rate = size / last
    return size == 0 or (math.isfinite(last) and rate < 1 and size * rate / (1 - rate) <= allowed)


def _too_slow(size: float, last: float, allowed: float) -> bool:
    """Whether more than PATIENCE iterations remain at the observed rate."""
    if not math.isfinite(last):
        return False
    rate = size / last
    return rate >= 1 or math.log(allowed / size) / math.log(rate) > PATIENCE


def _shortened(
    equation: Equation, u: np.ndarray, step: np.ndarray, old: np.ndarray, memory: Memory
) -> tuple[np.ndarray, np.ndarray]:
    """Where the step (n,) from u leads if it is halved until the residual falls, at most HALVINGS times, and the
    residual there (n,); `old` is that at u."""
    for k in range(1, HALVINGS + 1):
        there = u + step / 2**k
        new = _residual(equation, there, memory)
        if np.linalg.norm(new) <= np.linalg.norm(old):
            break
    return there, new


def _loosened(old: np.ndarray | None, new: np.ndarray | None) -> bool:
    """Whether obstacles hold some node so much more or less than when the tangent was formed that it is of no use."""
    return new is not None and old is not None and bool(np.any(np.abs(new - old) > GRIP * (1 + old)))


def _round_off(memory: Memory, u: np.ndarray) -> float:
    """Norm of the residual that rounding the displacements alone would cause (N)."""
    return float(np.finfo(float).eps * memory.stiffness * np.abs(u).max())
