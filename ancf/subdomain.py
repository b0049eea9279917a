"""Elements with grooves: where an element is divided, and the rule over what is left of it.

A groove trims the thickness domain, a protrusion extends it (section 4.2, Eq. 5); the element is
integrated subdomain by subdomain (Eq. 8), or on one grid for comparison (Eq. 7).

(x, y, z) are the reference coordinates: mid-surface parameters and the distance from it along its
normal in m. On a curved mid-surface the weights are dx dy dz and the caller multiplies by J_o. A cell is
((x0, x1), (y0, y1)). An axis is 0 for x and 1 for y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ancf.nurbs import Curve, GeometryError, curve_derivatives, invert
from ancf.quadrature import NO_PROMISE, Rule, gauss, join, onto_cell, tensor

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
class _Axis:
    """One axis of a cell, or one interval of it: where it is integrated, and what the b bands do there.

    rule: q points in 1-D. inside (b, q): whether a point lies within the band's limits on this
    axis. depth (b, q): depth of the section of a band that this axis crosses, 0 for the others.
    """

    rule: Rule
    inside: np.ndarray
    depth: np.ndarray


def thickness_range(
    bands: Sequence[Band], thickness: float, x: ArrayLike, y: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """z_min and z_max (m) of the material at the points (x, y), broadcast against each other.

    Of several grooves on one face the deepest counts, of several protrusions the highest; a groove
    cuts away all that lies above its floor, a protrusion too. Edges belong to their band. Raises
    GeometryError where nothing is left.
    """
    at = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    covers = [_within(at[0], band.limits(0)) & _within(at[1], band.limits(1)) for band in bands]
    depths = [_depth(band, at[band.across]) for band in bands]
    z_min, z_max = _faces(bands, thickness, covers, depths)
    shape = np.broadcast_shapes(at[0].shape, at[1].shape)
    return np.broadcast_to(z_min, shape), np.broadcast_to(z_max, shape)


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
    levels: Sequence[float] = (),
) -> Rule:
    """Rule over the material of one element: points (q, 3), weights (q,).

    points: Gauss points along x, y, z in each subdomain (Eq. 8), or in the whole element with
    integration "global" (Eq. 7). z follows the kept thickness at each (x, y), divided at the increasing
    `levels` of z with as many points in each part. A curved section is
    integrated over its own parameter, dy = y'(u) du, between its knots, so that a vertical tangent
    costs no accuracy. Raises GeometryError where a band leaves no material.
    """
    touching = [band for band in bands if _touches(cell, band)]
    if not touching:
        if not levels:
            return onto_cell(tensor(*map(gauss, points)), (*cell, (-thickness / 2, thickness / 2)))
        plane = onto_cell(tensor(*map(gauss, points[:2])), cell)
        return through_thickness(plane, -thickness / 2, thickness / 2, points[2], levels)
    if integration == "global":
        plane = onto_cell(tensor(*map(gauss, points[:2])), cell)
        z_min, z_max = thickness_range(touching, thickness, *plane.points.T)
        return through_thickness(replace(plane, degree=NO_PROMISE), z_min, z_max, points[2], levels)
    x, y = (_divided_axis(cell, touching, axis, points[axis]) for axis in (0, 1))
    count = len(touching)
    covers = (x.inside[:, :, None] & y.inside[:, None, :]).reshape(count, -1)
    depths = (x.depth[:, :, None] + y.depth[:, None, :]).reshape(count, -1)
    z_min, z_max = _faces(touching, thickness, covers, depths)
    return through_thickness(tensor(x.rule, y.rule), z_min, z_max, points[2], levels)


def through_thickness(
    plane: Rule, z_min: np.ndarray, z_max: np.ndarray, count: int, levels: Sequence[float] = ()
) -> Rule:
    """Rule in (x, y, z): columns over the points of `plane`, from their z_min to their z_max (q,).

    `count` Gauss points in each part of a column between the increasing levels.
    """
    line = gauss(count)
    faces = [z_min, *(np.clip(level, z_min, z_max) for level in levels), z_max]
    faces = np.stack([np.broadcast_to(z, plane.weights.shape) for z in faces], axis=1)
    half = np.diff(faces)[..., None] / 2
    z = faces[:, :-1, None] + half * (1 + line.points[:, 0])
    weights = plane.weights[:, None, None] * half * line.weights
    some = np.broadcast_to(half > 0, z.shape).ravel()
    points = np.column_stack([np.repeat(plane.points, z[0].size, axis=0), z.ravel()])
    return Rule(points[some], weights.ravel()[some], min(plane.degree, line.degree))


def _faces(bands: Sequence[Band], thickness: float, covers: Sequence, depths: Sequence) -> tuple:
    """z_min and z_max (...) where band b has the depth depths[b] (...) at the points covers[b] (...)."""
    change = {(face, sign): 0.0 for face in (BOTTOM, TOP) for sign in (GROOVE, PROTRUSION)}
    for band, covered, depth in zip(bands, covers, depths, strict=True):
        kind = band.face, band.sign
        change[kind] = np.maximum(change[kind], np.where(covered, depth, 0.0))
    z = {}
    for face in (BOTTOM, TOP):
        groove, protrusion = change[face, GROOVE], change[face, PROTRUSION]
        z[face] = face * (thickness / 2 + np.where(groove > 0, -groove, protrusion))
    if np.any(z[TOP] - z[BOTTOM] <= ROUND_OFF * thickness):
        raise GeometryError(f"the grooves leave no material of a thickness of {thickness} m")
    return z[BOTTOM], z[TOP]


def _divided_axis(cell: Cell, bands: Sequence[Band], axis: int, count: int) -> _Axis:
    """One axis of the cell with `count` points in each of its intervals."""
    tolerance = ROUND_OFF * _scale(cell, bands)
    parts = [_interval(low, high, bands, axis, count, tolerance) for low, high in pairwise(_lines(cell, bands, axis))]
    inside, depth = (np.concatenate([getattr(part, name) for part in parts], axis=1) for name in ("inside", "depth"))
    return _Axis(join(*(part.rule for part in parts)), inside, depth)


def _interval(low: float, high: float, bands: Sequence[Band], axis: int, count: int, tolerance: float) -> _Axis:
    """One interval of an axis; where a curved section crosses it, its points are spaced in the section's parameter.

    Of two curved sections, one on each face, the one that needs it more leads.
    """
    middle = (low + high) / 2
    inside = [band.limits(axis)[0] < middle < band.limits(axis)[1] for band in bands]
    crossed = [here and band.across == axis for here, band in zip(inside, bands, strict=True)]
    curved = {
        b: _along_curve(band.section, low, high, count, tolerance)
        for b, band in enumerate(bands)
        if crossed[b] and band.is_curved
    }
    depth = np.zeros((len(bands), count))
    if curved:
        leading = min(curved, key=lambda b: _evenness(curved[b][0]))
        rule, depth[leading] = curved.pop(leading)
        crossed[leading] = False
    else:
        rule = onto_cell(gauss(count), [(low, high)])
    for b, band in enumerate(bands):
        if crossed[b]:
            depth[b] = _depth(band, rule.points[:, 0])
    return _Axis(rule, np.repeat(np.array(inside)[:, None], count, axis=1), depth)


def _along_curve(curve: Curve, low: float, high: float, count: int, tolerance: float) -> tuple[Rule, np.ndarray]:
    """Rule in the coordinate across a section, and the depth (q,) there, from Gauss points in the curve's parameter.

    Between low and high the section is smooth. The weights y'(u) du are scaled so that they add up
    to the interval's length at any `count`: the plain part of the plate keeps its volume exactly.
    """
    breaks = curve.breaks
    at_breaks = curve_derivatives(curve, breaks)[0][:, 0]
    first = breaks[np.abs(at_breaks - low) <= tolerance]
    last = breaks[np.abs(at_breaks - high) <= tolerance]
    start = first.max() if first.size else float(invert(curve, low))
    end = last.min() if last.size else float(invert(curve, high))
    along = onto_cell(gauss(count), [(start, end)])
    c, c_u, _ = curve_derivatives(curve, along.points[:, 0])
    weights = along.weights * c_u[:, 0]
    return Rule(c[:, :1], weights * ((high - low) / weights.sum()), NO_PROMISE), c[:, 1]


def _evenness(rule: Rule) -> float:
    """Least over greatest slope of the map from Gauss points: small where the section has a vertical tangent."""
    slope = rule.weights / gauss(len(rule.weights)).weights
    return slope.min() / slope.max()


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
