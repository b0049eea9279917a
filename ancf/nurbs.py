"""NURBS curves and surfaces (paper Eqs. 1-4): evaluation, derivatives, normals, inversion.

A rational curve is a polynomial spline in homogeneous coordinates (w P, w), evaluated by SciPy, and
divided by its weight; derivatives follow from the quotient rule (Piegl and Tiller, The NURBS Book,
sections 4.3 and 4.5). Parameters outside the knots continue the last polynomial piece.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, NdBSpline

ITERATIONS = 100
SAMPLES = 33  # across a line of knots
CREASE = 1e-6  # of a tangent: control points are typed with ten digits and more


class GeometryError(ValueError):
    """A shape that cannot be modelled: no normal, no material left, or folded onto itself."""


@dataclass(frozen=True, eq=False)
class Curve:
    """NURBS curve (Eq. 3): degree p, knots (n + p + 1,), control_points (n, d), weights (n,), all 1 by default.

    Raises ValueError where the shapes do not belong together.
    """

    degree: int
    knots: np.ndarray
    control_points: np.ndarray
    weights: np.ndarray | None = None

    def __post_init__(self):
        points = np.array(self.control_points, dtype=float)
        weights = np.ones(points.shape[:1]) if self.weights is None else np.array(self.weights, dtype=float)
        knots = np.array(self.knots, dtype=float)
        if points.ndim != 2 or weights.shape != points.shape[:1]:
            raise ValueError(f"control points {points.shape} and weights {weights.shape} do not belong together")
        _require_knots(knots, self.degree, len(points))
        _freeze(self, knots=knots, control_points=points, weights=weights)

    @property
    def domain(self) -> tuple[float, float]:
        """Range of the parameter u."""
        return float(self.knots[self.degree]), float(self.knots[-self.degree - 1])

    @property
    def breaks(self) -> np.ndarray:
        """Distinct knots within the domain, both ends included: between two of them the curve is smooth."""
        low, high = self.domain
        return np.unique(self.knots[(self.knots >= low) & (self.knots <= high)])

    @cached_property
    def homogeneous(self) -> BSpline:
        """The spline of (w P, w)."""
        from scipy.interpolate import BSpline  # a third of a second that a flat plate need not pay

        return BSpline(self.knots, _homogeneous(self.control_points, self.weights), self.degree)


@dataclass(frozen=True, eq=False)
class Surface:
    """NURBS surface (Eq. 4): degree (p, q), knots (two vectors), control_points (n, m, d), weights (n, m).

    Raises ValueError where the shapes do not belong together.
    """

    degree: tuple[int, int]
    knots: tuple[np.ndarray, np.ndarray]
    control_points: np.ndarray
    weights: np.ndarray | None = None

    def __post_init__(self):
        points = np.array(self.control_points, dtype=float)
        weights = np.ones(points.shape[:2]) if self.weights is None else np.array(self.weights, dtype=float)
        knots = tuple(np.array(vector, dtype=float) for vector in self.knots)
        if points.ndim != 3 or weights.shape != points.shape[:2]:
            raise ValueError(f"control points {points.shape} and weights {weights.shape} do not belong together")
        for vector, degree, count in zip(knots, self.degree, points.shape[:2], strict=True):
            _require_knots(vector, degree, count)
        _freeze(self, degree=tuple(self.degree), knots=knots, control_points=points, weights=weights)

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges of the parameters u and v."""
        ends = zip(self.knots, self.degree, strict=True)
        return tuple((float(knots[degree]), float(knots[-degree - 1])) for knots, degree in ends)

    @cached_property
    def homogeneous(self) -> NdBSpline:
        """The tensor-product spline of (w P, w)."""
        from scipy.interpolate import NdBSpline

        return NdBSpline(self.knots, _homogeneous(self.control_points, self.weights), self.degree)


@dataclass(frozen=True, eq=False)
class Revolved:
    """A section (along, radius) turned about an axis of space through its origin: u is the angle, v the section's.

    axis: 0, 1, 2 for X, Y, Z. The angle is measured from the next of them in turn, toward the one after that.
    """

    section: Curve
    axis: int

    @property
    def swept(self) -> Surface:
        """The section along v, the same at every u: it has the revolved surface's creases."""
        curve = self.section
        points, weights = (np.stack([array, array]) for array in (curve.control_points, curve.weights))
        return Surface((1, curve.degree), (np.array([0.0, 0.0, 1.0, 1.0]), curve.knots), points, weights)

    def derivatives(self, u: np.ndarray, v: np.ndarray) -> SurfaceDerivatives:
        """s = a(v) A + r(v) b(u) with the axis A, b = cos u B + sin u C, t = b_u = cos u C - sin u B."""
        (a, r), (a_v, r_v), (a_vv, r_vv) = (
            np.moveaxis(c, -1, 0)[..., None] for c in curve_derivatives(self.section, v)
        )
        A, B, C = np.roll(np.eye(3), -self.axis, axis=0)
        cosine, sine = np.cos(u)[..., None], np.sin(u)[..., None]
        b, t = cosine * B + sine * C, cosine * C - sine * B
        return SurfaceDerivatives(a * A + r * b, r * t, a_v * A + r_v * b, -r * b, r_v * t, a_vv * A + r_vv * b)


class SurfaceDerivatives(NamedTuple):
    """Point of a surface and its derivatives, each (..., d)."""

    s: np.ndarray
    s_u: np.ndarray
    s_v: np.ndarray
    s_uu: np.ndarray
    s_uv: np.ndarray
    s_vv: np.ndarray


class Normal(NamedTuple):
    """Unit normal of a surface in space and its derivatives, each (..., 3)."""

    n: np.ndarray
    n_u: np.ndarray
    n_v: np.ndarray


def curve_derivatives(curve: Curve, u: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """c, c_u, c_uu of the curve at u (...): each (..., d)."""
    u = np.asarray(u, dtype=float)
    (a, w), (a_u, w_u), (a_uu, w_uu) = (_split(curve.homogeneous(u, nu=order)) for order in range(3))
    c = a / w
    c_u = (a_u - w_u * c) / w
    c_uu = (a_uu - 2 * w_u * c_u - w_uu * c) / w
    return c, c_u, c_uu


def surface_derivatives(surface: Surface | Revolved, u: ArrayLike, v: ArrayLike) -> SurfaceDerivatives:
    """Point, first and second derivatives (mixed included) at the pairs (u, v), broadcast against each other."""
    pairs = np.broadcast_arrays(np.asarray(u, dtype=float), np.asarray(v, dtype=float))
    if isinstance(surface, Revolved):
        return surface.derivatives(*pairs)
    at = np.stack(pairs, axis=-1)
    orders = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    (a, w), (a_u, w_u), (a_v, w_v), (a_uu, w_uu), (a_uv, w_uv), (a_vv, w_vv) = (
        _split(surface.homogeneous(at, nu=order)) for order in orders
    )
    s = a / w
    s_u = (a_u - w_u * s) / w
    s_v = (a_v - w_v * s) / w
    s_uu = (a_uu - 2 * w_u * s_u - w_uu * s) / w
    s_uv = (a_uv - w_u * s_v - w_v * s_u - w_uv * s) / w
    s_vv = (a_vv - 2 * w_v * s_v - w_vv * s) / w
    return SurfaceDerivatives(s, s_u, s_v, s_uu, s_uv, s_vv)


def unit_normal(values: SurfaceDerivatives) -> Normal:
    """n = s_u x s_v / |s_u x s_v| and its derivatives. Raises GeometryError where the surface is degenerate."""
    m = np.cross(values.s_u, values.s_v)
    length = np.linalg.norm(m, axis=-1, keepdims=True)
    scale = np.linalg.norm(values.s_u, axis=-1) * np.linalg.norm(values.s_v, axis=-1)
    if np.any(length[..., 0] <= 1e-12 * scale) or np.any(scale == 0):
        raise GeometryError("the surface has no normal where its two tangents are parallel or one of them vanishes")
    m_u = np.cross(values.s_uu, values.s_v) + np.cross(values.s_u, values.s_uv)
    m_v = np.cross(values.s_uv, values.s_v) + np.cross(values.s_u, values.s_vv)
    n = m / length
    return Normal(n, *((d - n * np.sum(n * d, axis=-1, keepdims=True)) / length for d in (m_u, m_v)))


def crease(surface: Surface | Revolved, axis: int) -> float | None:
    """First parameter along an axis (0 or 1) at which the tangent along it jumps; None where the surface is C1.

    It can jump at inner knots that stand `degree` times. With homogeneous rows A of the net, A_i on such a knot,
    A' = p (A_i - A_i-1) / (its distance to the knot before) on one side and alike on the other, s' = (A' - w' s) / w.
    """
    from scipy.interpolate import BSpline

    if isinstance(surface, Revolved):
        return None if axis == 0 else crease(surface.swept, 1)
    p, knots, (low, high) = surface.degree[axis], surface.knots[axis], surface.domain[axis]
    across, degree, ends = surface.knots[1 - axis], surface.degree[1 - axis], surface.domain[1 - axis]
    net = np.moveaxis(_homogeneous(surface.control_points, surface.weights), axis, 0)
    for knot in np.unique(knots[(knots > low) & (knots < high)]):
        first = int(np.searchsorted(knots, knot))
        if np.count_nonzero(knots == knot) < p:
            continue
        rows = BSpline(across, net[first - 2 : first + 1].swapaxes(0, 1), degree)(np.linspace(*ends, SAMPLES))
        s, w = rows[:, 1, :-1] / rows[:, 1, -1:], rows[:, 1, -1:]
        steps = knot - knots[first - 1], knots[first + p] - knot
        before, after = (
            p * (change[:, :-1] - change[:, -1:] * s) / (w * step)
            for change, step in zip(np.diff(rows, axis=1).swapaxes(0, 1), steps, strict=True)
        )
        if np.abs(after - before).max() > CREASE * np.abs(before).max():
            return float(knot)
    return None


def invert(curve: Curve, values: ArrayLike, component: int = 0) -> np.ndarray:
    """Parameter u at which a non-decreasing component of the curve takes the values: (...).

    Section 4.2 of the paper, step 3 corrected: the root of c(u) - y is sought, u - (c(u) - y)/c'(u),
    where the printed c'/c'' would seek an extremum. Newton's step is replaced by bisection of the
    bracket where it leaves it or gains less, so that a slope of zero (the end of a vertical wall)
    is harmless. Values beyond the curve's ends return the ends.
    """
    y = np.asarray(values, dtype=float)
    breaks = curve.breaks
    at_breaks = np.maximum.accumulate(curve_derivatives(curve, breaks)[0][:, component])
    span = np.clip(np.searchsorted(at_breaks, y, side="right") - 1, 0, len(breaks) - 2)
    low, high = breaks[span], breaks[span + 1]
    low, high = np.where(y > at_breaks[-1], high, low), np.where(y < at_breaks[0], low, high)  # beyond: the end itself
    u, last = (low + high) / 2, high - low
    for _ in range(ITERATIONS):
        c, c_u, _ = curve_derivatives(curve, u)
        excess, slope = c[..., component] - y, c_u[..., component]
        low, high = np.where(excess <= 0, u, low), np.where(excess >= 0, u, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = u - excess / slope
        safe = (newton >= low) & (newton <= high) & (np.abs(newton - u) <= last / 2)
        new = np.where(excess == 0, u, np.where(safe, newton, (low + high) / 2))
        last = np.abs(new - u)
        u = new
        if np.all(last <= 4 * np.finfo(float).eps * np.abs(breaks).max()):
            break
    return u


def _require_knots(knots: np.ndarray, degree: int, count: int) -> None:
    if knots.shape != (count + degree + 1,):
        raise ValueError(f"{count} control points of degree {degree} need {count + degree + 1} knots, got {knots.size}")
    if np.any(np.diff(knots) < 0):
        raise ValueError(f"knots must not decrease: {knots}")


def _freeze(value: Curve | Surface, **fields: object) -> None:
    for name, field in fields.items():
        object.__setattr__(value, name, field)


def _homogeneous(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)


def _split(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return values[..., :-1], values[..., -1:]
