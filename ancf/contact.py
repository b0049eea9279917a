"""Penalty contact of the plate's faces with rigid bodies: gap, pressure, friction, their forces and tangents.

At a point with the gap g, the penetration d = -g and the normal n out of the body, moving at v:

    p = max(0, k <d> + c theta d'),    <d> = max(0, d),    d' = -n . v
    t* = -(k_s s + c_s v_t),    t = t* where |t*| <= mu p (stick), mu p t*/|t*| beyond (slide),
    f = w (p n + t)

with the slip s, which a step takes on by the tangential motion of the point and which falls back to -t / k_s where it
slides, and the area w that the point stands for. theta is the part of a step that the point has spent inside: 1
where it began inside, else <d1> / (d1 - d0). Without it the damper's force jumps as a point enters, and a step may have
no solution at all; with it every force is continuous and differs from the law by less than one step's.

At the end of a step (`pressure_at_end`; statics, trapezoidal rule, generalized-alpha) the law is taken as it stands.
For the energy-momentum scheme (`pressure_in_mean`) the spring's force is that of a discrete gradient,

    p_k = [U(d1) - U(d0)] / (d1 - d0) = k theta (<d0> + <d1>) / 2,    U = k <d>^2 / 2,
    theta = (<d1> - <d0>) / (d1 - d0)

along the mean normal of `ancf.obstacle`, which does exactly the work U0 - U1; the damper's c (<d1> - <d0>) / dt and
the friction, return-mapped at the end of the step, only take energy. What they take is counted, so that
kinetic + strain + contact + dissipated - external stays what it was.

The derivative of a sliding friction by the gap, mu t*/|t*| (x) p_x, is not symmetric; it is kept, see
`LinearSolver.factorise`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ancf.face import Face
from ancf.obstacle import Obstacle

EPSILON, TINY = np.finfo(float).eps, np.finfo(float).tiny
TOUCHING = 1e-12  # m per m of size: a point as near as this is pressed for the tangent, so that a plate may lie down


class Law(NamedTuple):
    """Stiffness, damping, friction coefficient, stiffness and damping of stick; per area, or per point where w = 1."""

    stiffness: float
    damping: float
    friction: float
    stick_stiffness: float
    stick_damping: float


class Touch(NamedTuple):
    """State of a pair at the end of a step that was accepted.

    slip and friction (n, 3), pressure (n,): per area or point. force (3,): resultant on the plate (N). stored and
    dissipated since the start (J), and the most that both have been; power (W) that the dampers take.
    """

    slip: np.ndarray
    friction: np.ndarray
    pressure: np.ndarray
    force: np.ndarray
    stored: float
    dissipated: float
    most: float
    power: float


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
    t = np.where(slides, most / np.maximum(size, TINY), 1.0)[:, None] * trial
    stuck = taken - dot(n, taken)[:, None] * n
    return Friction(t, slides, np.where(slides[:, None], -t / law.stick_stiffness, stuck))


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


@dataclass(frozen=True, eq=False)
class Pair:
    """A face of the plate and the body that it may touch. share (n,): area (m2) of each point; 1, forces by point."""

    face: Face
    obstacle: Obstacle
    law: Law
    share: np.ndarray

    def untouched(self) -> Touch:
        """State before anything has touched."""
        n = len(self.share)
        return Touch(np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(3), 0.0, 0.0, 0.0, 0.0)

    def stiffness(self, rate: float) -> float:
        """Greatest resultant stiffness (N/m)."""
        law, sticks = self.law, self.law.friction > 0
        normal, along = law.stiffness + rate * law.damping, law.stick_stiffness + rate * law.stick_damping
        return float(self.share.sum()) * (normal + sticks * along)


class Answer(NamedTuple):
    """What the points near (m,) of a pair feel, and what they did: forces (m, 3) in N and their parts."""

    near: np.ndarray
    motion: Motion
    force: np.ndarray
    normal: Normal
    friction: Friction | None


@dataclass(frozen=True, eq=False)
class Meeting:
    """One pair in one step: positions x0 (n, 3) and state it begins with, velocities base + rate x1.

    dt: None in statics. mean: whether the forces are means over the step.
    """

    pair: Pair
    touch: Touch
    x0: np.ndarray
    base: np.ndarray
    rate: float
    dt: float | None
    mean: bool

    @cached_property
    def d0(self) -> np.ndarray:
        """Penetrations (n,) at the start of the step."""
        return -self.pair.obstacle.gap(self.x0)

    def answer(self, q: np.ndarray) -> Answer | None:
        """Forces at the components q (3 v,); None where no point is near the body, which one look at the gaps tells."""
        pair = self.pair
        x1 = pair.face.positions(q)
        d1 = -pair.obstacle.gap(x1)
        touches = d1 >= -TOUCHING * np.abs(x1).max()
        if self.mean:
            touches |= self.d0 > 0
        near = np.flatnonzero(touches)
        if not near.size:
            return None
        x0, x1, base = self.x0[near], x1[near], self.base[near]
        motion = Motion(x0, x1, self.d0[near], d1[near], base + self.rate * x1, self.rate)
        normal = (pressure_in_mean if self.mean else pressure_at_end)(pair.law, pair.obstacle, motion)
        force, rubbing = normal.p[:, None] * normal.n, None
        if pair.law.friction:
            rubbing = friction(pair.law, pair.obstacle, motion, normal.p, self.touch.slip[near])
            force += rubbing.t
        return Answer(near, motion, pair.share[near][:, None] * force, normal, rubbing)

    def force_x(self, answer: Answer) -> np.ndarray:
        """Derivative (m, 3, 3) of the answer's forces by the points."""
        pair, (near, motion, _, normal, _) = self.pair, answer
        p_x, n_x = (pressure_in_mean_x if self.mean else pressure_at_end_x)(pair.law, pair.obstacle, motion)
        force_x = outer(normal.n, p_x) + normal.p[:, None, None] * n_x
        if pair.law.friction:
            force_x += friction_x(pair.law, pair.obstacle, motion, normal.p, self.touch.slip[near], p_x)
        return pair.share[near][:, None, None] * force_x

    def touched(self, q: np.ndarray, answer: Answer | None) -> Touch:
        """State behind a step that ended at q, where the points feel `answer`."""
        after, before, lost = self.pair.untouched(), self.touch, 0.0
        stored = power = 0.0
        if answer is not None:
            near, motion, force, normal, rubbing = answer
            w, inside = self.pair.share[near], np.maximum(motion.d1, 0.0)
            after.pressure[near] = normal.p
            if rubbing is not None:
                after.friction[near], after.slip[near] = rubbing.t, rubbing.slip
            stored = self.pair.law.stiffness / 2 * float(w @ inside**2)
            if self.mean:
                spring = self.pair.law.stiffness / 2 * (inside**2 - np.maximum(motion.d0, 0.0) ** 2)
                lost = float(w @ (normal.p * (motion.d1 - motion.d0) - spring))
            else:
                power = -float(w * (normal.p - self.pair.law.stiffness * inside) @ dot(normal.n, motion.v))
            after = after._replace(force=force.sum(axis=0), power=power)
        if self.dt is not None and not self.mean:
            lost = self.dt / 2 * (before.power + power)
        rubbed, held = self._rubbed(self.pair.face.positions(q), after) if self.pair.law.friction else (0.0, 0.0)
        stored, dissipated = stored + held, before.dissipated + lost + rubbed
        return after._replace(stored=stored, dissipated=dissipated, most=max(before.most, stored + dissipated))

    def _rubbed(self, x1: np.ndarray, after: Touch) -> tuple[float, float]:
        """Energy (J) that the friction took in a step, and that its springs hold behind it."""
        w, k, before = self.pair.share, self.pair.law.stick_stiffness, self.touch
        acted = after.friction if self.mean else (before.friction + after.friction) / 2
        held0, held1 = (k / 2 * float(w @ np.einsum("nc,nc->n", s, s)) for s in (before.slip, after.slip))
        work = float(w @ np.einsum("nc,nc->n", acted, x1 - self.x0))
        return -work - (held1 - held0), held1


@dataclass(eq=False)
class Step:
    """All pairs in one step. It remembers its last answers: force, tangent and state are asked for at the same q."""

    meetings: tuple[Meeting, ...]
    _at: np.ndarray | None = None
    _answers: tuple[Answer | None, ...] = ()

    def answers(self, q: np.ndarray) -> tuple[Answer | None, ...]:
        """What each pair feels at the components q (3 v,), which are not changed afterwards."""
        if self._at is not q:
            self._at, self._answers = q, tuple(meeting.answer(q) for meeting in self.meetings)
        return self._answers

    def force_contact(self, q: np.ndarray) -> np.ndarray:
        """Forces on the plate (3 v,) at the components q (3 v,)."""
        total = np.zeros_like(q)
        for meeting, answer in zip(self.meetings, self.answers(q), strict=True):
            if answer is not None:
                total += meeting.pair.face.spread(answer.near, answer.force)
        return total

    def tangent_contact(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Values (nnz,) of minus the force's derivative, its lower triangle and that of its transpose."""
        found = None
        for meeting, answer in zip(self.meetings, self.answers(q), strict=True):
            if answer is not None:
                own = meeting.pair.face.matrix(answer.near, -meeting.force_x(answer))
                found = own if found is None else tuple(a + b for a, b in zip(found, own, strict=True))
        return found

    def round_off(self, q: np.ndarray) -> float:
        """Round-off (N) of the forces: that of the positions times the stiffness."""
        stiffness = sum(meeting.pair.stiffness(meeting.rate) for meeting in self.meetings)
        return EPSILON * stiffness * float(np.abs(q).max())

    def touched(self, q: np.ndarray) -> tuple[Touch, ...]:
        """State of each pair behind a step that ended at q."""
        return tuple(meeting.touched(q, answer) for meeting, answer in zip(self.meetings, self.answers(q), strict=True))


@dataclass(frozen=True, eq=False)
class Contact:
    """All pairs of a face and a body."""

    pairs: tuple[Pair, ...]

    def untouched(self) -> tuple[Touch, ...]:
        """State of each pair before anything has touched."""
        return tuple(pair.untouched() for pair in self.pairs)

    def at_rest(self, q: np.ndarray, touches: Sequence[Touch]) -> Step:
        """A load step from q."""
        return self._step(q, touches, np.zeros_like(q), 0.0, None, False)

    def at_end(self, q: np.ndarray, touches: Sequence[Touch], base: np.ndarray, rate: float, dt: float) -> Step:
        """A step of length dt from q whose forces are those of its end, where the velocity is base + rate q1."""
        return self._step(q, touches, base, rate, dt, False)

    def in_mean(self, q: np.ndarray, touches: Sequence[Touch], dt: float) -> Step:
        """A step of length dt from q whose forces are means over it."""
        return self._step(q, touches, -q / dt, 1 / dt, dt, True)

    def _step(self, q, touches, base: np.ndarray, rate: float, dt: float | None, mean: bool) -> Step:
        return Step(
            tuple(
                Meeting(pair, touch, pair.face.positions(q), pair.face.positions(base), rate, dt, mean)
                for pair, touch in zip(self.pairs, touches, strict=True)
            )
        )
