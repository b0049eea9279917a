"""What a scene may not say of grooves and protrusions of any outline, alone and where two of them meet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from compare.scene import Band, Outlined, Scene
from compare.scene_outline import DepthSurface, Loop, rectangle, sides_cross, within

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline

LEAST_AREA = 1e-12  # of the plate's
GRID = 24  # points a side that two shapes are looked at for a common one
EDGE = 1e-9  # of a side: what touches overlaps no more than this
ROUND_OFF = 1e-12
LEAST_MATERIAL = 1e-6  # of the thickness, that a groove must leave

Feature = Band | Outlined


def own_problems(scene: Scene, key: str, shape: Outlined) -> Iterator[str]:
    """Problems of one outlined groove or protrusion."""
    from compare.scene_geometry import knot_problems

    if (shape.depth is None) == (shape.depth_surface is None):
        missing = shape.depth is None
        words = "this key is missing; an outline needs" if missing else "state either depth or depth_surface, not both;"
        yield f"{key}.depth{'' if missing else f' = {shape.depth!r}'}: {words} depth, or depth_surface"
        return
    loop = shape.outline
    found = list(knot_problems(f"{key}.outline.knots", loop.knots, loop.degree, len(loop.control_points)))
    found += list(_loop_problems(f"{key}.outline", loop)) if not found else []
    found += list(_place_problems(scene, f"{key}.outline", loop)) if not found else []
    if not found and shape.depth_surface is not None:
        found += list(_surface_problems(scene, f"{key}.depth_surface", shape))
    yield from found
    if not found and key.startswith("grooves"):
        deepest = shape.depth if shape.depth_surface is None else depths(shape, *_points_inside(scene, shape)).max()
        if scene.thickness - deepest < LEAST_MATERIAL * scene.thickness:
            about = f"{key}.depth = {deepest:.6g}"
            yield f"{about}: the groove is as deep as the plate ({scene.thickness:g} m) or deeper"


def _loop_problems(key: str, loop: Loop) -> Iterator[str]:
    """A loop that is not closed or crosses itself."""
    points = loop.control_points
    if loop.weights is not None and len(loop.weights) != len(points):
        yield f"{key}.weights = {list(loop.weights)}: {len(points)} control points need as many weights"
        return
    if points[0] != points[-1]:
        last = f"{key}.control_points.{len(points) - 1} = {list(points[-1])}"
        yield f"{last}: an outline is closed; its last point must be its first, {list(points[0])}"
        return
    polygon = loop.polygon
    crossing = sides_cross(polygon, polygon)
    if len(crossing):
        x, y = polygon[crossing[0, 0]]
        yield f"{key}.control_points: the outline crosses itself near ({x:.6g}, {y:.6g})"


def _place_problems(scene: Scene, key: str, loop: Loop) -> Iterator[str]:
    """A loop around nothing, or off the plate."""
    polygon, spans = loop.polygon, np.array(scene.surface.span)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    (xa, ya), (xb, yb) = polygon.T, np.roll(polygon, -1, axis=0).T
    if abs(np.sum(xa * yb - xb * ya)) / 2 < LEAST_AREA * np.prod(np.diff(spans, axis=1)):
        yield f"{key}.control_points: the outline encloses no area"
    elif np.any(high <= spans[:, 0]) or np.any(low >= spans[:, 1]):
        (x0, x1), (y0, y1) = spans.tolist()
        yield (
            f"{key}.control_points: off the plate: the outline has x {low[0]:g} to {high[0]:g}, y {low[1]:g} to "
            f"{high[1]:g}, the plate x {x0:g} to {x1:g}, y {y0:g} to {y1:g}"
        )


def _surface_problems(scene: Scene, key: str, shape: Outlined) -> Iterator[str]:
    """A depth surface that is not well formed, too small, or not a depth."""
    from compare.scene_geometry import AXES, knot_problems

    surface, rows = shape.depth_surface, [len(row) for row in shape.depth_surface.depths]
    if not rows or len(set(rows)) > 1:
        yield f"{key}.depths = rows of {rows} numbers: each row needs the same number of them"
        return
    found = []
    for axis, count in enumerate((len(rows), rows[0])):
        found += knot_problems(f"{key}.knots.{axis}", surface.knots[axis], surface.degree[axis], count)
        low, high = (max(shape.limits(axis)[0], scene.surface.span[axis][0]),
                     min(shape.limits(axis)[1], scene.surface.span[axis][1]))  # fmt: skip
        first, last = surface.knots[axis][0], surface.knots[axis][-1]
        if not found and (low < first - EDGE * (high - low) or high > last + EDGE * (high - low)):
            about = f"{key}.knots.{axis}: from {first:g} to {last:g}"
            found.append(f"{about}, but the outline has {AXES[axis]} from {low:.6g} to {high:.6g} on the plate")
    yield from found
    if not found:
        least = depths(shape, *_points_inside(scene, shape)).min()
        if least < 0:
            yield f"{key}.depths: the depth inside the outline falls to {least:.6g} m; it must not be negative"


def depths(shape: Outlined, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Depth (m) at points (n,)."""
    if shape.depth_surface is None:
        return np.full(np.shape(x), shape.depth)
    return surface_depths(shape.depth_surface, x, y)


def surface_depths(surface: DepthSurface, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Depth (m) of a depth surface at points (n,)."""
    return depth_spline(surface)(np.stack([x, y], axis=-1))


def depth_spline(surface: DepthSurface) -> NdBSpline:
    """A depth surface as a function of points (..., 2)."""
    from scipy.interpolate import NdBSpline

    return NdBSpline(surface.knots, np.array(surface.depths), surface.degree)


def _points_inside(scene: Scene, shape: Outlined) -> tuple[np.ndarray, np.ndarray]:
    """Points on the plate inside an outline and on its edge."""
    spans = scene.surface.span
    sides = [
        np.linspace(max(low, first), min(high, last), 4 * GRID)
        for (low, high), (first, last) in zip((shape.limits(0), shape.limits(1)), spans, strict=True)
    ]
    x, y = (side.ravel() for side in np.meshgrid(*sides, indexing="ij"))
    own = within(shape.outline.polygon, x, y)
    edge = np.clip(shape.outline.polygon, *np.array(spans).T)
    return np.concatenate([x[own], edge[:, 0]]), np.concatenate([y[own], edge[:, 1]])


def pair_problems(scene: Scene, key: str, one: Feature, other_key: str, other: Feature) -> Iterator[str]:
    """Problems of two features, one of them at least outlined, that lie over each other."""
    grooves = key.startswith("grooves"), other_key.startswith("grooves")
    same = one.face == other.face
    varies = [getattr(f, "profile", None) is not None or getattr(f, "depth_surface", None) is not None
              for f in (one, other)]  # fmt: skip
    if same and grooves[0] == grooves[1] and not any(varies):
        return
    if not same and not all(grooves):
        return
    x, y = _common(scene, one, other)
    if not len(x):
        return
    place = f"{other_key} overlaps {key} ({one.name!r})"
    if same and grooves[0] != grooves[1]:
        yield f"{place}: a groove and a protrusion on the same place of one face are not modelled; state one outline"
    elif same:
        yield f"{place}: only those of constant depth may overlap on one face; state one outline"
    else:
        together = float((_depths(scene, one, x, y) + _depths(scene, other, x, y)).max())
        if scene.thickness - together < LEAST_MATERIAL * scene.thickness:
            yield f"{place} on the other face: together {together:.6g} m deep in a plate of {scene.thickness:g} m"


def _depths(scene: Scene, feature: Feature, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    from compare.scene_geometry import band_depths

    return depths(feature, x, y) if isinstance(feature, Outlined) else band_depths(feature, (x, y))


def _common(scene: Scene, one: Feature, other: Feature) -> tuple[np.ndarray, np.ndarray]:
    """Points on the plate that lie in both features: those of a grid, and where their edges cross."""
    shapes = [_polygon(scene, feature) for feature in (one, other)]
    low = np.maximum(np.max([s.min(axis=0) for s in shapes], axis=0), [span[0] for span in scene.surface.span])
    high = np.minimum(np.min([s.max(axis=0) for s in shapes], axis=0), [span[1] for span in scene.surface.span])
    size = np.array([span[1] - span[0] for span in scene.surface.span])
    if np.any(high - low <= ROUND_OFF * size):
        return np.empty(0), np.empty(0)
    steps = (np.arange(GRID) + 0.5) / GRID
    x, y = (side.ravel() for side in np.meshgrid(*(low + steps[:, None] * (high - low)).T, indexing="ij"))
    both = within(shapes[0], x, y) & within(shapes[1], x, y)
    shrunk = _shrunk(shapes[1])
    crossing = shapes[0][sides_cross(shapes[0], shrunk)[:, 0]]
    crossing = crossing[np.all((crossing >= low) & (crossing <= high), axis=1)]
    return np.concatenate([x[both], crossing[:, 0]]), np.concatenate([y[both], crossing[:, 1]])


def _shrunk(polygon: np.ndarray) -> np.ndarray:
    """The polygon a hair smaller, so that what only touches it does not cross it."""
    middle = (polygon.min(axis=0) + polygon.max(axis=0)) / 2
    return middle + (1 - EDGE) * (polygon - middle)


def _polygon(scene: Scene, feature: Feature) -> np.ndarray:
    from compare.scene_geometry import limits

    return (
        feature.outline.polygon
        if isinstance(feature, Outlined)
        else rectangle(*(limits(scene, feature, k) for k in (0, 1)))
    )
