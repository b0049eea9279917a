"""Grooves and protrusions of any outline, as a scene states them. Coordinates and units: see scene.py."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np

from compare.scene_parts import Count, Interval, Number, Pair, Part, Positive, exactly

SAMPLES = 64  # of each knot span of a curved outline


class Loop(Part):
    """A closed NURBS curve (paper Eq. 3) through (x, y), the mid-surface parameters.

    The first control point is the last one too. The curve must not cross itself; it may leave the plate, where it is
    cut off.
    """

    degree: Count
    control_points: tuple[Interval, ...]
    knots: tuple[Number, ...]
    weights: tuple[Positive, ...] | None = None

    @property
    def polygon(self) -> np.ndarray:
        """Points (n, 2) along the curve, every knot among them, the first one once: for checks and sketches."""
        return _polygon(self)


@lru_cache(maxsize=1024)
def _polygon(loop: Loop) -> np.ndarray:
    """See `Loop.polygon`; kept beside the loop, whose equality pydantic reads from all that it holds."""
    if loop.degree == 1:
        return np.array(loop.control_points)[:-1]
    breaks = np.unique(loop.knots)
    steps = np.linspace(0, 1, SAMPLES, endpoint=False)
    return nurbs_points(loop, (breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel())


class DepthSurface(Part):
    """A depth (m) that varies: a polynomial B-spline over (x, y) with knots in x and y themselves.

    depths[i][j]: its coefficients in m, i along x. It must cover the outline as far as that lies on the plate.
    """

    degree: Annotated[tuple[Count, Count], Pair]
    knots: Annotated[tuple[tuple[Number, ...], tuple[Number, ...]], exactly(2, "knot vectors")]
    depths: tuple[tuple[Number, ...], ...]

    @property
    def greatest(self) -> float:
        """A bound of the depth: a B-spline does not exceed its largest coefficient."""
        return max(max(row) for row in self.depths)


class Outlined(Part):
    """A groove or protrusion within an outline on one face, its walls along the normal of the mid-surface.

    Either `depth` (m, constant) or `depth_surface`. For a groove the depth is cut away; for a protrusion it is added.
    Where grooves of one face overlap, the deeper one counts.
    """

    name: str
    face: Literal["bottom", "top"]
    outline: Loop
    depth: Positive | None = None
    depth_surface: DepthSurface | None = None

    @property
    def greatest(self) -> float:
        """Its depth (m), or a bound of it where it varies."""
        return self.depth if self.depth_surface is None else self.depth_surface.greatest

    def limits(self, axis: int) -> Interval:
        """Least and greatest coordinate on an axis."""
        values = self.outline.polygon[:, axis]
        return float(values.min()), float(values.max())


def nurbs_points(curve: object, u: np.ndarray) -> np.ndarray:
    """Points of a NURBS curve of a scene at u (...): (..., 2), paper Eq. (3)."""
    from scipy.interpolate import BSpline

    points = np.array(curve.control_points)
    weights = np.ones(len(points)) if curve.weights is None else np.array(curve.weights)
    spline = BSpline(curve.knots, np.column_stack([points * weights[:, None], weights]), curve.degree)
    values = spline(u)
    return values[..., :2] / values[..., 2:]


def within(polygon: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether points (...) lie inside a polygon (n, 2): the number of its sides above is odd."""
    (xa, ya), (xb, yb) = polygon.T, np.roll(polygon, -1, axis=0).T
    x, y = np.asarray(x)[..., None], np.asarray(y)[..., None]
    spans = (xa <= x) != (xb <= x)
    with np.errstate(divide="ignore", invalid="ignore"):
        height = ya + (x - xa) / (xb - xa) * (yb - ya)
    return np.sum(spans & (height > y), axis=-1) % 2 == 1


def sides_cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Pairs (k, 2) of sides of two polygons that cross at inner points of both."""
    p, q = one[:, None], np.roll(one, -1, axis=0)[:, None]
    r, s = other[None], np.roll(other, -1, axis=0)[None]
    straddles = (_turn(p, q, r) * _turn(p, q, s) < 0) & (_turn(r, s, p) * _turn(r, s, q) < 0)
    return np.argwhere(straddles)


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the signed area of the triangles a b c."""
    return (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]


def rectangle(x: Sequence[float], y: Sequence[float]) -> np.ndarray:
    """The corners of a rectangle (4, 2)."""
    return np.array([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])])
