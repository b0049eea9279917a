"""What changes the thickness of a plate: bands and outlined features, what a cell sees of them, and what they leave."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ancf.band import BOTTOM, GROOVE, PROTRUSION, TOP, Band, Cell, Interval, section_depth, section_shape
from ancf.cut import relation
from ancf.image import Image
from ancf.nurbs import GeometryError, curve_derivatives
from ancf.outlined import Outlined

ROUND_OFF = 1e-12

Feature = Band | Outlined


def thickness_range(
    bands: Sequence[Feature], thickness: float, x: ArrayLike, y: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """z_min and z_max (m) of the material at the points (x, y), broadcast against each other.

    Of several grooves on one face the deepest counts, of several protrusions the highest; a groove
    cuts away all that lies above its floor, a protrusion too. Edges belong to their band. Raises
    GeometryError where nothing is left.
    """
    at = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    covered = [covers(band, *at) for band in bands]
    depths = [depth_at(band, *at) for band in bands]
    z_min, z_max = faces(bands, thickness, covered, depths)
    shape = np.broadcast_shapes(at[0].shape, at[1].shape)
    return np.broadcast_to(z_min, shape), np.broadcast_to(z_max, shape)


def faces(bands: Sequence[Feature], thickness: float, covers: Sequence, depths: Sequence) -> tuple:
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


def covers(band: Feature, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether points lie on the band."""
    if isinstance(band, Outlined):
        return band.covers(x, y)
    return _within(x, band.limits(0)) & _within(y, band.limits(1))


def depth_at(band: Feature, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Depth (m) of the band at points that it covers."""
    return band.depth_at(x, y) if isinstance(band, Outlined) else section_depth(band, (x, y)[band.across])


def depth_slopes(band: Feature, x: np.ndarray, y: np.ndarray, shift: float) -> np.ndarray:
    """Slopes (2, q) of the band's depth along x and y at points that it covers, by differences over `shift` on both
    sides of each as far as its depth is defined there."""
    slopes, at = np.zeros((2, len(x))), np.stack([x, y])
    for axis in _varies_along(band):
        ends = [at.copy(), at.copy()]
        for end, step in zip(ends, (-shift, shift), strict=True):
            end[axis] = np.clip(end[axis] + step, *_defined(band, axis))
        behind, ahead = ends
        slopes[axis] = (depth_at(band, *ahead) - depth_at(band, *behind)) / (ahead - behind)[axis]
    return slopes


def _varies_along(band: Feature) -> tuple[int, ...]:
    """The axes along which a band's depth is not constant."""
    if not band.is_curved:
        return ()
    return (0, 1) if isinstance(band, Outlined) else (band.across,)


def _defined(band: Feature, axis: int) -> Interval:
    """Where a depth that varies along an axis is defined."""
    if not isinstance(band, Outlined):
        return band.limits(axis)
    knots = band.depth.knots[axis]
    return float(knots[0]), float(knots[-1])


def relevant(cell: Cell, bands: Sequence[Feature]) -> list[Feature]:
    """What the cell sees of the bands; an outline around all of it makes a band without ends."""
    found: list[Feature] = []
    for band in bands:
        if not _touches(cell, band):
            continue
        if isinstance(band, Outlined):
            seen = relation(cell, *band.parts)
            if seen == "covers" and not band.is_curved:
                found.append(Band(band.face, band.sign, 0, (-np.inf, np.inf), band.depth))
            elif seen != "outside":
                found.append(band)
        else:
            found.append(band)
    return found


def _touches(cell: Cell, band: Feature) -> bool:
    """Whether the band, or the box of its outline, covers more of the cell than round-off."""
    tolerance = ROUND_OFF * scale(cell, [band])
    overlaps = ((cell[a], band.limits(a)) for a in (0, 1))
    return all(min(c[1], b[1]) - max(c[0], b[0]) > tolerance for c, b in overlaps)


def dividing_lines(cell: Cell, bands: Sequence[Feature], axis: int) -> np.ndarray:
    """Sorted distinct lines of one axis from side to side of the cell."""
    low, high = cell[axis]
    tolerance = ROUND_OFF * scale(cell, bands)
    candidates = [line for band in bands for line in _own_lines(band, axis)]
    lines = [low]
    for line in sorted(line for line in candidates if line < high - tolerance):
        if line > lines[-1] + tolerance:
            lines.append(line)
    return np.array([*lines, high])


def _own_lines(band: Feature, axis: int) -> list[float]:
    """Edges and knots of a band on one axis."""
    if isinstance(band, Outlined):
        return [*band.limits(axis), *band.lines(axis)]
    if axis == band.across and band.is_curved:
        return curve_derivatives(band.section, band.section.breaks)[0][:, 0].tolist()
    return list(band.limits(axis))


def key(cell: Cell, band: Feature, image: Image | None = None) -> tuple:
    """What a cell, or its image, sees of a band; only bands of constant depth have images."""
    if isinstance(band, Outlined):
        (x0, x1), (y0, y1) = cell
        return band.face, band.sign, band.shape((x0, y0), max(x1 - x0, y1 - y0))
    seen, along = (_seen(cell, band, 0), _seen(cell, band, 1)), band.along
    if image is not None:
        seen, along = image.ranges(seen), 1 - along if image.swaps else along
    rounded = ((round(low, 11), round(high, 11)) for low, high in seen)
    return band.face, band.sign, along, section_shape(band.section), *rounded


def has_images(band: Feature) -> bool:
    """Whether `key` knows what an image of a cell sees of the band."""
    return isinstance(band, Band) and not band.is_curved


def _seen(cell: Cell, band: Band, axis: int) -> Interval:
    """A band's limits in units of the cell, clipped to it unless they place a curved section."""
    low, high = cell[axis]
    first, last = ((limit - low) / (high - low) for limit in band.limits(axis))
    if band.is_curved and axis == band.across:
        return first, last
    return min(max(first, 0.0), 1.0), min(max(last, 0.0), 1.0)


def scale(cell: Cell, bands: Sequence[Feature]) -> float:
    """Largest finite coordinate: what round-off is measured against."""
    values = [*cell[0], *cell[1], *(v for band in bands for axis in (0, 1) for v in band.limits(axis))]
    return max(abs(value) for value in values if math.isfinite(value))


def _within(values: np.ndarray, limits: Interval) -> np.ndarray:
    return (values >= limits[0]) & (values <= limits[1])
