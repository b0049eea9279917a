"""A rigid rim: the nodes on the faces of some edges move as one body, stated but for the directions it is free in.

A node at X has the displacement (R - 1) X + d + u: R the rotation by spin x t about the origin of space, d the stated
translation, u the one that is found, along free directions alone. Stated components are fixed ones that move. Along a
free direction the nodes have one unknown together: the matrix is P^T K P, and a residual is P^T r, with P of zeros and
ones (`TiedSolver`); on the pattern of all nodes the sum stands at the first of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reference_fe.elasticity import Pattern
from reference_fe.linear_solver import direct_solver


@dataclass(frozen=True)
class Rim:
    """Arrays of the f free nodes. nodes (k,): those on the rim; points (k, 3) in m; weight (k,): their mean is the
    rim's centre. tied (f, 3) components move as one along each free direction, held (f, 3) ones as stated.
    """

    nodes: np.ndarray
    points: np.ndarray
    weight: np.ndarray
    free: tuple[int, ...]
    held: np.ndarray
    tied: np.ndarray
    mass: float
    displacement: np.ndarray
    history: np.ndarray
    spin: np.ndarray

    def stated(self, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement, velocity and acceleration (k, 3) without what is found; at a corner of the history the
        velocity is that before it."""
        turn, spin = rotation(self.spin * time), self.spin
        arm = self.points @ turn.T
        times, factors = self.history.T
        k = int(np.clip(np.searchsorted(times, time), 1, max(len(times) - 1, 1)))
        inside = len(times) > 1 and times[0] <= time <= times[-1]
        slope = (factors[k] - factors[k - 1]) / (times[k] - times[k - 1]) if inside else 0.0
        shift = np.interp(time, times, factors) * self.displacement
        speed = np.cross(spin, arm)
        return arm - self.points + shift, speed + slope * self.displacement, np.cross(spin, speed)

    def found(self, values: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """Translation (3,) that values (f, 3) have beside the stated ones (k, 3), along free directions."""
        mean = self.weight @ (values[self.nodes] - stated)
        return np.where(np.isin(np.arange(3), self.free), mean, 0.0)

    def placed(self, values: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """values (f, 3) with the rim's nodes where stated (k, 3) and found translation put them."""
        new, own = values.copy(), (self.held | self.tied)[self.nodes]
        new[self.nodes] = np.where(own, stated + self.found(values, stated), values[self.nodes])
        return new

    def lack(self, before, after, h: float, beta: float, gamma: float) -> tuple[np.ndarray, np.ndarray]:
        """What Newmark's updates of displacement and velocity (k, 3) lack in a step of the stated motion.

        before, after: as `stated` gives them. With gamma = 1 the acceleration is the mean of the step.
        """
        (u0, v0, a0), (u1, v1, a1) = before, after
        a1 = (v1 - v0) / h if gamma == 1 else a1
        drift = u1 - u0 - h * v0 - h**2 * ((0.5 - beta) * a0 + beta * a1)
        return drift, v1 - v0 - h * ((1 - gamma) * a0 + gamma * a1)

    def spread(self, values: np.ndarray, count: int) -> np.ndarray:
        """Values (k, 3) on the rim's nodes among all (f, 3) free ones, zero elsewhere."""
        whole = np.zeros((count, 3))
        whole[self.nodes] = np.where((self.held | self.tied)[self.nodes], values, 0.0)
        return whole

    def inertia(self, a: np.ndarray) -> np.ndarray:
        """Force (f, 3) in N that the rim's own mass takes at the acceleration (f, 3)."""
        force = np.zeros_like(a)
        force[self.nodes] = self.mass * np.outer(self.weight, self.weight @ a[self.nodes])
        return force

    def summed(self, force: np.ndarray) -> np.ndarray:
        """Residual (f, 3) with that of tied components summed at the first of them."""
        force = force.copy()
        for a in self.free:
            group = np.flatnonzero(self.tied[:, a])
            total = force[group, a].sum()
            force[group, a] = 0.0
            force[group[0], a] = total
        return force

    def pull(self, rest: np.ndarray, u: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Translation (m), and resultant (N) and moment (N m) about the centre of forces (f, 3) on the rim's nodes."""
        stated = self.stated(time)[0]
        centre = np.interp(time, *self.history.T) * self.displacement + self.found(u, stated)
        own = np.where((self.held | self.tied)[self.nodes], rest[self.nodes], 0.0)
        arms = self.points + u[self.nodes] - centre
        return centre, own.sum(axis=0), np.cross(arms, own).sum(axis=0)

    def work(self, rest: np.ndarray, begin: float | None, end: float) -> float:
        """Work (J) of the stated motion between two times, None at rest, against mean forces (f, 3)."""
        moves = self.stated(end)[0] - (0.0 if begin is None else self.stated(begin)[0])
        return float(np.sum(np.where((self.held | self.tied)[self.nodes], rest[self.nodes], 0.0) * moves))

    def groups(self) -> list[np.ndarray]:
        """Unknowns (of 3 f) that are one, for each free direction."""
        return [3 * np.flatnonzero(self.tied[:, a]) + a for a in self.free]


def rim(where: Pattern, centre: np.ndarray, fixed: np.ndarray, points: np.ndarray, stated: dict) -> Rim:
    """The rim of the nodes where `centre` (n,), the weights of its centre, is not zero.

    fixed (n, 3): what supports hold already; points (n, 3) of all nodes. stated: free, mass, displacement, history and
    spin as `Rim` has them.
    """
    own = ((centre != 0)[:, None] & ~fixed)[where.free]
    tied = np.zeros_like(own)
    tied[:, list(stated["free"])] = own[:, list(stated["free"])]
    nodes = np.flatnonzero(own.any(axis=1))
    places, weight = points[where.free][nodes], centre[where.free][nodes]
    return Rim(nodes, places, weight, held=own & ~tied, tied=tied, **stated)


def centre_of(on: np.ndarray, points: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """Weights (n,) of the nodes `on` (n,), of sum 1; where they spin, the least whose mean point is on the axis."""
    weights = on / on.sum()
    if np.any(spin):
        arms = points[on] - np.outer(points[on] @ spin, spin) / (spin @ spin)
        weights[on] = np.linalg.pinv(np.vstack([np.ones(len(arms)), arms.T]))[:, 0]
    return weights


def rotation(turn: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of a rotation vector (rad), by Euler's parameters."""
    angle = float(np.linalg.norm(turn))
    w, (x, y, z) = np.cos(angle / 2), turn * (np.sinc(angle / (2 * np.pi)) / 2)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class TiedSolver:
    """A direct solver of P^T K P for upper-triangle values of K; right sides and solutions are those of all unknowns.

    groups: unknowns that are one. A right side's sum over a group counts; a solution is the same all over it.
    """

    def __init__(self, where: Pattern, groups: list[np.ndarray]):
        count = where.indptr.size - 1
        number = np.ones(count, dtype=np.int64)
        number[np.concatenate(groups)] = 0
        number = np.cumsum(number) - 1
        size = int(number[-1]) + 1
        for group in groups:
            number[group] = size
            size += 1
        self.number, self.size = number, size
        row, column = np.repeat(np.arange(count), np.diff(where.indptr)), where.indices
        first, second = np.minimum(number[row], number[column]), np.maximum(number[row], number[column])
        keys, self.place = np.unique(first * size + second, return_inverse=True)
        self.twice = np.flatnonzero((first == second) & (row != column))
        indptr = np.searchsorted(keys // size, np.arange(size + 1))
        self.solver = direct_solver(indptr, keys % size)
        self.length = keys.size

    def factorise(self, values: np.ndarray) -> None:
        """As those of linear_solver."""
        own = values.copy()
        own[self.twice] *= 2
        self.solver.factorise(np.bincount(self.place, own, self.length))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """As those of linear_solver."""
        return self.solver.solve(np.bincount(self.number, right, self.size))[self.number]

    def close(self) -> None:
        """As those of linear_solver."""
        self.solver.close()
