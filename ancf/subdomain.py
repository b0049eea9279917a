"""Elements with grooves: where an element is divided, and the rule over what is left of it.

A groove trims the thickness domain, a protrusion extends it (section 4.2, Eq. 5); the element is
integrated subdomain by subdomain (Eq. 8), or on one grid for comparison (Eq. 7).

(x, y, z) are the reference coordinates: mid-surface parameters and the distance from it along its
normal in m. On a curved mid-surface the weights are dx dy dz and the caller multiplies by J_o. A cell is
((x0, x1), (y0, y1)). An axis is 0 for x and 1 for y.

Bands divide an element by straight lines along its sides, into subdomains with a product rule each. What has an
outline cuts it anywhere: the rule is then that of `ancf.cut`, with the fewest points that keep its promise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from math import lgamma, log
from typing import Literal

import numpy as np

from ancf.band import BOTTOM, GROOVE, PROTRUSION, TOP, Band, Cell, along_curve, evenness, section_depth
from ancf.cut import Cut, Region, cut, rectangle
from ancf.feature import (
    ROUND_OFF,
    Feature,
    depth_at,
    dividing_lines,
    faces,
    key,
    relevant,
    scale,
    thickness_range,
)
from ancf.image import Image
from ancf.nurbs import curve_derivatives
from ancf.outlined import Outlined
from ancf.quadrature import NO_PROMISE, Rule, gauss, join, onto_cell, tensor
from ancf.recombination import fewer

GRADING, GRADED = 0.25, 12  # ratio and number of the lines graded toward a knot of a section
LINEAR = 2  # points through the thickness that integrate the mass of a field linear in z
VARIES = 4.0  # by exp(4) over an element: what sparing rules suppose of the fields inside
NUDGE = 1e-9  # of a cell's side: how far beside a line a face there is looked at

__all__ = ["BOTTOM", "GROOVE", "PROTRUSION", "TOP", "Band", "Cell", "Feature", "Outlined", "thickness_range"]


@dataclass(frozen=True, eq=False)
class _Axis:
    """One axis of a cell, or one interval of it: where it is integrated, and what the b bands do there.

    rule: q points in 1-D. inside (b, q): whether a point lies within the band's limits on this
    axis. depth (b, q): depth of the section of a band that this axis crosses, 0 for the others.
    """

    rule: Rule
    inside: np.ndarray
    depth: np.ndarray


def division(cell: Cell, bands: Sequence[Feature]) -> tuple[np.ndarray, np.ndarray]:
    """Lines x and lines y that divide the cell: its sides, and the edges, ends and knots of the bands.

    Of what has an outline its least and greatest coordinates. Lines within round-off of a side or of each other are
    one line.
    """
    touching = relevant(cell, bands)
    return dividing_lines(cell, touching, 0), dividing_lines(cell, touching, 1)


def division_of_side(cell: Cell, bands: Sequence[Feature], axis: int, at: float) -> tuple[np.ndarray, float]:
    """Lines that divide a cell's side, on which the coordinate `axis` is `at`, and a coordinate just inside it.

    Besides those of `division` the places where outlines meet the side.
    """
    touching, (low, high) = relevant(cell, bands), cell[axis]
    beside = at + NUDGE * (high - low) * (1 if 2 * at < low + high else -1)
    lines = [*dividing_lines(cell, touching, 1 - axis)]
    for band in touching:
        if isinstance(band, Outlined):
            lines += _places(band, axis, beside)
    first, last = cell[1 - axis]
    return np.unique(np.clip(lines, first, last)), beside


def _places(band: Outlined, axis: int, at: float) -> list[float]:
    """Where an outline meets the line on which the coordinate `axis` is `at`, by the other coordinate."""
    if axis == 0:
        return [float(arc.y(np.array(at))) for arc in band.arcs if arc.x0 <= at < arc.x1]
    return [float(x) for arc in band.arcs if arc.low <= at <= arc.high for x in arc.meets(0.0, 1.0, at)]


def signature(cell: Cell, bands: Sequence[Feature]) -> tuple:
    """Hashable key: cells with equal keys have the same rule up to a shift of their origins (x0, y0).

    It holds the cell's size and what the cell sees of each band, relative to its own origin and size.
    """
    return imaged(cell, relevant(cell, bands), None)


def imaged(cell: Cell, seen: Sequence[Feature], image: Image | None) -> tuple:
    """The signature that an image of the cell has; seen: the bands that the cell sees, which must have images."""
    sizes = tuple(float(f"{high - low:.11e}") for low, high in cell)
    keys = [key(cell, band, image) for band in seen]
    turned = sizes[::-1] if image is not None and image.swaps else sizes
    return turned, *(sorted(keys, key=repr) if len(keys) > 1 else keys)


def element_rule(
    cell: Cell,
    bands: Sequence[Feature],
    thickness: float,
    points: tuple[int, int, int],
    integration: Literal["subdomain", "sparing", "global"] = "subdomain",
    levels: Sequence[float] = (),
    through: bool = False,
) -> Rule:
    """Rule over the material of one element: points (q, 3), weights (q,).

    points: Gauss points along x, y, z in each subdomain (Eq. 8), or in the whole element with
    integration "global" (Eq. 7); with "sparing" those of a whole element, and in a narrower subdomain the
    fewest that err no more there (see `sparing`). z follows the kept thickness at each (x, y), divided at
    the increasing `levels` of z with as many points in each part; through: "sparing" holds for these parts too, which
    strains that are not smooth in z, as enhanced ones, do not admit. A curved section is integrated over its own
    parameter, dy = y'(u) du, between its knots, so that a vertical tangent costs no accuracy. Where an outline cuts the
    element, a polynomial of degree 2 points - 1 in each coordinate is integrated as well as in a whole element. Raises
    GeometryError where a band leaves no material.
    """
    touching = relevant(cell, bands)
    if integration == "global" and touching:
        plane = onto_cell(tensor(*map(gauss, points[:2])), cell)
        z_min, z_max = thickness_range(touching, thickness, *plane.points.T)
        return through_thickness(replace(plane, degree=NO_PROMISE), z_min, z_max, points[2], levels)
    if not touching and not levels:
        return onto_cell(tensor(*map(gauss, points)), (*cell, (-thickness / 2, thickness / 2)))
    spare = integration == "sparing"
    plane, z_min, z_max = _plane(cell, touching, thickness, points, thin=True, spare=spare)
    of_whole = thickness if spare and through and levels else None
    return through_thickness(plane, z_min, z_max, points[2], levels, of_whole)


def face_rule(
    cell: Cell, bands: Sequence[Feature], thickness: float, points: tuple[int, int], face: int
) -> tuple[Rule, np.ndarray]:
    """Rule in (x, y) over a cell, points (q, 2) and weights dx dy (q,), and the z (q,) of the true face there.

    It is fitted to the edges of bands and outlines, `points` along x and y in each subdomain; where a groove's floor
    is the face, z is its floor. face: BOTTOM or TOP.
    """
    plane, *z = _plane(cell, relevant(cell, bands), thickness, (*points, 1))
    return plane, np.broadcast_to(z[0] if face == BOTTOM else z[1], plane.weights.shape)


def through_thickness(
    plane: Rule,
    z_min: np.ndarray,
    z_max: np.ndarray,
    count: int,
    levels: Sequence[float] = (),
    thickness: float | None = None,
) -> Rule:
    """Rule in (x, y, z): columns over the points of `plane`, from their z_min to their z_max (q,).

    `count` Gauss points in each part of a column between the increasing levels; with a thickness, of which `count` are
    for the whole, the fewest that err no more in a part (see `sparing`).
    """
    faces = [z_min, *(np.clip(level, z_min, z_max) for level in levels), z_max]
    faces = np.stack([np.broadcast_to(z, plane.weights.shape) for z in faces])
    z, weights, degree = [], [], plane.degree
    for low, half in zip(faces[:-1], np.diff(faces, axis=0) / 2, strict=True):
        if half.max() <= 0:
            continue
        line = gauss(count if thickness is None else _few(float(2 * half.max() / thickness), count))
        z.append(low[:, None] + half[:, None] * (1 + line.points[:, 0]))
        weights.append((plane.weights * half)[:, None] * line.weights)
        degree = min(degree, line.degree)
    z, weights = np.hstack(z), np.hstack(weights)
    some = (weights != 0).ravel()
    points = np.column_stack([np.repeat(plane.points, z.shape[1], axis=0), z.ravel()])
    return Rule(points[some], weights.ravel()[some], degree)


def _few(share: float, count: int) -> int:
    """Points for a part of the thickness between levels: `sparing`, but those that the mass needs."""
    return min(count, max(LINEAR, sparing(min(1.0, share), count)))


@cache
def sparing(share: float, count: int) -> int:
    """Gauss points for a part `share` of an element's width that err no more there than `count` points in all of it.

    By the error term of Gauss's rule, f^(2n + 1) (n!)^4 / ((2n + 1) (2n)!^3) times the 2n-th derivative, of fields
    that vary like exp(VARIES s) over the width.

    >>> [sparing(share, 4) for share in (1.0, 0.5, 0.2, 0.03)]
    [4, 3, 2, 1]
    """

    def error(n: int, f: float) -> float:
        factorials = 4 * lgamma(n + 1) - 3 * lgamma(2 * n + 1)  # in logarithms, for any number of points
        return log(f) + 2 * n * log(VARIES * f) + factorials - log(2 * n + 1)

    return next(n for n in range(1, count + 1) if n == count or error(n, share) <= error(count, 1.0))


def _plane(
    cell: Cell, touching: Sequence[Feature], thickness: float, points, thin: bool = False, spare: bool = False
) -> tuple:
    """Rule in (x, y) fitted to what touches a cell, and z_min and z_max (q,) there. thin: see `_thinned`."""
    if not touching:
        return onto_cell(tensor(*map(gauss, points[:2])), cell), -thickness / 2, thickness / 2
    if any(isinstance(band, Outlined) for band in touching):
        return _cut_plane(cell, touching, thickness, points, thin)
    x, y = (_divided_axis(cell, touching, axis, points[axis], spare) for axis in (0, 1))
    count = len(touching)
    covers = (x.inside[:, :, None] & y.inside[:, None, :]).reshape(count, -1)
    depths = (x.depth[:, :, None] + y.depth[:, None, :]).reshape(count, -1)
    return tensor(x.rule, y.rule), *faces(touching, thickness, covers, depths)


def _cut_plane(cell: Cell, touching: Sequence[Feature], thickness: float, points, thin: bool) -> tuple:
    """As `_plane`, where outlines cut the cell."""
    parts = regions(cell, touching)
    varying = [callable(part.depth) for part in parts]
    found = cut(cell, parts, (*points[:2], min(points[2], LINEAR)))
    depths = [
        depth_at(band, *found.points.T) if varies else part.depth
        for band, part, varies in zip(touching, parts, varying, strict=True)
    ]
    heights = faces(touching, thickness, found.inside, depths)
    z_min, z_max = (np.broadcast_to(z, found.weights.shape) for z in heights)
    exact = not any(varying) and all(arc.degree <= 1 for part in parts for arc in part.arcs)
    plane = Rule(found.points, found.weights, 2 * min(points[:2]) - 1 if exact else NO_PROMISE)
    if thin and not any(isinstance(band, Band) and band.is_curved for band in touching):
        marks = found.inside if any(varying) else np.stack([z_min, z_max])
        kept, weights = _thinned(found, parts, marks, points)
        return Rule(plane.points[kept], weights, plane.degree), z_min[kept], z_max[kept]
    return plane, z_min, z_max


def _thinned(found: Cut, parts: Sequence[Region], marks: np.ndarray, points) -> tuple[np.ndarray, np.ndarray]:
    """Numbers and new weights of the fewest points that integrate the same polynomials over each part of the cell.

    marks (k, q): what tells one part from another. Regions without depth only divide the cell. Where depths vary they
    are polynomials between their knots, and what they bring to the degree is kept.
    """
    marks = [*marks, *(row for row, part in zip(found.inside, parts, strict=True) if part.depth == 0)]
    marks += [
        np.searchsorted(part.lines[k], found.points[:, k]) for part in parts for k in (0, 1) if len(part.lines[k])
    ]
    _, part_of = np.unique(np.array(marks), axis=1, return_inverse=True)
    deep = [max((part.degree[k] for part in parts if callable(part.depth)), default=0) for k in (0, 1)]
    degree = tuple(2 * (points[k] + min(points[2], LINEAR) * deep[k]) - 1 for k in (0, 1))
    kept, weights = [], []
    for k in range(part_of.max() + 1):
        own = np.flatnonzero(part_of == k)
        some, new = fewer(found.points[own], found.weights[own], degree)
        kept.append(own[some])
        weights.append(new)
    return np.concatenate(kept), np.concatenate(weights)


def regions(cell: Cell, bands: Sequence[Feature]) -> list[Region]:
    """What touches a cut cell, as `ancf.cut` knows it."""
    return [_region(cell, band) for band in bands]


def _region(cell: Cell, band: Feature) -> Region:
    """A band as a rectangle that ends one cell's size beyond the cell, an outline as it is."""
    if isinstance(band, Outlined):
        return band.region
    limits = []
    for axis, (low, high) in enumerate(cell):
        first, last = band.limits(axis)
        limits.append((max(first, 2 * low - high), min(last, 2 * high - low)))
    if not band.is_curved:
        return Region(*rectangle(*limits), band.section)
    lines: list[Sequence[float]] = [(), ()]
    lines[band.across] = _graded(curve_derivatives(band.section, band.section.breaks)[0][:, 0])
    degree = [0, 0]
    degree[band.across] = band.section.degree
    return Region(
        *rectangle(*limits), lambda x, y: section_depth(band, (x, y)[band.across]), tuple(lines), tuple(degree)
    )


def _graded(breaks: np.ndarray) -> list[float]:
    """Knots of a section and lines ever nearer to them, where its depth may have a vertical tangent."""
    lines = []
    for low, high in pairwise(np.unique(breaks)):
        steps = (high - low) * GRADING ** np.arange(1, GRADED)
        lines += [low, *(low + steps), *(high - steps), high]
    return lines


def _divided_axis(cell: Cell, bands: Sequence[Band], axis: int, count: int, spare: bool) -> _Axis:
    """One axis of the cell with `count` points in each of its intervals, or fewer in narrow ones to spare some."""
    tolerance, width = ROUND_OFF * scale(cell, bands), np.ptp(cell[axis])
    parts = []
    for low, high in pairwise(dividing_lines(cell, bands, axis)):
        some = count
        if spare:
            few = sparing(float((high - low) / width), count)
            some = min(count, max(few, _needed(bands, axis, (low + high) / 2)))
        parts.append(_interval(low, high, bands, axis, some, tolerance))
    inside, depth = (np.concatenate([getattr(part, name) for part in parts], axis=1) for name in ("inside", "depth"))
    return _Axis(join(*(part.rule for part in parts)), inside, depth)


def _needed(bands: Sequence[Band], axis: int, at: float) -> int:
    """Points on an axis that integrate z^2 between faces which are polynomials there, as sections of bands are."""
    crossing = [band for band in bands if band.is_curved and band.across == axis]
    degrees = [band.section.degree for band in crossing if band.limits(axis)[0] < at < band.limits(axis)[1]]
    return (3 * max(degrees, default=0)) // 2 + 1


def _interval(low: float, high: float, bands: Sequence[Band], axis: int, count: int, tolerance: float) -> _Axis:
    """One interval of an axis; where a curved section crosses it, its points are spaced in the section's parameter.

    Of two curved sections, one on each face, the one that needs it more leads.
    """
    middle = (low + high) / 2
    inside = [band.limits(axis)[0] < middle < band.limits(axis)[1] for band in bands]
    crossed = [here and band.across == axis for here, band in zip(inside, bands, strict=True)]
    curved = {
        b: along_curve(band.section, low, high, count, tolerance)
        for b, band in enumerate(bands)
        if crossed[b] and band.is_curved
    }
    depth = np.zeros((len(bands), count))
    if curved:
        leading = min(curved, key=lambda b: evenness(curved[b][0]))
        rule, depth[leading] = curved.pop(leading)
        crossed[leading] = False
    else:
        rule = onto_cell(gauss(count), [(low, high)])
    for b, band in enumerate(bands):
        if crossed[b]:
            depth[b] = section_depth(band, rule.points[:, 0])
    return _Axis(rule, np.repeat(np.array(inside)[:, None], count, axis=1), depth)
