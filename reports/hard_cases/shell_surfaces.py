"""Mid-surfaces of the shells as NURBS: cylinders, spheres, flat annuli, a helicoid and a hook of two arcs.

All but the helicoid are exact: arcs are rational and quadratic. Parameters run from 0 to 1, but for the hook's x.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import comb

TWIST_DEGREE = 9


@dataclass(frozen=True)
class Curve:
    """A NURBS curve: degree, control points (n, d), weights (n,), knots."""

    degree: int
    points: np.ndarray
    weights: np.ndarray
    knots: Sequence[float]


def arc(radius: float, start: float, end: float) -> Curve:
    """Arc about the origin of a plane between two angles (degrees), less than half a circle apart."""
    half = math.radians(end - start) / 2
    angles = np.radians([start, (start + end) / 2, end])
    weights = np.array([1.0, math.cos(half), 1.0])
    points = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) / weights[:, None]
    return Curve(2, points, weights, [0.0] * 3 + [1.0] * 3)


def line(start: Sequence[float], end: Sequence[float]) -> Curve:
    """Straight line."""
    return Curve(1, np.array([start, end], dtype=float), np.ones(2), [0.0, 0.0, 1.0, 1.0])


def swept(curve: Curve, axis: int, extent: tuple[float, float], first: bool = True) -> dict:
    """A plane curve moved along an axis X, Y or Z (0, 1, 2), which fills the other two components in order.

    first: the curve runs along x; otherwise along y. The parameter along the axis runs from 0 to 1.
    """
    others = [component for component in range(3) if component != axis]
    net = np.zeros((len(curve.points), 2, 3))
    net[..., others] = curve.points[:, None]
    net[..., axis] = extent
    along = line([extent[0]], [extent[1]])
    weights = np.outer(curve.weights, along.weights)
    if first:
        return _surface((curve, along), net, weights)
    return _surface((along, curve), net.swapaxes(0, 1), weights.T)


def revolved(meridian: Curve, end: float) -> dict:
    """A meridian (radius, Z), along y, turned about Z from the longitude 0 to `end` degrees, along x."""
    turn = arc(1.0, 0.0, end)
    net = np.empty((3, len(meridian.points), 3))
    net[..., :2] = turn.points[:, None] * meridian.points[:, :1]
    net[..., 2] = meridian.points[:, 1]
    return _surface((turn, meridian), net, np.outer(turn.weights, meridian.weights))


def helicoid(length: float, width: float, turn: float = 90.0) -> dict:
    """A strip of which the centre line is X, along x, turned by `turn` degrees over its length; its width along y.

    The director of the width, (cos, sin), is one polynomial of degree TWIST_DEGREE through as many of its points
    and one more: no knots inside, and for a quarter turn 7e-11 of the width from the helicoid.
    """
    degree = TWIST_DEGREE
    s = (1 - np.cos(np.linspace(0.0, math.pi, degree + 1))) / 2
    bernstein = np.stack([comb(degree, k) * s**k * (1 - s) ** (degree - k) for k in range(degree + 1)], axis=1)
    angle = math.radians(turn) * s
    points = np.linalg.solve(bernstein, np.stack([length * s, np.cos(angle), np.sin(angle)], axis=1))
    half = np.array([-width / 2, width / 2])
    net = np.repeat(points[:, None], 2, axis=1)
    net[..., 1:] *= half[:, None]
    along = Curve(degree, points, np.ones(degree + 1), [0.0] * (degree + 1) + [1.0] * (degree + 1))
    return _surface((along, line([half[0]], [half[1]])), net, np.ones(net.shape[:2]))


HOOK_SPANS = (1.0, 2.0, 2.0)
HOOK_GROWTH = 0.5  # weight of the first arc's end over that of its start: the parameter's speed doubles along it


def hook(radii: tuple[float, float], width: float) -> dict:
    """Raasch's hook: an arc of 60 degrees, then one of 150 that bends the other way, along x; the width along y.

    Parameters 0, 1 and 5 are the ends of the arcs (the second is cut in two at 3). An arc is the same for any
    weights a, b, c with b^2 / (a c) fixed, and they set the speeds 2 (b / a) l / h and 2 (b / c) l / h at its ends,
    l being the side of its control polygon and h its span. So each piece begins at the speed at which the last
    one ended: the surface is C1, as an ANCF plate needs it, and equal steps of x are elements of like length.
    """
    first = np.array([[0.0, -1.0], [math.tan(math.pi / 6), -1.0], _unit(-30.0)]) * radii[0]
    centre = (radii[0] + radii[1]) * _unit(-30.0)
    second = [centre + radii[1] * p for p in _arc_points((150.0, 75.0, 0.0))]
    points = np.concatenate([first, second[1:]])
    return swept(Curve(2, points, _hook_weights(points), _hook_knots()), 2, (0.0, width))


def _hook_weights(points: np.ndarray) -> np.ndarray:
    halves, weights, speed = (30.0, 37.5, 37.5), [1.0], None
    for piece, (half, span) in enumerate(zip(halves, HOOK_SPANS, strict=True)):
        a, side = weights[-1], float(np.linalg.norm(points[2 * piece + 1] - points[2 * piece]))
        shape = math.cos(math.radians(half))
        b = shape * a * math.sqrt(HOOK_GROWTH) if speed is None else speed * span * a / (2 * side)
        c = (b / shape) ** 2 / a
        weights, speed = [*weights, b, c], 2 * b / c * side / span
    return np.array(weights)


def _hook_knots() -> list[float]:
    ends = np.cumsum((0.0, *HOOK_SPANS)).tolist()
    return [ends[0]] * 3 + [ends[1]] * 2 + [ends[2]] * 2 + [ends[3]] * 3


def _arc_points(angles: Sequence[float]) -> list[np.ndarray]:
    """Control points of arcs of the unit circle through the angles (degrees), each followed by its pole."""
    found = [_unit(angles[0])]
    for a, b in pairwise(angles):
        found += [_unit((a + b) / 2) / math.cos(math.radians(a - b) / 2), _unit(b)]
    return found


def _unit(angle: float) -> np.ndarray:
    return np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])


def _surface(curves: tuple[Curve, Curve], net: np.ndarray, weights: np.ndarray) -> dict:
    """The scene's words for a surface with control points (n, m, 3)."""
    return {
        "kind": "nurbs",
        "degree": [curve.degree for curve in curves],
        "knots": [list(curve.knots) for curve in curves],
        "control_points": net.tolist(),
        "weights": weights.tolist(),
    }
