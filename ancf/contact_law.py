"""The law of contact at a point: pressure, friction, and their derivatives.

At a point with the gap g, the penetration d = -g and the normal n out of the body, moving at v:

    p = max(0, k <d> + c theta d'),    <d> = max(0, d),    d' = -n . v
    t* = -(k_s s + c_s v_t),    t = t* where |t*| <= mu p (stick), mu p t*/|t*| beyond (slide)

with the slip s, which a step takes on by the tangential motion of the point. Where it slides, s falls back to the
length mu p / k_s, if it is longer: a spring that its damper lets slide early does not stretch. theta is the part of a
step that the point has spent inside: 1 where it began inside, else <d1> / (d1 - d0).
Without it the damper's force jumps as a point enters, and a step may have no solution at all; with it every force is
continuous and differs from the law by less than one step's.

At the end of a step (`pressure_at_end`; statics, trapezoidal rule, generalized-alpha) the law is taken as it stands.
For the energy-momentum scheme (`pressure_in_mean`) the spring's force is that of a discrete gradient,

    p_k = [U(d1) - U(d0)] / (d1 - d0) = k theta (<d0> + <d1>) / 2,    U = k <d>^2 / 2,
    theta = (<d1> - <d0>) / (d1 - d0)

along the mean normal of `ancf.obstacle`, which does exactly the work U0 - U1; the damper's c (<d1> - <d0>) / dt only
takes energy, and so does friction, return-mapped at the end of the step.

The derivative of a sliding friction by the gap, mu t*/|t*| (x) p_x, is not symmetric.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ancf.obstacle import Obstacle

TINY = np.finfo(float).tiny


class Law(NamedTuple):
    """Stiffness, damping, friction coefficient, stiffness and damping of stick; per area, or per point where w = 1."""

    stiffness: float
    damping: float
    friction: float
    stick_stiffness: float
    stick_damping: float


class Motion(NamedTuple):
    """What points did in a step: x0, x1 (m, 3), penetrations d0, d1 (m,), negative outside, the velocity v (m, 3) that
    counts and its derivative rate (1/s) by x1."""

    x0: np.ndarray
    x1: np.ndarray
    d0: np.ndarray
    d1: np.ndarray
    v: np.ndarray
    rate: float


class Normal(NamedTuple):
    """Pressure p (m,) and the direction n (m, 3) that it acts in."""

    p: np.ndarray
    n: np.ndarray


class Friction(NamedTuple):
    """Traction t (m, 3), whether the point slides (m,), and the slip (m, 3) behind it."""

    t: np.ndarray
    slides: np.ndarray
    slip: np.ndarray


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (m,) of vectors (m, 3)."""
    return np.einsum("mc,mc->m", a, b)


def outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dyads (m, 3, 3) of vectors (m, 3)."""
    return a[:, :, None] * b[:, None, :]


def part_inside(d0: np.ndarray, d1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """theta (m,) of points that ended at the penetration d1, and its derivative by d1; 0 where d1 <= 0."""
    inside, outside = np.maximum(d1, 0.0), np.minimum(d0, 0.0)
    whole = np.where(inside > 0, inside - outside, 1.0)
    return inside / whole, np.where(inside > 0, -outside / whole**2, 0.0)


def pressure_at_end(law: Law, obstacle: Obstacle, motion: Motion) -> Normal:
    """The law as it stands at the end of a step."""
    n = obstacle.normals(motion.x1)
    speed, (theta, _) = -dot(n, motion.v), part_inside(motion.d0, motion.d1)
    p = law.stiffness * np.maximum(motion.d1, 0.0) + law.damping * theta * speed
    return Normal(np.maximum(p, 0.0), n)


def pressure_at_end_x(law: Law, obstacle: Obstacle, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives p_x (m, 3) and n_x (m, 3, 3) of `pressure_at_end` by x1."""
    n, n_x = obstacle.normals(motion.x1), obstacle.turning(motion.x1)
    speed, (theta, theta_d) = -dot(n, motion.v), part_inside(motion.d0, motion.d1)
    pushes = law.stiffness * np.maximum(motion.d1, 0.0) + law.damping * theta * speed >= 0
    p_d = pushes * (law.stiffness + law.damping * theta_d * speed)
    speed_x = -(motion.rate * n + np.einsum("mc,mca->ma", motion.v, n_x))
    return (pushes * law.damping * theta)[:, None] * speed_x - p_d[:, None] * n, n_x


def part_crossed(d0: np.ndarray, d1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(<d1> - <d0>) / (d1 - d0) (m,) and its derivative by d1."""
    is_in, crosses = (d1 > 0).astype(float), (d0 > 0) != (d1 > 0)
    length = np.where(crosses, d1 - d0, 1.0)
    theta = np.where(crosses, (np.maximum(d1, 0.0) - np.maximum(d0, 0.0)) / length, is_in)
    return theta, np.where(crosses, (is_in - theta) / length, 0.0)


def pressure_in_mean(law: Law, obstacle: Obstacle, motion: Motion) -> Normal:
    """The mean over a step that does the work of the spring's energy."""
    inside0, inside1 = np.maximum(motion.d0, 0.0), np.maximum(motion.d1, 0.0)
    theta, _ = part_crossed(motion.d0, motion.d1)
    p = law.stiffness / 2 * theta * (inside0 + inside1) + law.damping * motion.rate * (inside1 - inside0)
    return Normal(np.maximum(p, 0.0), obstacle.mean_normals(motion.x0, motion.x1))


def pressure_in_mean_x(law: Law, obstacle: Obstacle, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives p_x (m, 3) and n_x (m, 3, 3) of `pressure_in_mean` by x1."""
    inside0, inside1 = np.maximum(motion.d0, 0.0), np.maximum(motion.d1, 0.0)
    (theta, theta_d), is_in, both = part_crossed(motion.d0, motion.d1), motion.d1 > 0, inside0 + inside1
    pushes = law.stiffness / 2 * theta * both + law.damping * motion.rate * (inside1 - inside0) >= 0
    p_d = law.stiffness / 2 * (theta * is_in + theta_d * both) + law.damping * motion.rate * is_in
    return -(pushes * p_d)[:, None] * obstacle.normals(motion.x1), obstacle.mean_turning(motion.x0, motion.x1)


def _trial(law: Law, n: np.ndarray, motion: Motion, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slip that the step has taken on (m, 3), what it pulls with, and the part t* of that along the body."""
    taken = slip + motion.x1 - motion.x0
    pull = -(law.stick_stiffness * taken + law.stick_damping * motion.v)
    return taken, pull, pull - dot(n, pull)[:, None] * n


def friction(law: Law, obstacle: Obstacle, motion: Motion, p: np.ndarray, slip: np.ndarray) -> Friction:
    """Return-mapped Coulomb friction at the end of a step that began with the slip (m, 3); p (m,) presses."""
    n = obstacle.normals(motion.x1)
    taken, _, trial = _trial(law, n, motion, slip)
    size, most = np.sqrt(dot(trial, trial)), law.friction * p
    slides = size > most
    t = np.divide(most, size, out=np.ones_like(size), where=slides)[:, None] * trial
    stuck = taken - dot(n, taken)[:, None] * n
    held = np.minimum(1.0, most / law.stick_stiffness / np.maximum(np.sqrt(dot(stuck, stuck)), TINY))
    return Friction(t, slides, np.where(slides, held, 1.0)[:, None] * stuck)


def friction_x(
    law: Law, obstacle: Obstacle, motion: Motion, p: np.ndarray, slip: np.ndarray, p_x: np.ndarray
) -> np.ndarray:
    """Derivative (m, 3, 3) of the traction by x1, where that of p is p_x (m, 3)."""
    n, n_x = obstacle.normals(motion.x1), obstacle.turning(motion.x1)
    _, pull, trial = _trial(law, n, motion, slip)
    trial_x = -(law.stick_stiffness + law.stick_damping * motion.rate) * (np.eye(3) - outer(n, n))
    trial_x = trial_x - dot(n, pull)[:, None, None] * n_x - outer(n, np.einsum("mc,mcb->mb", pull, n_x))
    size = np.maximum(np.sqrt(dot(trial, trial)), TINY)
    way, slides = trial / size[:, None], (size > law.friction * p)[:, None, None]
    turned = trial_x - outer(way, np.einsum("mc,mcb->mb", way, trial_x))
    sliding = law.friction * (outer(way, p_x) + (p / size)[:, None, None] * turned)
    return np.where(slides, sliding, trial_x)
