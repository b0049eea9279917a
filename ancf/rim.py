"""A rigid rim that holds edges of the plate: its stated motion, and the few equations that are left where it is free.

With R the rotation by spin t about the origin of space and u the rim's translation, a position X of a held edge goes to
R X + u, and its director and gradient V along the edge to R V; the gradient out of the edge is free, as at a clamp.
What is stated is held, and moves (`Motion`). Along a free direction the positions are tied: they move alike, and the
sum of their residuals is one equation, which is kept at the first of them, the others' being zero (`Rim.sums`).
`ancf.border` solves with the tied unknowns as a border of one column for each free direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ancf.loads import factor_at
from ancf.mesh import Mesh
from ancf.supports import clamp


class Motion(NamedTuple):
    """What is stated of q, v and a (3 v,) at one time, the translation in free directions left out; else zero."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


@dataclass(frozen=True, eq=False)
class Rim:
    """initial (v, 3): the vectors that move with the rim, zero elsewhere; is_position (v,): those that u moves.

    row (v,): weights of positions whose mean is the rim's centre. held and tied (3 v,): components whose motion is
    stated, and those along the free directions. mass in kg, displacement in m times its history, spin in rad/s.
    """

    initial: np.ndarray
    is_position: np.ndarray
    row: np.ndarray
    free: tuple[int, ...]
    held: np.ndarray
    tied: np.ndarray
    mass: float
    displacement: np.ndarray
    history: tuple[tuple[float, float], ...]
    spin: np.ndarray

    def factor(self, t: float) -> float:
        """Factor of the displacement at time t."""
        return factor_at(self.history, t)

    @property
    def masters(self) -> list[int]:
        """Component (of 3 v) that stands for each free direction."""
        return [3 * int(np.flatnonzero(self.is_position)[0]) + a for a in self.free]

    @property
    def spared(self) -> int:
        """How many unknowns fewer there are as tied ones move as one."""
        return int(self.tied.sum()) - len(self.free)

    def inertia(self, a: np.ndarray) -> np.ndarray:
        """Force (3 v,) in N that the rim's mass takes at the accelerations a (3 v,)."""
        return np.outer(self.row, self.mass * (self.row @ a.reshape(-1, 3))).ravel()

    def motion(self, t: float) -> Motion:
        """The stated motion at time t; at a corner of the history the velocity is that before it."""
        turned = self.initial @ _rotation(self.spin, t).T
        position = self.is_position[:, None]
        q = turned + position * self.factor(t) * self.displacement
        v = np.cross(self.spin, turned) + position * _rate(self.history, t) * self.displacement
        a = np.cross(self.spin, np.cross(self.spin, turned))
        return Motion(q.ravel(), v.ravel(), a.ravel())

    def translation(self, q: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """Translation (3,) along free directions of q (3 v,), whose stated part is `stated`; of velocities likewise."""
        found = np.zeros(3)
        found[list(self.free)] = (self.row @ (q - stated).reshape(-1, 3))[list(self.free)]
        return found

    def placed(self, q: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """q (3 v,) with what moves with the rim where it has to be; of velocities and accelerations likewise."""
        u = np.outer(self.is_position, self.translation(q, stated)).ravel()
        return np.where(self.held | self.tied, stated + u, q)

    def sums(self, total: np.ndarray) -> np.ndarray:
        """Residuals (3 v,) with those of tied components summed into their masters."""
        found = np.where(self.tied, 0.0, total)
        found[self.masters] = [total.reshape(-1, 3)[self.is_position, a].sum() for a in self.free]
        return found

    def work(self, t0: float, t1: float, before: np.ndarray | None, after: np.ndarray) -> float:
        """Work (J) of the stated motion from t0 to t1 against forces (3 v,) at both ends, None at rest."""
        mean = (after if before is None else before + after) / 2
        moves = np.where(self.held | self.tied, self.motion(t1).q - self.motion(t0).q, 0.0)
        return float(mean @ moves)

    def size(self, total: np.ndarray) -> float:
        """Size (N) of forces (3 v,) on the positions whose motion is stated."""
        return float(np.linalg.norm(np.where(self.held, total, 0.0).reshape(-1, 3)[self.is_position]))

    def told(self, t: float, q: np.ndarray, pull: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At time t and q (3 v,): the rim's translation (m), and of forces (3 v,) on what moves with it their resultant
        (N) and moment about its centre (N m); without forces none."""
        stated = self.motion(t).q
        centre = self.factor(t) * self.displacement + self.translation(q, stated)
        forces = np.zeros_like(self.initial)
        if pull is not None:
            forces += np.where(self.held | self.tied, pull, 0.0).reshape(-1, 3)
        levers = q.reshape(-1, 3) - np.outer(self.is_position, centre)
        return centre, forces[self.is_position].sum(axis=0), np.cross(levers, forces).sum(axis=0)


def rim(
    mesh: Mesh,
    edges: Sequence[str],
    free: Sequence[int],
    taken: np.ndarray,
    mass: float,
    displacement: Sequence[float],
    history: Sequence[tuple[float, float]],
    spin: Sequence[float],
) -> Rim:
    """The rim of some edges of a mesh; taken (3 v,): components that supports hold already."""
    own = np.any([clamp(mesh, edge, "tangential") for edge in edges], axis=0) & ~taken
    of_vector = own.reshape(-1, 3).any(axis=1)
    is_position = of_vector & (mesh.kinds == "r")
    tied = np.zeros((len(of_vector), 3), dtype=bool)
    tied[np.ix_(is_position, list(free))] = True
    tied = tied.ravel() & own
    initial = np.where(of_vector[:, None], mesh.vectors, 0.0)
    row, spin = np.zeros(len(of_vector)), np.array(spin)
    row[is_position] = _weights(mesh.vectors[is_position], spin)
    stated = mass, np.array(displacement), tuple(map(tuple, history)), spin
    return Rim(initial, is_position, row, tuple(free), own & ~tied, tied, *stated)


def _weights(points: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """The least weights (n,) of sum 1 whose mean of the points (n, 3) is, where they spin, on the axis of the spin."""
    if not spin.any():
        return np.full(len(points), 1 / len(points))
    across = np.cross(points, spin / np.linalg.norm(spin))
    conditions = np.vstack([np.ones(len(points)), across.T])
    return np.linalg.lstsq(conditions, np.eye(4)[0], rcond=None)[0]


def _rotation(spin: np.ndarray, t: float) -> np.ndarray:
    """Rotation (3, 3) by spin t, Rodrigues' formula."""
    speed = float(np.linalg.norm(spin))
    if speed == 0:
        return np.eye(3)
    K = np.cross(np.eye(3), spin / speed)
    return np.eye(3) + np.sin(speed * t) * K + (1 - np.cos(speed * t)) * K @ K


def _rate(history: Sequence[tuple[float, float]], t: float) -> float:
    """Slope (1/s) of a history before t, at its first point behind it."""
    times, values = np.array(history).T
    k = max(int(np.searchsorted(times, t)), 1)
    if t < times[0] or k == len(times):
        return 0.0
    return float((values[k] - values[k - 1]) / (times[k] - times[k - 1]))
