"""Penalty contact of the plate's faces with rigid bodies: their points, forces, tangents, energies, and what they keep.

A point that stands for the area w, or for itself (w = 1), feels f = w (p n + t), the law of `ancf.contact_law`. What
its damper and its friction take is counted, so that kinetic + strain + contact + dissipated - external stays what it
was. The tangent of sliding friction is not symmetric; it is kept so, see `LinearSolver.factorise`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ancf.contact_law import (
    Friction,
    Law,
    Motion,
    Normal,
    dot,
    friction,
    friction_x,
    outer,
    pressure_at_end,
    pressure_at_end_x,
    pressure_in_mean,
    pressure_in_mean_x,
)
from ancf.face import Face, Some
from ancf.obstacle import Obstacle

EPSILON = np.finfo(float).eps
AHEAD = 2.0  # times the longest way of a step so far: points that far away are taken along
TOUCHING = 1e-12  # m per m of size: a point as near as this is pressed for the tangent, so that a plate may lie down


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


class Reach(NamedTuple):
    """The points of a face that may touch while no point moves beyond `far` (m); their positions x0 and velocities
    `base` (m, 3) as those of `Meeting`."""

    far: float
    some: Some
    x0: np.ndarray
    base: np.ndarray


class Answer(NamedTuple):
    """What the points near (m,) of a pair feel, and what they did: forces (m, 3) in N and their parts.

    force_all (3 v,): on the plate.
    """

    near: np.ndarray
    force_all: np.ndarray
    motion: Motion
    force: np.ndarray
    normal: Normal
    friction: Friction | None


@dataclass(eq=False)
class Meeting:
    """One pair in one step: components q0 (3 v,) and state it begins with, velocities base + rate q1 (3 v,).

    dt: None in statics. mean: whether the forces are means over the step. Points that are farther from the body than
    anything has moved are not looked at.
    """

    pair: Pair
    touch: Touch
    q0: np.ndarray
    base: np.ndarray
    rate: float
    dt: float | None
    mean: bool
    _reach: Reach | None = None

    @cached_property
    def d0(self) -> np.ndarray:
        """Penetrations (n,) at the start of the step."""
        return -self.pair.obstacle.gap(self.pair.face.positions(self.q0))

    def reach(self, q: np.ndarray) -> Reach:
        """The points that may touch on the way from q0 to q (3 v,), and those of ways AHEAD times as long."""
        face = self.pair.face
        far = face.farthest(q - self.q0) + TOUCHING * float(np.abs(q).max())
        if self._reach is None or not far <= self._reach.far:
            far *= AHEAD
            some = face.some(np.flatnonzero(~(self.d0 < -far)))
            self._reach = Reach(far, some, some.positions(self.q0), some.positions(self.base))
        return self._reach

    def answer(self, q: np.ndarray) -> Answer | None:
        """Forces at the components q (3 v,); None where no point is near the body, which one look at the gaps tells."""
        pair, (_, some, x0, base) = self.pair, self.reach(q)
        if not some.points.size:
            return None
        x1, d0 = some.positions(q), self.d0[some.points]
        d1 = -pair.obstacle.gap(x1)
        touches = d1 >= -TOUCHING * np.abs(x1).max()
        if self.mean:
            touches |= d0 > 0
        here = np.flatnonzero(touches)
        if not here.size:
            return None
        near, velocity = some.points[here], base[here] + self.rate * x1[here]
        motion = Motion(x0[here], x1[here], d0[here], d1[here], velocity, self.rate)
        normal = (pressure_in_mean if self.mean else pressure_at_end)(pair.law, pair.obstacle, motion)
        force, rubbing = normal.p[:, None] * normal.n, None
        if pair.law.friction:
            rubbing = friction(pair.law, pair.obstacle, motion, normal.p, self.touch.slip[near])
            force += rubbing.t
        force *= pair.share[near][:, None]
        every = np.zeros_like(x1)
        every[here] = force
        return Answer(near, some.spread(every), motion, force, normal, rubbing)

    def force_x(self, answer: Answer) -> np.ndarray:
        """Derivative (m, 3, 3) of the answer's forces by the points."""
        pair, (near, _, motion, _, normal, _) = self.pair, answer
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
            near, _, motion, force, normal, rubbing = answer
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
        rubbed, held = self._rubbed(q, after) if self.pair.law.friction else (0.0, 0.0)
        stored, dissipated = stored + held, before.dissipated + lost + rubbed
        return after._replace(stored=stored, dissipated=dissipated, most=max(before.most, stored + dissipated))

    def _rubbed(self, q: np.ndarray, after: Touch) -> tuple[float, float]:
        """Energy (J) that the friction took in a step to q, and that its springs hold behind it."""
        w, k, before, (_, some, x0, _) = self.pair.share, self.pair.law.stick_stiffness, self.touch, self.reach(q)
        acted = after.friction if self.mean else (before.friction + after.friction) / 2
        held0, held1 = (k / 2 * float(w @ np.einsum("nc,nc->n", s, s)) for s in (before.slip, after.slip))
        moved = some.positions(q) - x0  # what rubs is pressed at one end, and so within reach
        work = float(w[some.points] @ np.einsum("nc,nc->n", acted[some.points], moved))
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
        for answer in self.answers(q):
            if answer is not None:
                total += answer.force_all
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
                Meeting(pair, touch, q, base, rate, dt, mean) for pair, touch in zip(self.pairs, touches, strict=True)
            )
        )
