"""A groove or a protrusion within any outline: a closed NURBS curve in the plane of the mid-surface parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ancf.arcs import Arc, Vertical, divide
from ancf.cut import Region, inside
from ancf.nurbs import Curve, Surface

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Outlined:
    """A groove or a protrusion within a closed curve that does not cross itself.

    face, sign: as of a Band. outline: the curve (x, y). depth: the depth (height) in m, constant, or a surface over
    (x, y) whose points have one component, the depth in m.
    """

    face: int
    sign: int
    outline: Curve
    depth: float | Surface

    @cached_property
    def parts(self) -> tuple[tuple[Arc, ...], tuple[Vertical, ...]]:
        """Arcs and vertical lines of the outline."""
        return divide(self.outline)

    @property
    def arcs(self) -> tuple[Arc, ...]:
        """The arcs of the outline."""
        return self.parts[0]

    @property
    def is_curved(self) -> bool:
        """Whether the depth varies."""
        return isinstance(self.depth, Surface)

    @property
    def greatest(self) -> float:
        """A bound of the depth (m)."""
        return float(self.depth.control_points.max()) if self.is_curved else self.depth

    @cached_property
    def box(self) -> tuple[Interval, Interval]:
        """Ranges of x and y."""
        x0, x1, low, high = np.array([(arc.x0, arc.x1, arc.low, arc.high) for arc in self.arcs]).T
        return (float(x0.min()), float(x1.max())), (float(low.min()), float(high.max()))

    def limits(self, axis: int) -> Interval:
        """First and last coordinate on an axis."""
        return self.box[axis]

    def covers(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Whether points lie inside."""
        x, y = np.broadcast_arrays(x, y)
        return inside(self.arcs, np.atleast_1d(x), np.atleast_1d(y)).reshape(x.shape)

    def depth_at(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Depth (m) at points, inside the outline or not."""
        x, y = np.broadcast_arrays(x, y)
        if not self.is_curved:
            return np.full(x.shape, self.depth)
        values = self.depth.homogeneous(np.stack([x, y], axis=-1))
        return values[..., 0] / values[..., 1]

    def lines(self, axis: int) -> list[float]:
        """Knots of a depth that varies, inside its domain."""
        return np.unique(self.depth.knots[axis]).tolist()[1:-1] if self.is_curved else []

    @cached_property
    def region(self) -> Region:
        """What lies inside, as `ancf.cut` knows it."""
        if not self.is_curved:
            return Region(*self.parts, self.depth)
        return Region(*self.parts, self.depth_at, (self.lines(0), self.lines(1)), self.depth.degree)

    def shape(self, origin: tuple[float, float], size: float) -> tuple:
        """What makes two of them the same as seen from an origin, to 11 digits of a size."""
        curve, depth = self.outline, ()
        numbers = [_from_start(curve.knots), curve.weights, (curve.control_points - origin) / size]
        if self.is_curved:
            knots = [(vector - start) / size for vector, start in zip(self.depth.knots, origin, strict=True)]
            depth, numbers = self.depth.degree, [*numbers, *knots, self.depth.control_points / size]
        else:
            numbers.append(np.array([self.depth]))
        return curve.degree, depth, *((np.round(array, 11) + 0.0).tobytes() for array in numbers)


def _from_start(knots: np.ndarray) -> np.ndarray:
    return (knots - knots[0]) / (knots[-1] - knots[0])
