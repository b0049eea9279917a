"""Elements with grooves: where an element is divided, and the rule over what is left of it.

A groove trims the thickness domain, a protrusion extends it (section 4.2, Eq. 5); the element is
integrated subdomain by subdomain (Eq. 8), or on one grid for comparison (Eq. 7).

(x, y, z) are the reference coordinates: mid-surface parameters and the distance from it along its
normal in m. On a curved mid-surface the weights are dx dy dz and the caller multiplies by J_o. A cell is
((x0, x1), (y0, y1)). An axis is 0 for x and 1 for y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ancf.nurbs import Curve, curve_derivatives, invert
from ancf.quadrature import NO_PROMISE, Rule, gauss

ROUND_OFF = 1e-12
BOTTOM, TOP = -1, 1
GROOVE, PROTRUSION = -1, 1

Interval = tuple[float, float]
Cell = tuple[Interval, Interval]


@dataclass(frozen=True)
class Band:
    """A groove or a protrusion: a straight band on one face, running along an axis.

    face: BOTTOM or TOP. sign: GROOVE or PROTRUSION. along: the axis it runs along. edges: its two
    edges on the other axis. extent: its two ends on its own axis. section: the depth (height) in m
    where it is constant, or a curve through (across, depth), measured from the plate's plain face,
    whose first component does not decrease.
    """

    face: int
    sign: int
    along: int
    edges: Interval
    section: float | Curve
    extent: Interval = (-np.inf, np.inf)

    @property
    def across(self) -> int:
        """The axis that crosses the band."""
        return 1 - self.along

    @property
    def is_curved(self) -> bool:
        """Whether the section is a curve."""
        return isinstance(self.section, Curve)

    def limits(self, axis: int) -> Interval:
        """First and last coordinate of the band on an axis."""
        return self.edges if axis == self.across else self.extent


@dataclass(frozen=True, eq=False)
class _Strip:
    """One interval of a divided axis: its points (q,), weights (q,), and what the bands do there.

    inside (b,): whether the strip lies within each band's limits. depth (b, q): depth of the
    section of each band that this axis crosses, 0 for the others.
    """

    points: np.ndarray
    weights: np.ndarray
    inside: np.ndarray
    depth: np.ndarray


def thickness_range(
    bands: Sequence[Band], thickness: float, x: ArrayLike, y: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """z_min and z_max (m) of the material at the points (x, y), broadcast against each other.

    Of several grooves on one face the deepest counts, of several protrusions the highest; a groove
    cuts away all that lies above its floor, a protrusion too. Edges belong to their band. Raises
    ValueError where nothing is left.
    """
    at = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    covers = [_within(at[0], band.limits(0)) & _within(at[1], band.limits(1)) for band in bands]
    depths = [_depth(band, at[band.across]) for band in bands]
    return _faces(bands, thickness, covers, depths, at[0].shape)


def division(cell: Cell, bands: Sequence[Band]) -> tuple[np.ndarray, np.ndarray]:
    """Lines x and lines y that divide the cell: its sides, and the edges, ends and knots of the bands.

    Lines within round-off of a side or of each other are one line.
    """
    touching = [band for band in bands if _touches(cell, band)]
    return _lines(cell, touching, 0), _lines(cell, touching, 1)


def signature(cell: Cell, bands: Sequence[Band]) -> tuple:
    """Hashable key: cells with equal keys have the same rule up to a shift of their origins (x0, y0).

    It holds the cell's size and what the cell sees of each band, relative to its own origin and size.
    """
    sizes = tuple(float(f"{high - low:.11e}") for low, high in cell)
    return sizes, *(
        (band.face, band.sign, band.along, _shape(band.section), _seen(cell, band, 0), _seen(cell, band, 1))
        for band in bands
        if _touches(cell, band)
    )


def element_rule(
    cell: Cell,
    bands: Sequence[Band],
    thickness: float,
    points: tuple[int, int, int],
    integration: Literal["subdomain", "global"] = "subdomain",
) -> Rule:
    """Rule over the material of one element: points (q, 3), weights (q,).

    points: Gauss points along x, y, z in each subdomain (Eq. 8), or in the whole element with
    integration "global" (Eq. 7). z follows the kept thickness at each (x, y). A curved section is
    integrated over its own parameter, dy = y'(u) du, between its knots, so that a vertical tangent
    costs no accuracy. Raises ValueError where a band leaves no material.
    """
    touching = [band for band in bands if _touches(cell, band)]
    if integration == "global":
        return _global_rule(cell, touching, thickness, points)
    strips = [_strips(cell, touching, axis, points[axis]) for axis in (0, 1)]
    x = np.concatenate([strip.points for strip in strips[0]])
    y = np.concatenate([strip.points for strip in strips[1]])
    inside = [np.concatenate([np.repeat(s.inside[:, None], len(s.points), 1) for s in part], 1) for part in strips]
    depth = [np.concatenate([strip.depth for strip in part], 1) for part in strips]
    shape = (len(x), len(y))
    covers = [np.outer(inside[0][b], inside[1][b]) for b in range(len(touching))]
    depths = [np.broadcast_to(depth[0][b][:, None] + depth[1][b], shape) for b in range(len(touching))]
    z_min, z_max = _faces(touching, thickness, covers, depths, shape)
    area = np.outer(*(np.concatenate([strip.weights for strip in part]) for part in strips))
    degree = NO_PROMISE if any(band.is_curved for band in touching) else 2 * min(points) - 1
    return _through_thickness(x[:, None] + 0 * area, y + 0 * area, area, z_min, z_max, points[2], degree)


def _global_rule(cell: Cell, bands: Sequence[Band], thickness: float, points: tuple[int, int, int]) -> Rule:
    """One Gauss grid for the whole element (Eq. 7); the mapping of section 4.2 finds z at each point."""
    (x, w_x), (y, w_y) = (_gauss_on(side, count) for side, count in zip(cell, points[:2], strict=True))
    x, y = np.meshgrid(x, y, indexing="ij")
    z_min, z_max = thickness_range(bands, thickness, x, y)
    degree = NO_PROMISE if bands else 2 * min(points) - 1
    return _through_thickness(x, y, np.outer(w_x, w_y), z_min, z_max, points[2], degree)


def _through_thickness(x, y, area, z_min, z_max, count: int, degree: int) -> Rule:
    """Gauss points in z between z_min and z_max at each point (x, y) with the weight `area`, all (i, j)."""
    line = gauss(count)
    half = (z_max - z_min)[..., None] / 2
    z = (z_max + z_min)[..., None] / 2 + half * line.points[:, 0]
    weights = area[..., None] * half * line.weights
    points = np.stack([*(np.broadcast_to(c[..., None], z.shape) for c in (x, y)), z], axis=-1)
    return Rule(points.reshape(-1, 3), weights.ravel(), degree)


def _faces(bands, thickness: float, covers, depths, shape) -> tuple[np.ndarray, np.ndarray]:
    """z_min and z_max (shape) where each band has the depth `depths[b]` on the points `covers[b]`."""
    change = {(face, sign): np.zeros(shape) for face in (BOTTOM, TOP) for sign in (GROOVE, PROTRUSION)}
    for band, covered, depth in zip(bands, covers, depths, strict=True):
        worst = change[band.face, band.sign]
        np.maximum(worst, np.where(covered, depth, 0.0), out=worst)
    z = {}
    for face in (BOTTOM, TOP):
        groove, protrusion = change[face, GROOVE], change[face, PROTRUSION]
        z[face] = face * (thickness / 2 + np.where(groove > 0, -groove, protrusion))
    if np.any(z[TOP] <= z[BOTTOM]):
        raise ValueError(f"the grooves leave no material of a thickness of {thickness} m")
    return z[BOTTOM], z[TOP]


def _strips(cell: Cell, bands: Sequence[Band], axis: int, count: int) -> list[_Strip]:
    """The divided axis, with `count` points in each interval."""
    lines = _lines(cell, bands, axis)
    tolerance = ROUND_OFF * _scale(cell, bands)
    return [_strip(low, high, bands, axis, count, tolerance) for low, high in pairwise(lines)]


def _strip(low: float, high: float, bands: Sequence[Band], axis: int, count: int, tolerance: float) -> _Strip:
    """Points of one interval; where a curved section crosses it, they are spaced in its parameter."""
    middle = (low + high) / 2
    inside = np.array([band.limits(axis)[0] < middle < band.limits(axis)[1] for band in bands], dtype=bool)
    crossed = [bool(i) and band.across == axis for i, band in zip(inside, bands, strict=True)]
    curves = [band.section for band, cross in zip(bands, crossed, strict=True) if cross and band.is_curved]
    if not curves:
        points, weights, known = *_gauss_on((low, high), count), {}
    else:
        points, weights, depth = _along_curve(curves[0], low, high, count, tolerance)
        known = {id(curves[0]): depth}
    depth = np.zeros((len(bands), count))
    for b, band in enumerate(bands):
        if crossed[b]:
            depth[b] = known[id(band.section)] if id(band.section) in known else _depth(band, points)
    return _Strip(points, weights, inside, depth)


def _along_curve(curve: Curve, low: float, high: float, count: int, tolerance: float):
    """Across coordinate, weight and depth (q,) at Gauss points in the parameter of one smooth piece of a section.

    The weights y'(u) du are scaled so that they add up to the interval's length at any `count`:
    the plain plate's mass does not depend on the shape of a groove's wall.
    """
    breaks = curve.breaks
    at_breaks = curve_derivatives(curve, breaks)[0][:, 0]
    first = breaks[np.abs(at_breaks - low) <= tolerance]
    last = breaks[np.abs(at_breaks - high) <= tolerance]
    start = first.max() if first.size else invert(curve, low)
    end = last.min() if last.size else invert(curve, high)
    u, weights = _gauss_on((float(start), float(end)), count)
    c, c_u, _ = curve_derivatives(curve, u)
    weights = weights * c_u[:, 0]
    return c[:, 0], weights * ((high - low) / weights.sum()), c[:, 1]


def _depth(band: Band, across: np.ndarray) -> np.ndarray:
    """Depth (m) of a band's section at coordinates across it, clipped to its edges."""
    if not band.is_curved:
        return np.full(np.shape(across), float(band.section))
    return curve_derivatives(band.section, invert(band.section, across))[0][..., 1]


def _lines(cell: Cell, bands: Sequence[Band], axis: int) -> np.ndarray:
    """Sorted distinct lines of one axis from side to side of the cell."""
    low, high = cell[axis]
    tolerance = ROUND_OFF * _scale(cell, bands)
    candidates = [line for band in bands for line in _own_lines(band, axis)]
    lines = [low]
    for line in sorted(line for line in candidates if line < high - tolerance):
        if line > lines[-1] + tolerance:
            lines.append(line)
    return np.array([*lines, high])


def _own_lines(band: Band, axis: int) -> list[float]:
    """Edges and knots of a band on one axis."""
    if axis == band.across and band.is_curved:
        return curve_derivatives(band.section, band.section.breaks)[0][:, 0].tolist()
    return list(band.limits(axis))


def _touches(cell: Cell, band: Band) -> bool:
    """Whether the band covers more of the cell than round-off."""
    tolerance = ROUND_OFF * _scale(cell, [band])
    overlaps = ((cell[a], band.limits(a)) for a in (0, 1))
    return all(min(c[1], b[1]) - max(c[0], b[0]) > tolerance for c, b in overlaps)


@lru_cache(maxsize=256)
def _shape(section: float | Curve) -> tuple:
    """What makes two sections the same wherever they lie, to 11 digits."""
    if not isinstance(section, Curve):
        return (section,)
    numbers = [section.knots, section.weights, section.control_points - [section.control_points[0, 0], 0.0]]
    return section.degree, *(float(f"{value:.10e}") for array in numbers for value in array.ravel())


def _seen(cell: Cell, band: Band, axis: int) -> tuple[float, float]:
    """A band's limits in units of the cell, clipped to it unless they place a curved section."""
    low, high = cell[axis]
    limits = [(limit - low) / (high - low) for limit in band.limits(axis)]
    if not (band.is_curved and axis == band.across):
        limits = [min(max(limit, 0.0), 1.0) for limit in limits]
    return round(limits[0], 11), round(limits[1], 11)


def _scale(cell: Cell, bands: Sequence[Band]) -> float:
    """Largest finite coordinate: what round-off is measured against."""
    values = [*cell[0], *cell[1], *(v for band in bands for v in (*band.edges, *band.extent))]
    return max(abs(value) for value in values if np.isfinite(value))


def _within(values: np.ndarray, limits: Interval) -> np.ndarray:
    return (values >= limits[0]) & (values <= limits[1])


def _gauss_on(interval: Interval, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights (count,) on an interval."""
    line = gauss(count)
    half = (interval[1] - interval[0]) / 2
    return (interval[0] + interval[1]) / 2 + half * line.points[:, 0], half * line.weights
