"""Rigid bodies that stand still: how far points (n, 3) are from them, and the way out.

gap (n,): signed distance in m, positive outside. The normal is its gradient, `turning` (n, 3, 3) the derivative of
the normal by the point. `mean_normals` between the points x0 and x1 do what the normal does in the mean of a step:

    n_mean . (x1 - x0) = gap(x1) - gap(x0)

for steps of any length, so that a force along them does exactly the work of a potential of the gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Plane:
    """Half space below the plane through `point` (3,) with the unit normal `normal` (3,)."""

    point: np.ndarray
    normal: np.ndarray
    flat = True

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Signed distance (n,) in m."""
        return (x - self.point) @ self.normal

    def normals(self, x: np.ndarray) -> np.ndarray:
        """Unit normals (n, 3) out of the body."""
        return np.repeat(self.normal[None], len(x), axis=0)

    def turning(self, x: np.ndarray) -> np.ndarray:
        """Derivative (n, 3, 3) of the normal by the point in 1/m."""
        return np.zeros((len(x), 3, 3))

    def mean_normals(self, x0: np.ndarray, x1: np.ndarray) -> np.ndarray:
        """Mean normals (n, 3) of a step."""
        return self.normals(x1)

    def mean_turning(self, x0: np.ndarray, x1: np.ndarray) -> np.ndarray:
        """Derivative (n, 3, 3) of the mean normals by x1."""
        return self.turning(x1)


@dataclass(frozen=True, eq=False)
class Round:
    """Ball about `centre` (3,), or an endless cylinder about the unit vector `axis` (3,) through it.

    The radial vector e = across (x - centre) leaves out what lies along the axis; |e1| - |e0| is then
    (e0 + e1) . (x1 - x0) / (|e0| + |e1|), which gives the mean normal.
    """

    centre: np.ndarray
    radius: float
    axis: np.ndarray | None = None
    flat = False

    @property
    def across(self) -> np.ndarray:
        """Projector (3, 3) that takes the part along the axis away."""
        return np.eye(3) if self.axis is None else np.eye(3) - np.outer(self.axis, self.axis)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Signed distance (n,) in m."""
        return self._radial(x)[1] - self.radius

    def normals(self, x: np.ndarray) -> np.ndarray:
        """Unit normals (n, 3) out of the body; none on the axis."""
        e, length = self._radial(x)
        return e / length[:, None]

    def turning(self, x: np.ndarray) -> np.ndarray:
        """Derivative (n, 3, 3) of the normal by the point in 1/m."""
        e, length = self._radial(x)
        n = e / length[:, None]
        return (self.across - n[:, :, None] * n[:, None, :]) / length[:, None, None]

    def mean_normals(self, x0: np.ndarray, x1: np.ndarray) -> np.ndarray:
        """Mean normals (n, 3) of a step, of length 1 or less."""
        (e0, length0), (e1, length1) = self._radial(x0), self._radial(x1)
        return (e0 + e1) / (length0 + length1)[:, None]

    def mean_turning(self, x0: np.ndarray, x1: np.ndarray) -> np.ndarray:
        """Derivative (n, 3, 3) of the mean normals by x1."""
        both, mean = self._radial(x0)[1] + self._radial(x1)[1], self.mean_normals(x0, x1)
        return (self.across - mean[:, :, None] * self.normals(x1)[:, None, :]) / both[:, None, None]

    def _radial(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radial vectors (n, 3) and their lengths (n,)."""
        e = (x - self.centre) @ self.across
        return e, np.maximum(np.linalg.norm(e, axis=1), np.finfo(float).tiny)


Obstacle = Plane | Round


def plane(point, normal) -> Plane:
    """Half space; the normal may have any length."""
    normal = np.asarray(normal, dtype=float)
    return Plane(np.asarray(point, dtype=float), normal / np.linalg.norm(normal))


def sphere(centre, radius: float) -> Round:
    """Ball."""
    return Round(np.asarray(centre, dtype=float), radius)


def drum(point, axis, radius: float) -> Round:
    """Endless cylinder; the axis may have any length."""
    axis = np.asarray(axis, dtype=float)
    return Round(np.asarray(point, dtype=float), radius, axis / np.linalg.norm(axis))
