"""What a scene's geometry may not say: mid-surface, bands, and whether a point lies in the material.

SciPy takes half a second to load, so only a curved profile loads it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations, pairwise

import numpy as np

from compare.scene import Band, Feature, Interval, NurbsPatch, Outlined, Profile, Scene
from compare.scene_outline import nurbs_points, within
from compare.scene_outline_checks import depths, own_problems, pair_problems
from compare.scene_revolved import edge_of_ring, revolved_problems

SAMPLES = 513  # of each knot span of a profile
LEAST_MATERIAL = 1e-6  # of the thickness, that a groove must leave; a sampled depth is this exact
THICK = 0.5  # of the shorter side: a thickness above it is told
ROUND_OFF = 1e-12  # of a length
ROUND_OFF_PLANE = 1e-9  # of a length: control points are typed with ten digits and more
AXES = ("x", "y")


def surface_problems(scene: Scene) -> Iterator[str]:
    """Problems of a NURBS or a revolved mid-surface; a rectangle has none left."""
    patch = scene.surface
    if patch.kind == "revolved":
        section = patch.section
        yield from knot_problems("surface.section.knots", section.knots, section.degree, len(section.control_points))
        yield from revolved_problems(patch)
    if patch.kind != "nurbs":
        return
    rows = [len(row) for row in patch.control_points]
    if not rows or len(set(rows)) > 1:
        yield f"surface.control_points = rows of {rows} points: each row needs the same number of points"
        return
    for axis, count in enumerate((len(rows), rows[0])):
        yield from knot_problems(f"surface.knots.{axis}", patch.knots[axis], patch.degree[axis], count)
    yield from _net_problems(patch, len(rows), rows[0])


def _net_problems(patch: NurbsPatch, n: int, m: int) -> Iterator[str]:
    if patch.weights is not None and [len(row) for row in patch.weights] != [m] * n:
        shape = [len(row) for row in patch.weights]
        yield f"surface.weights = rows of {shape} weights: the net of control points is {n} x {m}"


def knot_problems(key: str, knots: Sequence[float], degree: int, count: int) -> Iterator[str]:
    """Problems of one knot vector of `count` control points."""
    shown = f"{key} = {list(knots)}"
    if count <= degree:
        yield f"{shown}: degree {degree} needs at least {degree + 1} control points, there are {count}"
    elif len(knots) != count + degree + 1:
        yield f"{shown}: {count} control points of degree {degree} need {count + degree + 1} knots, not {len(knots)}"
    elif any(b < a for a, b in pairwise(knots)):
        yield f"{shown}: knots must not decrease"
    elif knots[0] == knots[-1]:
        yield f"{shown}: the first and the last knot must differ"
    elif len(set(knots[: degree + 1])) > 1 or len(set(knots[-degree - 1 :])) > 1:
        yield f"{shown}: the first and the last knot must each stand {degree + 1} times (degree + 1)"
    elif max(knots[1:-1].count(knot) for knot in knots) > degree:
        yield f"{shown}: an inner knot may stand {degree} times at most (degree), an end knot {degree + 1} times"


def off_plane(scene: Scene, edge: str, normal: str) -> str | None:
    """Why the face of an edge does not lie in a plane of this normal (X, Y or Z); None where it does.

    It lies there if the mid-surface's edge and the directors on it do, to ROUND_OFF_PLANE of the surface's size.
    """
    component, patch = "XYZ".index(normal), scene.surface
    if patch.kind == "rectangle":
        own = "XY"["xy".index(edge[0])]
        return None if normal == own else f"the face of {edge} lies in a plane of normal {own}"
    S, S_out, S_along = edge_of_ring(patch, edge, SAMPLES) if patch.kind == "revolved" else _edge_of(patch, edge)
    size = np.abs(S).max() if patch.kind == "revolved" else _size(patch)
    if np.ptp(S[:, component]) > ROUND_OFF_PLANE * size:
        return f"the edge {edge} does not lie in a plane of this normal"
    director = np.cross(S_out, S_along)
    if np.abs(director[:, component]).max() > ROUND_OFF_PLANE * np.linalg.norm(director, axis=1).max():
        return f"the directors of the edge {edge} lean out of the plane of this normal"
    return None


def plane_of(scene: Scene, edge: str, normal: str) -> tuple[float, float]:
    """Coordinate (m) along a normal of the plane in which the face of an edge lies, and the size of the body (m)."""
    surface = scene.surface
    if surface.kind == "rectangle":
        return surface.span["xy".index(edge[0])][int(edge[1])], max(surface.length, surface.width)
    S, *_ = edge_of_ring(surface, edge, SAMPLES) if surface.kind == "revolved" else _edge_of(surface, edge)
    return float(S[:, "XYZ".index(normal)].mean()), float(np.abs(S).max())


def sides(scene: Scene) -> tuple[float, float]:
    """Lengths (m) of the mid-surface along x and along y: of the longer one of the two edges that run there."""
    surface = scene.surface
    if surface.kind == "rectangle":
        return surface.length, surface.width
    of = partial(edge_of_ring, surface, samples=SAMPLES) if surface.kind == "revolved" else partial(_edge_of, surface)
    edges = {edge: np.diff(of(edge)[0], axis=0) for edge in ("x0", "x1", "y0", "y1")}
    length = {edge: float(np.linalg.norm(steps, axis=1).sum()) for edge, steps in edges.items()}
    return max(length["y0"], length["y1"]), max(length["x0"], length["x1"])


def too_thick(scene: Scene) -> str | None:
    """Words on a thickness that is beyond a plate's, perhaps for being in millimetres; None where it is not."""
    shorter = min(sides(scene))
    if scene.thickness <= THICK * shorter:
        return None
    reason = f"above {THICK:g} of the shorter side, {shorter:.4g} m; lengths are in metres"
    return f"thickness = {scene.thickness:g}: {reason}"


def _size(patch: NurbsPatch) -> float:
    """Largest extent (m) of the control points."""
    return float(np.ptp(np.array(patch.control_points).reshape(-1, 3), axis=0).max())


def _edge_of(patch: NurbsPatch, edge: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of an edge and the directions of both derivatives there, out of it and along it: (k, 3) each.

    At the end of a clamped knot vector the first two rows of the net span the derivative out of the edge.
    """
    from scipy.interpolate import BSpline

    axis = AXES.index(edge[0])
    points = np.moveaxis(np.array(patch.control_points), axis, 0)
    weights = np.ones(points.shape[:2]) if patch.weights is None else np.moveaxis(np.array(patch.weights), axis, 0)
    rows = (0, 1) if edge[1] == "0" else (-1, -2)
    knots, degree = np.array(patch.knots[1 - axis]), patch.degree[1 - axis]
    at = np.linspace(knots[0], knots[-1], SAMPLES)
    net = np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)
    first, second = (BSpline(knots, net[row], degree)(at) for row in rows)
    slope = BSpline(knots, net[rows[0]], degree)(at, nu=1)
    S = first[:, :3] / first[:, 3:]
    return S, second[:, :3] - second[:, 3:] * S, slope[:, :3] - slope[:, 3:] * S


def all_bands(scene: Scene) -> list[tuple[str, Feature]]:
    """Key and statement of every groove and protrusion."""
    kinds = ("grooves", "protrusions")
    return [(f"{kind}.{i}", band) for kind in kinds for i, band in enumerate(getattr(scene, kind))]


def band_problems(scene: Scene) -> Iterator[str]:
    """Problems of grooves and protrusions, each alone and, where each is sound, in pairs."""
    sound = []
    for key, band in all_bands(scene):
        found = list(_own_problems(scene, key, band))
        yield from found
        if not found:
            sound.append((key, band))
    for (key, band), (other_key, other) in combinations(sound, 2):
        yield from _pair_problems(scene, key, band, other_key, other)


def _own_problems(scene: Scene, key: str, band: Feature) -> Iterator[str]:
    if isinstance(band, Outlined):
        yield from own_problems(scene, key, band)
        return
    if band.profile is not None and (band.across is not None or band.depth is not None):
        yield f"{key}.profile: state either profile, or across and depth, not both"
        return
    if band.profile is None and (band.across is None or band.depth is None):
        missing = "across" if band.across is None else "depth"
        yield f"{key}.{missing}: this key is missing; a band needs across and depth, or profile"
        return
    found = [] if band.profile is None else list(_profile_problems(f"{key}.profile", band.profile))
    yield from found
    if found:
        return
    edges = f"{key}.across" if band.profile is None else f"{key}.profile.control_points"
    yield from _interval_problems(edges, band.edges, scene, 1 - AXES.index(band.along))
    if band.extent is not None:
        yield from _interval_problems(f"{key}.extent", band.extent, scene, AXES.index(band.along))
    deepest = float(_section(band)[1].max())
    if key.startswith("grooves") and scene.thickness - deepest < LEAST_MATERIAL * scene.thickness:
        depth = f"{key}.depth = {band.depth!r}" if band.profile is None else f"{key}.profile = {deepest:.6g} m deep"
        yield f"{depth}: the groove is as deep as the plate ({scene.thickness:g} m) or deeper"


def _interval_problems(key: str, interval: Interval, scene: Scene, axis: int) -> Iterator[str]:
    """Problems of the range that a band covers on one axis of the plate."""
    (low, high), (first, last) = interval, scene.surface.span[axis]
    slack = ROUND_OFF * (last - first)
    if not low < high:
        yield f"{key} = {list(interval)}: the first coordinate must be less than the second"
    elif low < first - slack or high > last + slack:
        yield f"{key} = {list(interval)}: off the plate, whose {AXES[axis]} runs from {first:g} to {last:g}"


def _profile_problems(key: str, profile: Profile) -> Iterator[str]:
    points = profile.control_points
    yield from knot_problems(f"{key}.knots", profile.knots, profile.degree, len(points))
    if profile.weights is not None and len(profile.weights) != len(points):
        yield f"{key}.weights = {list(profile.weights)}: {len(points)} control points need as many weights"
    for i, (before, point) in enumerate(pairwise(points), start=1):
        if point[0] < before[0]:
            yield f"{key}.control_points.{i} = {list(point)}: the coordinate across must not decrease"
    for i in (0, len(points) - 1) if points else ():
        if points[i][1] != 0:
            yield f"{key}.control_points.{i} = {list(points[i])}: a profile begins and ends on the face, at depth 0"
    for i, point in enumerate(points):
        if point[1] < 0:
            yield f"{key}.control_points.{i} = {list(point)}: a depth must not be negative"


def _pair_problems(scene: Scene, key: str, band: Feature, other_key: str, other: Feature) -> Iterator[str]:
    """Problems of two bands that lie over each other."""
    if isinstance(band, Outlined) or isinstance(other, Outlined):
        yield from pair_problems(scene, key, band, other_key, other)
        return
    common = [_common(limits(scene, band, axis), limits(scene, other, axis)) for axis in (0, 1)]
    spans = zip(common, scene.surface.span, strict=True)
    if any(high - low <= ROUND_OFF * (last - first) for (low, high), (first, last) in spans):
        return
    place = f"{other_key} overlaps {key} ({band.name!r})"
    grooves = key.startswith("grooves"), other_key.startswith("grooves")
    if band.face == other.face and grooves[0] != grooves[1]:
        yield f"{place}: a groove and a protrusion on the same place of one face are not modelled; state one profile"
    elif band.face == other.face and (band.profile is not None or other.profile is not None):
        yield f"{place}: only rectangular sections may overlap on one face; state one profile"
    elif band.face != other.face and all(grooves):
        together = _deepest_together(band, other, common)
        if scene.thickness - together < LEAST_MATERIAL * scene.thickness:
            yield f"{place} on the other face: together {together:.6g} m deep in a plate of {scene.thickness:g} m"


def _deepest_together(band: Band, other: Band, common: list[Interval]) -> float:
    """Greatest sum of two depths where two bands lie over each other."""
    if band.along != other.along:
        return sum(_depths(b, common[1 - AXES.index(b.along)])[1].max() for b in (band, other))
    interval = common[1 - AXES.index(band.along)]
    (y, depth), (other_y, other_depth) = _depths(band, interval), _depths(other, interval)
    here, there = depth + np.interp(y, other_y, other_depth), other_depth + np.interp(other_y, y, depth)
    return float(max(here.max(), there.max()))


def _depths(band: Band, interval: Interval) -> tuple[np.ndarray, np.ndarray]:
    """The section within an interval, its ends included."""
    y, depth = _section(band)
    inside = (y > interval[0]) & (y < interval[1])
    ends = np.interp(interval, y, depth)
    return np.array([interval[0], *y[inside], interval[1]]), np.array([ends[0], *depth[inside], ends[1]])


def material_range(scene: Scene, x: float, y: float) -> Interval:
    """z_min and z_max (m) of the material at (x, y); the walls of a groove belong to the material."""
    faces = {"bottom": 0.0, "top": 0.0}
    for kind, sign in (("protrusions", 1), ("grooves", -1)):
        for face in faces:
            bands = [band for band in getattr(scene, kind) if band.face == face]
            depth = max((_depth_at(scene, band, (x, y)) for band in bands), default=0.0)
            faces[face] += sign * depth
    half = scene.thickness / 2
    return -half - faces["bottom"], half + faces["top"]


def _depth_at(scene: Scene, band: Feature, at: Interval) -> float:
    if isinstance(band, Outlined):
        first, last = np.array(scene.surface.span).T
        hair = ROUND_OFF_PLANE * (last - first)  # an outline that reaches the plate's edge covers it too
        x, y = np.clip(at, first + hair, last - hair)
        return float(depths(band, x, y)) if within(band.outline.polygon, x, y) else 0.0
    for axis in (0, 1):
        low, high = limits(scene, band, axis)
        first, last = scene.surface.span[axis]
        open_low, open_high = low > first, high < last  # a band that leaves the plate covers the plate's edge too
        if at[axis] < low or at[axis] > high or (open_low and at[axis] == low) or (open_high and at[axis] == high):
            return 0.0
    if band.profile is None:
        return band.depth
    from scipy.optimize import brentq

    low, high = band.edges
    inset = ROUND_OFF * (high - low)  # a wall at the plate's edge is passed
    across = min(max(at[1 - AXES.index(band.along)], low + inset), high - inset)
    ends = band.profile.knots[0], band.profile.knots[-1]
    u = brentq(lambda u: nurbs_points(band.profile, u)[0] - across, *ends, xtol=1e-15)
    return float(nurbs_points(band.profile, u)[1])


def limits(scene: Scene, band: Band, axis: int) -> Interval:
    """Range of a band on an axis of the plate."""
    if axis != AXES.index(band.along):
        return band.edges
    return band.extent or scene.surface.span[axis]


def _common(first: Interval, second: Interval) -> Interval:
    return max(first[0], second[0]), min(first[1], second[1])


def band_depths(band: Band, at: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Depth (m) of a band at points (x, y) that it covers, from samples of its section."""
    return np.interp(at[1 - AXES.index(band.along)], *_section(band))


def _section(band: Band) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates across a band and the depth (m) there: samples that include every knot."""
    if band.profile is None:
        return np.array(band.edges), np.array([band.depth, band.depth])
    breaks = np.unique(band.profile.knots)
    u = np.concatenate([np.linspace(a, b, SAMPLES) for a, b in pairwise(breaks)])
    return tuple(nurbs_points(band.profile, u).T)
