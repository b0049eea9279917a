"""The grooved solid, built by gmsh's OCC kernel in the box of reference coordinates.

The box has the axes (x, y, z) of the plate, x and y scaled to metres where the mid-surface is a
NURBS patch or a revolved section. Grooves are cut from it, protrusions fused to it, load and probe regions and
through-thickness lines imprinted, so that whole tetrahedra fill each region and whole edges each
line. gmsh is imported only when a session begins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType

import numpy as np
from scipy.interpolate import BSpline

Interval = tuple[float, float]
Place = tuple[float, float, float]
SAME = 1e-7  # of a length: what is nearer is the same place


class MeshError(RuntimeError):
    """A solid or mesh that cannot be built; `status` is its short name."""

    def __init__(self, status: str, message: str):
        super().__init__(message)
        self.status = status


@dataclass(frozen=True)
class Curve:
    """NURBS section of a band (paper Eq. 3): points (n, 2) = (across, depth), weights (n,), flat knots."""

    degree: int
    points: np.ndarray
    weights: np.ndarray
    knots: np.ndarray


@dataclass(frozen=True)
class Band:
    """A straight band on one face: side -1 bottom or +1 top; axis 0 runs along x, 1 along y.

    across and along are its ranges in metres of the box. `section` is a constant depth (m) or a Curve.
    """

    side: int
    axis: int
    across: Interval
    along: Interval
    section: float | Curve

    @property
    def depth(self) -> float:
        """Greatest depth of the section's control points (m), a bound of the true depth."""
        return float(self.section.points[:, 1].max()) if isinstance(self.section, Curve) else self.section


def _between_creases(knots: np.ndarray, degree: int) -> list[tuple[slice, np.ndarray]]:
    """Control points and flat knots of the parts of a B-spline between knots of full multiplicity."""
    distinct, counts = np.unique(knots, return_counts=True)
    found = []
    for low, high in pairwise(distinct[counts >= degree]):
        first = int(np.searchsorted(knots, low, side="right")) - degree - 1
        last = int(np.searchsorted(knots, high)) - 1
        inner = knots[(knots > low) & (knots < high)]
        own = np.concatenate([[low] * (degree + 1), inner, [high] * (degree + 1)])
        found.append((slice(first, last + 1), own))
    return found


@dataclass(frozen=True)
class Floor:
    """A depth over the box: a B-spline surface of a degree and flat knots in x and y (m), depths (n, m) in m."""

    degree: tuple[int, int]
    knots: tuple[np.ndarray, np.ndarray]
    depths: np.ndarray

    def pieces(self) -> list[Floor]:
        """The parts between lines at which it has a crease: OCC wants them apart."""
        along = [_between_creases(knots, p) for knots, p in zip(self.knots, self.degree, strict=True)]
        return [Floor(self.degree, (u, v), self.depths[i, j]) for i, u in along[0] for j, v in along[1]]


@dataclass(frozen=True)
class Outlined:
    """What a closed curve (x, y) bounds on one face: side -1 bottom or +1 top; a constant depth (m) or a Floor."""

    side: int
    outline: Curve
    bottom: float | Floor

    @property
    def depth(self) -> float:
        """Greatest depth (m), or a bound of it."""
        return float(self.bottom.depths.max()) if isinstance(self.bottom, Floor) else self.bottom

    @property
    def is_straight(self) -> bool:
        """Whether all its edges and its bottom are."""
        return self.outline.degree == 1 and not isinstance(self.bottom, Floor)

    @property
    def section(self) -> float | Curve:
        """What a Band has: a curve where anything is curved."""
        return self.depth if self.is_straight else self.outline

    def corners(self) -> np.ndarray:
        """First control points (k, 2) of its pieces."""
        return np.array([points[0] for points, _, _ in self.pieces()])

    def pieces(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Control points, weights and flat knots of the parts between knots, where OCC integrates best."""
        curve, p = self.outline, self.outline.degree
        spline = BSpline(curve.knots, np.column_stack([curve.points * curve.weights[:, None], curve.weights]), p)
        for knot in np.unique(curve.knots)[1:-1]:
            if missing := p - np.count_nonzero(curve.knots == knot):
                spline = spline.insert_knot(knot, missing)
        points, weights = spline.c[:, :2] / spline.c[:, 2:], spline.c[:, 2]
        return [(points[own], weights[own], knots) for own, knots in _between_creases(spline.t, p)]


Feature = Band | Outlined


@dataclass(frozen=True)
class Plate:
    """The solid in box coordinates (m): 0 <= x <= length, 0 <= y <= width, |z| <= thickness / 2.

    regions ((x0, x1), (y0, y1)), lines (x, y) through the thickness, and marks are imprinted: straight lines
    ((x, y, z), (x, y, z)), points where both ends are one. closed: the faces x = 0 and x = length are one seam.
    """

    length: float
    width: float
    thickness: float
    grooves: tuple[Feature, ...] = ()
    protrusions: tuple[Feature, ...] = ()
    regions: tuple[tuple[Interval, Interval], ...] = ()
    lines: tuple[tuple[float, float], ...] = ()
    marks: tuple[tuple[Place, Place], ...] = ()
    closed: bool = False


@contextmanager
def session() -> Iterator[ModuleType]:
    """gmsh, silent, in a fresh model of its own; closed again at the end. Raises MeshError "gmsh_missing"."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MeshError("gmsh_missing", f"gmsh cannot be loaded: {error}") from error
    if gmsh.isInitialized():
        raise MeshError("gmsh_busy", "gmsh is already in use in this process")
    gmsh.initialize(["groovecheck"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add("plate")
        yield gmsh
    finally:
        gmsh.finalize()


def moments(gmsh: ModuleType, plate: Plate) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume (m3), centroid (3,) and inertia about it (3, 3) in m5 of the solid in the box, by OCC.

    Raises MeshError "geometry_failed" as `build` does.
    """
    occ = gmsh.model.occ
    try:
        body = _one_body(gmsh, plate)
    except MeshError:
        raise
    except Exception as error:
        raise MeshError("geometry_failed", f"OCC: {error}") from error
    inertia = np.array(occ.getMatrixOfInertia(*body)).reshape(3, 3)
    return occ.getMass(*body), np.array(occ.getCenterOfMass(*body)), inertia


def _one_body(gmsh: ModuleType, plate: Plate) -> tuple[int, int]:
    bodies = _solid(gmsh, plate)
    if len(bodies) != 1:
        raise MeshError("geometry_failed", f"the grooves leave {len(bodies)} separate bodies, not one")
    return bodies[0]


def build(gmsh: ModuleType, plate: Plate) -> float:
    """Build the plate in gmsh's current model; returns the exact volume (m3) of the solid in the box.

    Raises MeshError "geometry_failed" where OCC fails or the solid falls apart.
    """
    try:
        body = _one_body(gmsh, plate)
        volume = gmsh.model.occ.getMass(*body)
        bodies = _imprint(gmsh, plate, [body])
        gmsh.model.occ.synchronize()
    except MeshError:
        raise
    except Exception as error:
        raise MeshError("geometry_failed", f"OCC: {error}") from error
    imprinted = sum(gmsh.model.occ.getMass(*body) for body in bodies)
    if not math.isclose(imprinted, volume, rel_tol=1e-9):
        raise MeshError("geometry_failed", f"volume {volume} became {imprinted} by imprinting")
    return volume


def _solid(gmsh: ModuleType, plate: Plate) -> list[tuple[int, int]]:
    """The box with its protrusions and without its grooves, as (dimension, tag) pairs."""
    occ = gmsh.model.occ
    half = plate.thickness / 2
    bodies = [(3, occ.addBox(0, 0, -half, plate.length, plate.width, plate.thickness))]
    if plate.protrusions:
        tools = [tool for feature in plate.protrusions for tool in _tools(gmsh, plate, feature, outward=True)]
        bodies, _ = occ.fuse(bodies, tools)
    if plate.grooves:
        tools = [tool for feature in plate.grooves for tool in _tools(gmsh, plate, feature, outward=False)]
        bodies, _ = occ.cut(bodies, tools)
    return [body for body in bodies if body[0] == 3]


def _tools(gmsh: ModuleType, plate: Plate, feature: Feature, outward: bool) -> list[tuple[int, int]]:
    """What a groove removes or a protrusion adds, reaching across the plate's face so that no face of it lies there."""
    if isinstance(feature, Band):
        return [_prism(gmsh, plate, feature, outward)]
    occ, root = gmsh.model.occ, plate.thickness / 4
    face, into = feature.side * plate.thickness / 2, feature.side if outward else -feature.side
    curved = isinstance(feature.bottom, Floor)
    reach = feature.depth + (root if curved else 0.0)
    loop = occ.addCurveLoop(_edges(gmsh, feature, face - into * root))
    swept = occ.extrude([(2, occ.addPlaneSurface([loop]))], 0, 0, into * (root + reach))
    tool = [part for part in swept if part[0] == 3]
    if curved:
        above = [_above(gmsh, piece, face, into, reach + 2 * root) for piece in feature.bottom.pieces()]
        tool = occ.intersect(tool, above)[0]
    if outward:
        box = occ.addBox(0, 0, -plate.thickness - reach, plate.length, plate.width, 2 * (plate.thickness + reach))
        tool = occ.intersect(tool, [(3, box)])[0]
    return [part for part in tool if part[0] == 3]


def _edges(gmsh: ModuleType, feature: Outlined, z: float) -> list[int]:
    """The outline as curves at a height, one for each of its parts without a corner inside."""
    occ, found = gmsh.model.occ, []
    corners = [occ.addPoint(*corner, z) for corner in feature.corners()]
    corners.append(corners[0] if len(corners) > 1 else occ.addPoint(*feature.corners()[0], z))
    for k, (points, weights, knots) in enumerate(feature.pieces()):
        ends = corners[k : k + 2]
        if feature.outline.degree == 1:
            found.append(occ.addLine(*ends))
        else:
            tags = [ends[0], *(occ.addPoint(*p, z) for p in points[1:-1]), ends[1]]
            found.append(_bspline(occ, tags, feature.outline.degree, weights, knots))
    return found


def _bspline(occ, tags: list[int], degree: int, weights: np.ndarray, knots: np.ndarray) -> int:
    return occ.addBSpline(tags, -1, degree, weights, *np.unique(knots, return_counts=True))


def _above(gmsh: ModuleType, floor: Floor, face: float, into: float, height: float) -> tuple[int, int]:
    """All on the plate's side of a floor, `height` high; with Greville abscissae x and y are its parameters."""
    occ = gmsh.model.occ
    x, y = (
        np.array([knots[i + 1 : i + p + 1].mean() for i in range(len(knots) - p - 1)])
        for knots, p in zip(floor.knots, floor.degree, strict=True)
    )
    z = face + into * floor.depths
    tags = [occ.addPoint(x[i], y[j], z[i, j]) for j in range(len(y)) for i in range(len(x))]
    (u, u_count), (v, v_count) = (np.unique(knots, return_counts=True) for knots in floor.knots)
    surface = occ.addBSplineSurface(tags, len(x), -1, *floor.degree, [], u, v, u_count, v_count)
    return next(part for part in occ.extrude([(2, surface)], 0, 0, -into * height) if part[0] == 3)


def _prism(gmsh: ModuleType, plate: Plate, band: Band, outward: bool) -> tuple[int, int]:
    """A band's section swept along it: what a groove removes (it sticks out of the face) or a
    protrusion adds (it reaches into the plate), so that no face of it lies in the plate's face."""
    occ = gmsh.model.occ
    root = plate.thickness / 4
    sign = band.side if outward else -band.side

    def at(across: float, depth: float) -> int:
        z = band.side * plate.thickness / 2 + sign * depth
        start = band.along[0]
        return occ.addPoint(*((start, across, z) if band.axis == 0 else (across, start, z)))

    first, last = at(band.across[0], -root), at(band.across[1], -root)
    if isinstance(band.section, Curve):
        points = [at(*point) for point in band.section.points]
        top, marks = _spline(gmsh, band.section, points)
    else:
        points = [at(band.across[0], band.section), at(band.across[1], band.section)]
        top, marks = occ.addLine(*points), []
    sides = [occ.addLine(first, points[0]), top, occ.addLine(points[-1], last), occ.addLine(last, first)]
    face = occ.addPlaneSurface([occ.addCurveLoop(sides)])
    if marks:
        face = occ.fragment([(2, face)], marks)[0][0][1]
    reach = band.along[1] - band.along[0]
    swept = occ.extrude([(2, face)], *((reach, 0, 0) if band.axis == 0 else (0, reach, 0)))
    return next(part for part in swept if part[0] == 3)


def _spline(gmsh: ModuleType, curve: Curve, points: list[int]) -> tuple[int, list[tuple[int, int]]]:
    """A section's curve, and points at its creases: splitting there keeps element edges from running across one."""
    occ = gmsh.model.occ
    knots, multiplicities = np.unique(curve.knots, return_counts=True)
    whole = occ.addBSpline(points, -1, curve.degree, curve.weights, knots, multiplicities)
    creases = knots[1:-1][multiplicities[1:-1] >= curve.degree]
    occ.synchronize()
    return whole, [(0, occ.addPoint(*gmsh.model.getValue(1, whole, [knot]))) for knot in creases]


def _imprint(gmsh: ModuleType, plate: Plate, bodies: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Cut the bodies along the sides of the regions and embed the lines; nothing is removed."""
    occ = gmsh.model.occ
    reach = 2 * plate.thickness + sum(band.depth for band in plate.protrusions)
    tools = []
    for (x0, x1), (y0, y1) in plate.regions:
        column = [(3, occ.addBox(x0, y0, -reach, x1 - x0, y1 - y0, 2 * reach))]
        tools += occ.intersect(bodies, column, removeObject=False, removeTool=True)[0]
    for x, y in [*plate.lines, *_beyond_seam(plate)]:
        line = [(1, occ.addLine(occ.addPoint(x, y, -reach), occ.addPoint(x, y, reach)))]
        tools += occ.intersect(line, bodies, removeObject=True, removeTool=False)[0]
    for start, end in plate.marks:
        ends = [occ.addPoint(*at) for at in dict.fromkeys((start, end))]
        mark = [(1, occ.addLine(*ends))] if len(ends) == 2 else [(0, ends[0])]
        tools += occ.intersect(mark, bodies, removeObject=True, removeTool=False)[0]
    tools = [tool for tool in tools if tool not in bodies]  # a region that holds the whole plate
    if tools:
        bodies, _ = occ.fragment(bodies, tools)
    return [body for body in dict.fromkeys(bodies) if body[0] == 3]


def _beyond_seam(plate: Plate) -> list[tuple[float, float]]:
    """Lines (x, y) that a region or a line at one end of a closed plate cuts into the face at its other end."""
    if not plate.closed:
        return []
    cuts = [(x, y) for (x0, x1), sides in plate.regions for x in (x0, x1) for y in sides]
    other = {False: plate.length, True: 0.0}
    near = SAME * plate.length
    return [(other[x > near], y) for x, y in [*cuts, *plate.lines] if x < near or x > plate.length - near]
