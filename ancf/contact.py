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

EPSILON = np.finfo(float).eps
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


class Normal(NamedTuple):
    """Pressure p (m,), its derivative p_x (m, 3) by the point; the direction n (m, 3) it acts in and n_x (m, 3, 3)."""

    p: np.ndarray
    p_x: np.ndarray
    n: np.ndarray
    n_x: np.ndarray


class Friction(NamedTuple):
    """Traction t (m, 3), its derivative t_x (m, 3, 3) by the point, and the slip (m, 3) behind it."""

    t: np.ndarray
    t_x: np.ndarray
    slip: np.ndarray


class Motion(NamedTuple):
    """What points did in a step: x0, x1 (m, 3), the velocity v (m, 3) that counts, its derivative rate (1/s) by x1."""

    x0: np.ndarray
    x1: np.ndarray
    v: np.ndarray
    rate: float

    def of(self, near: np.ndarray) -> Motion:
        """That of some points."""
        return Motion(self.x0[near], self.x1[near], self.v[near], self.rate)


def part_inside(d0: np.ndarray, d1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """theta (m,) of points that ended at the penetration d1, and its derivative by d1; 0 where d1 <= 0."""
    inside, outside = np.maximum(d1, 0.0), np.minimum(d0, 0.0)
    whole = np.where(inside > 0, inside - outside, 1.0)
    return inside / whole, np.where(inside > 0, -outside / whole**2, 0.0)


def pressure_at_end(law: Law, obstacle: Obstacle, motion: Motion) -> Normal:
    """The law as it stands at the end of a step."""
    x0, x1, v, rate = motion
    n, n_x = obstacle.normals(x1), obstacle.turning(x1)
    d0, d1 = -obstacle.gap(x0), -obstacle.gap(x1)
    speed = -np.einsum("mc,mc->m", n, v)
    theta, theta_d = part_inside(d0, d1)
    p = law.stiffness * np.maximum(d1, 0.0) + law.damping * theta * speed
    pulls = p < 0
    p_d = np.where(pulls, 0.0, law.stiffness + law.damping * theta_d * speed)
    p_speed = np.where(pulls, 0.0, law.damping * theta)
    speed_x = -(rate * n + np.einsum("mc,mca->ma", v, n_x))
    return Normal(np.maximum(p, 0.0), -p_d[:, None] * n + p_speed[:, None] * speed_x, n, n_x)


def pressure_in_mean(law: Law, obstacle: Obstacle, motion: Motion) -> Normal:
    """The mean over a step that does the work of the spring's energy."""
    x0, x1, _, rate = motion
    d0, d1 = -obstacle.gap(x0), -obstacle.gap(x1)
    inside0, inside1, is_in = np.maximum(d0, 0.0), np.maximum(d1, 0.0), (d1 > 0).astype(float)
    crosses = (d0 > 0) != (d1 > 0)
    length = np.where(crosses, d1 - d0, 1.0)
    theta = np.where(crosses, (inside1 - inside0) / length, is_in)
    theta_d = np.where(crosses, (is_in - theta) / length, 0.0)
    sum_ = inside0 + inside1
    p = law.stiffness / 2 * theta * sum_ + law.damping * rate * (inside1 - inside0)
    p_d = law.stiffness / 2 * (theta * is_in + theta_d * sum_) + law.damping * rate * is_in
    n, n_x = obstacle.mean_normals(x0, x1)
    return Normal(np.maximum(p, 0.0), -np.where(p < 0, 0.0, p_d)[:, None] * obstacle.normals(x1), n, n_x)


def friction(law: Law, obstacle: Obstacle, motion: Motion, normal: Normal, slip: np.ndarray) -> Friction:
    """Return-mapped Coulomb friction at the end of a step that began with the slip (m, 3)."""
    x0, x1, v, rate = motion
    n, n_x = obstacle.normals(x1), obstacle.turning(x1)
    along = np.eye(3) - n[:, :, None] * n[:, None, :]
    taken = slip + x1 - x0
    pull = -(law.stick_stiffness * taken + law.stick_damping * v)
    trial = np.einsum("mab,mb->ma", along, pull)
    trial_x = -(law.stick_stiffness + law.stick_damping * rate) * along
    if not obstacle.flat:
        across = np.einsum("mc,mc->m", n, pull)
        trial_x -= across[:, None, None] * n_x + n[:, :, None] * np.einsum("mc,mcb->mb", pull, n_x)[:, None, :]
    size, most = np.linalg.norm(trial, axis=1), law.friction * normal.p
    slides = (size > most)[:, None]
    size = np.maximum(size, np.finfo(float).tiny)
    way = trial / size[:, None]
    t = np.where(slides, most[:, None] * way, trial)
    turned = (most / size)[:, None, None] * (trial_x - way[:, :, None] * np.einsum("mc,mcb->mb", way, trial_x)[:, None])
    t_x = np.where(slides[..., None], law.friction * way[:, :, None] * normal.p_x[:, None, :] + turned, trial_x)
    stuck = np.einsum("mab,mb->ma", along, taken)
    return Friction(t, t_x, np.where(slides, -t / law.stick_stiffness, stuck))


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
    """What the points near (m,) of a pair feel: forces (m, 3) in N, their derivative (m, 3, 3) by the points, parts."""

    near: np.ndarray
    force: np.ndarray
    force_x: np.ndarray
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
    def gap0(self) -> np.ndarray:
        """Gaps (n,) at the start of the step."""
        return self.pair.obstacle.gap(self.x0)

    def answer(self, q: np.ndarray) -> Answer | None:
        """Forces at the components q (3 v,); None where no point is near the body, which one look at the gaps tells."""
        pair = self.pair
        x1 = pair.face.positions(q)
        slack = TOUCHING * np.abs(x1).max()
        touches = pair.obstacle.gap(x1) <= slack
        if self.mean:
            touches |= self.gap0 < 0
        near = np.flatnonzero(touches)
        if not near.size:
            return None
        motion = Motion(self.x0, x1, self.base + self.rate * x1, self.rate).of(near)
        law, share = pair.law, pair.share[near]
        normal = (pressure_in_mean if self.mean else pressure_at_end)(law, pair.obstacle, motion)
        p, p_x, n, n_x = normal
        force, force_x = p[:, None] * n, n[:, :, None] * p_x[:, None, :] + p[:, None, None] * n_x
        rubbing = None
        if law.friction:
            rubbing = friction(law, pair.obstacle, motion, normal, self.touch.slip[near])
            force, force_x = force + rubbing.t, force_x + rubbing.t_x
        return Answer(near, share[:, None] * force, share[:, None, None] * force_x, normal, rubbing)

    def touched(self, q: np.ndarray, answer: Answer | None) -> Touch:
        """State behind a step that ended at q, where the points feel `answer`."""
        after, law, w = self.pair.untouched(), self.pair.law, self.pair.share
        x1, lost = self.pair.face.positions(q), 0.0
        d0, d1 = -self.gap0, -self.pair.obstacle.gap(x1)
        if answer is not None:
            after.pressure[answer.near] = answer.normal.p
            if answer.friction is not None:
                after.friction[answer.near], after.slip[answer.near] = answer.friction.t, answer.friction.slip
            after = after._replace(force=answer.force.sum(axis=0))
        stored = float(w @ (law.stiffness * np.maximum(d1, 0) ** 2)) / 2
        if self.mean:
            spring = law.stiffness * (np.maximum(d1, 0.0) ** 2 - np.maximum(d0, 0.0) ** 2) / 2
            lost = float(w @ (after.pressure * (d1 - d0) - spring))
        elif self.dt is not None and answer is not None:
            n, near = answer.normal.n, answer.near
            speed = -np.einsum("mc,mc->m", n, self.base[near] + self.rate * x1[near])
            power = float((w * (after.pressure - law.stiffness * np.maximum(d1, 0.0)))[near] @ speed)
            after = after._replace(power=power)
        if self.dt is not None and not self.mean:
            lost = self.dt / 2 * (self.touch.power + after.power)
        rubbed, held = self._rubbed(x1, after)
        stored, dissipated = stored + held, self.touch.dissipated + lost + rubbed
        return after._replace(stored=stored, dissipated=dissipated, most=max(self.touch.most, stored + dissipated))

    def _rubbed(self, x1: np.ndarray, after: Touch) -> tuple[float, float]:
        """Energy (J) that the friction took in a step, and that its springs hold behind it."""
        if not self.pair.law.friction:
            return 0.0, 0.0
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
                every = np.zeros_like(meeting.x0)
                every[answer.near] = answer.force
                total += meeting.pair.face.spread(every)
        return total

    def tangent_contact(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Values (nnz,) of minus the force's derivative, its lower triangle and that of its transpose."""
        found = None
        for meeting, answer in zip(self.meetings, self.answers(q), strict=True):
            if answer is not None:
                own = meeting.pair.face.matrix(answer.near, -answer.force_x)
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
