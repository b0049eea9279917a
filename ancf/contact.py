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
from ancf.face import Face
from ancf.obstacle import Obstacle

EPSILON = np.finfo(float).eps
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
