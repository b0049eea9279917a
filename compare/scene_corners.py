"""How far the material of a scene reaches around the sharpest inner edge that a groove or a protrusion makes.

There a solid's stress is singular, the more the larger the angle is (`exact.reentrant_order`). In a section across an
edge both faces are lines; the way along them turns there, toward the material or away from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from compare.scene import Band, Interval, Outlined, Scene
from compare.scene_geometry import AXES, ROUND_OFF, ROUND_OFF_PLANE, all_bands, limits
from compare.scene_outline import within
from compare.scene_outline_checks import depth_spline
from compare.scene_revolved import section_curve

UPRIGHT = math.pi / 2  # slope of a wall
SMOOTH = 1e-6  # rad: a face that turns less has no edge
SAMPLES = 32  # of a side of an outline, and of a crease of its floor

Direction = np.ndarray | None


def reentrant_angle(scene: Scene) -> float | None:
    """Largest angle (rad, pi to 2 pi) that the material fills at an edge of a groove or a protrusion.

    None where it fills no more than pi at any: without grooves and protrusions, or where all are smooth. Profiles and
    floors that slope are measured in the lengths of the mid-surface, halfway along the band. Each counts as if it were
    alone.
    """
    angles = []
    for key, feature in all_bands(scene):
        turns = _outlined_turns if isinstance(feature, Outlined) else _band_turns
        outward = 1 if key.startswith("protrusions") else -1
        angles += [math.pi + outward * turn for turn in turns(scene, feature, outward)]
    largest = max(angles, default=math.pi)
    return largest if largest > math.pi + SMOOTH else None


def _band_turns(scene: Scene, band: Band, outward: int) -> Iterator[float]:
    """Turns (rad) toward greater depth at the edges of a band, from the plate's face across it to the face again."""
    along = AXES.index(band.along)
    ends = limits(scene, band, along)
    if any(_on_plate(scene, along, ends, end) for end in ends):
        yield outward * UPRIGHT  # the ends of a band are walls
    if band.profile is None:
        if any(_on_plate(scene, 1 - along, band.edges, edge) for edge in band.edges):
            yield outward * UPRIGHT
        return
    for point, before, after in _corners(band.profile):
        if _on_plate(scene, 1 - along, band.edges, point[0]):
            at = (sum(ends) / 2, point[0]) if along == 0 else (point[0], sum(ends) / 2)
            scale = _across(_tangents(scene, at), 1 - along)
            yield _slope(after, scale) - _slope(before, scale)


def _slope(direction: Direction, scale: float) -> float:
    """Angle (rad) of a direction (across, depth) with the plate's face, which lies beyond the ends of a section."""
    return 0.0 if direction is None else math.atan2(direction[1], scale * direction[0])


def _on_plate(scene: Scene, axis: int, ends: Interval, value: float) -> bool:
    """Whether the end of a band lies on the plate, not at an edge of it; a ring has none at its seam."""
    first, last = scene.surface.span[axis]
    hair = ROUND_OFF_PLANE * (last - first)
    if axis == 0 and scene.surface.closed and ends[1] - ends[0] < last - first - hair:
        return True
    return first + hair < value < last - hair


def _corners(curve: object) -> Iterator[tuple[np.ndarray, Direction, Direction]]:
    """Points (2,) where a NURBS curve may turn, with its directions before and behind them; None beyond its ends.

    At a knot a curve of degree p is a mean of p + 1 - multiplicity control points. Where these are one, it runs
    through that point, and its directions are those to the next other ones.
    """
    points, knots, p = np.array(curve.control_points), np.array(curve.knots), curve.degree
    same = ROUND_OFF * np.ptp(points, axis=0).max()
    for knot in np.unique(knots):
        first = min(np.searchsorted(knots, knot, "right") - p - 1, len(points) - 1)
        last = max(np.searchsorted(knots, knot) - 1, 0)
        if np.ptp(points[first : last + 1], axis=0).max() <= same:
            away = points - points[first]
            others = np.flatnonzero(np.abs(away).max(axis=1) > same)
            before, after = others[others < first], others[others > last]
            yield points[first], -away[before[-1]] if len(before) else None, away[after[0]] if len(after) else None


def _outlined_turns(scene: Scene, shape: Outlined, outward: int) -> Iterator[float]:
    """As `_band_turns`, of walls along an outline, of their corners seen from above, and of creases in the floor."""
    yield from _plan_turns(scene, shape)
    floor = None if shape.depth_surface is None else depth_spline(shape.depth_surface)
    for point, inward in _sides(scene, shape):
        if floor is None:
            yield outward * UPRIGHT
            return
        slope = math.atan(_rise(floor, point, inward))
        wall = float(floor(point)) > ROUND_OFF_PLANE * scene.thickness
        yield from (UPRIGHT, slope - UPRIGHT) if wall else (slope,)
    if floor is not None:
        yield from _creases(scene, shape, floor)


def _plan_turns(scene: Scene, shape: Outlined) -> Iterator[float]:
    """Turns of the walls at the corners of an outline, seen along the normal: away from its inside where it bulges."""
    *corners, (_, end, _) = _corners(shape.outline)
    ahead = math.copysign(1.0, _area(shape.outline.polygon))
    for point, before, after in corners:
        before = end if before is None else before
        if _within_plate(scene, point[None])[0]:
            a, b = (_tangents(scene, point) @ direction for direction in (before, after))
            turn = math.atan2(np.linalg.norm(np.cross(a, b)), a @ b)
            left = before[0] * after[1] - before[1] * after[0]
            yield -turn if left * ahead > 0 else turn


def _sides(scene: Scene, shape: Outlined) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Points (2,) of an outline on the plate, and what leads 1 m inward and normal to it there, in the parameters."""
    polygon = shape.outline.polygon
    way = np.roll(polygon, -1, axis=0) - polygon
    steps = (np.arange(SAMPLES) + 0.5) / SAMPLES if shape.outline.degree == 1 else np.array([0.5])
    points = (polygon[:, None] + steps[:, None] * way[:, None]).reshape(-1, 2)
    ways = np.repeat(way, len(steps), axis=0)
    kept = _within_plate(scene, points)
    left = math.copysign(1.0, _area(polygon))
    for point, way in zip(points[kept], ways[kept], strict=True):
        J = _tangents(scene, point)
        along, inward = J @ way, left * J @ (-way[1], way[0])
        inward -= along * (along @ inward) / (along @ along)
        yield point, np.linalg.lstsq(J, inward / np.linalg.norm(inward), rcond=None)[0]


def _creases(scene: Scene, shape: Outlined, floor: object) -> Iterator[float]:
    """Turns at the lines where a floor is only continuous."""
    surface = shape.depth_surface
    for axis in (0, 1):
        knots, count = np.unique(surface.knots[axis], return_counts=True)
        hair = ROUND_OFF_PLANE * (knots[-1] - knots[0])
        for knot in knots[1:-1][count[1:-1] >= surface.degree[axis]]:
            along = np.linspace(*shape.limits(1 - axis), SAMPLES + 2)[1:-1]
            line = np.column_stack([np.full(SAMPLES, knot), along])[:, [axis, 1 - axis]]
            for point in line[within(shape.outline.polygon, *line.T) & _within_plate(scene, line)]:
                J = _tangents(scene, point)
                across = np.linalg.inv(J.T @ J)[axis]  # normal to the line: it has no part of S along it
                across /= np.linalg.norm(J @ across)
                step = hair * np.eye(2)[axis]
                yield math.atan(_rise(floor, point + step, across)) - math.atan(_rise(floor, point - step, across))


def _rise(floor: object, point: np.ndarray, direction: np.ndarray) -> float:
    """Derivative of a depth along a direction of the parameters."""
    return float(direction @ [floor(point, nu=nu) for nu in ((1, 0), (0, 1))])


def _within_plate(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Whether points (k, 2) lie on the plate and not at its edges: (k,)."""
    first, last = np.array(scene.surface.span).T
    hair = ROUND_OFF_PLANE * (last - first)
    return np.all((points > first + hair) & (points < last - hair), axis=1)


def _area(polygon: np.ndarray) -> float:
    """Twice the signed area of a polygon (n, 2): positive where it runs from x to y."""
    (xa, ya), (xb, yb) = polygon.T, np.roll(polygon, -1, axis=0).T
    return float(np.sum(xa * yb - xb * ya))


def _across(J: np.ndarray, axis: int) -> float:
    """Metres across a band per unit of the parameter that runs across it."""
    return float(np.linalg.norm(np.cross(J[:, 0], J[:, 1])) / np.linalg.norm(J[:, 1 - axis]))


def _tangents(scene: Scene, at: np.ndarray) -> np.ndarray:
    """S_x and S_y of the mid-surface at (x, y), as columns (3, 2); of a revolved one turned to an angle of 0."""
    surface = scene.surface
    if surface.kind == "rectangle":
        return np.eye(3)[:, :2]
    x, y = (min(max(value, span[0]), span[1]) for value, span in zip(at, surface.span, strict=True))
    if surface.kind == "revolved":
        (_, radius), (along, out) = section_curve(surface, np.array(y))
        return np.array([[radius, 0.0], [0.0, along], [0.0, out]])
    from scipy.interpolate import NdBSpline

    points = np.array(surface.control_points)
    weights = np.ones(points.shape[:2]) if surface.weights is None else np.array(surface.weights)
    net = np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)
    spline = NdBSpline(surface.knots, net, surface.degree)
    value, *slopes = (spline((x, y), nu=nu) for nu in ((0, 0), (1, 0), (0, 1)))
    return np.column_stack([slope[:3] - slope[3] * value[:3] / value[3] for slope in slopes]) / value[3]
