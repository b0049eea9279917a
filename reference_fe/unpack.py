"""Scene -> Plate, Spacing, Model: the words of a scene turned into numbers, before anything is solved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import BSpline

from compare.scene import Feature as SceneFeature
from compare.scene import Profile, Scene, Section
from reference_fe.elasticity import Lame, Pattern, lame, pattern, scalar_mass, tabulate
from reference_fe.geometry import SAME, Band, Curve, Feature, Floor, Interval, Outlined, Place, Plate
from reference_fe.loads import Load, Moment, face_share, line_share, load_at, pressure_force, region_share, slope_share
from reference_fe.mesh import Solid, Spacing
from reference_fe.newton import Memory
from reference_fe.pressure import FollowerPressure, follower_pressure
from reference_fe.probes import point_slopes, point_weights
from reference_fe.rubber import MooneyRivlin, mooney_rivlin
from reference_fe.supports import held
from reference_fe.surface import Frame, Revolved, Surface, lengths
from reference_fe.system import System, assemble

EDGE_SAMPLES = 33
if TYPE_CHECKING:
    from reference_fe.rim import Rim

RATIO = 0.5  # edge length at sides and grooves over that elsewhere
RULE_DEGREE = 4  # 11 points: the least rule that integrates force and tangent exactly on straight tetrahedra


@dataclass(frozen=True)
class Model:
    """A scene on a mesh: the system, its factorisation memory, probe weights (n,) and initial velocity (f, 3).

    slopes: derivatives (3, n) by X, Y, Z of the functions at the points whose det F is asked for.
    """

    frame: Frame
    solid: Solid
    system: System
    memory: Memory
    probes: list[np.ndarray]
    slopes: list[np.ndarray]
    velocity: np.ndarray
    mass: float | None


def discretise(scene: Scene, frame: Frame, solid: Solid) -> Model:
    """Mass, pattern, loads, supports and probes of the scene on the mesh. Raises MeshError."""
    material = scene.material
    mass = None if material.density is None else scalar_mass(solid, material.density)
    fixed = np.zeros((solid.places.shape[1], 3), dtype=bool)
    for support in scene.supports:
        fixed |= held(solid, *_support(scene, frame, support))
    centre = _rim_centre(scene, frame, solid)
    acting = [_load(scene, frame, solid, load, mass, centre) for load in scene.loads]
    loads = load_at(tuple(load for load in acting if isinstance(load, Load)), fixed.shape)
    moments, pressures = (tuple(load for load in acting if isinstance(load, k)) for k in (Moment, FollowerPressure))
    probes = [_probe(frame, solid, probe) for probe in scene.probes]
    asked = [probe.at for probe in scene.probes if getattr(probe, "volume_ratio", False)]
    slopes = [point_slopes(solid, (*frame.place(at[:2]), at[2])) for at in asked]
    table = tabulate(solid, RULE_DEGREE)
    where = pattern(table.nodes, fixed.all(axis=1), [np.flatnonzero(moment.slope) for moment in moments])
    rim = _rim(scene, solid, where, centre, fixed)
    acting = loads, 1e-6 * solid.extent, fixed, moments, pressures, rim
    system = assemble(table, material_of(scene), where, mass, *acting)
    if scene.obstacles:
        from reference_fe.obstacles import contact_of

        system = replace(system, contact=contact_of(scene.obstacles, solid, where))
    velocity = np.where(fixed, 0.0, _velocity(scene, solid.mesh.doflocs.T))[where.free]
    velocity = velocity if rim is None else rim.placed(velocity, rim.stated(0.0)[1])
    total = None if mass is None else float(mass.sum())
    return Model(frame, solid, system, system.memory(), probes, slopes, velocity, total)


def _rim_centre(scene: Scene, frame: Frame, solid: Solid) -> np.ndarray | None:
    """Weights (n,) of the nodes whose mean is the rim's centre, None without a rim; its code is loaded only here."""
    if scene.rim is None:
        return None
    from reference_fe.rim import centre_of

    places = [(_edge(scene, frame, edge),) for edge in scene.rim.edges]
    on = np.any([held(solid, place, (0,))[:, 0] for place in places], axis=0)
    return centre_of(on, solid.mesh.doflocs.T, np.array(scene.rim.spin))


def _rim(scene: Scene, solid: Solid, where: Pattern, centre: np.ndarray | None, fixed: np.ndarray) -> Rim | None:
    if centre is None:
        return None
    from reference_fe.rim import rim

    own = scene.rim
    motion = {"displacement": np.array(own.displacement), "history": np.array(own.history), "spin": np.array(own.spin)}
    stated = {"free": tuple("XYZ".index(component) for component in own.free), "mass": own.mass, **motion}
    return rim(where, centre, fixed, solid.mesh.doflocs.T, stated)


def material_of(scene: Scene) -> Lame | MooneyRivlin:
    """The scene's law."""
    stated = scene.material
    if stated.kind == "svk":
        return lame(stated.youngs_modulus, stated.poissons_ratio)
    return mooney_rivlin(stated.mu10, stated.mu01, stated.bulk_modulus)


def mid_surface(scene: Scene) -> tuple[Frame, Surface | Revolved | None]:
    """Where the parameters lie in the box, and the curved mid-surface (None where it is a rectangle)."""
    stated, origin = scene.surface, tuple(span[0] for span in scene.surface.span)
    if stated.kind == "rectangle":
        return Frame(origin), None
    if stated.kind == "revolved":
        surface = Revolved("XYZ".index(stated.axis), stated.angle, _curve(stated.section))
    else:
        points = np.array(stated.control_points)
        weights = np.ones(points.shape[:2]) if stated.weights is None else np.array(stated.weights)
        surface = Surface(stated.degree, tuple(np.array(knots) for knots in stated.knots), points, weights)
    frame = Frame(origin, lengths(surface))
    return frame, replace(surface, frame=frame)


def _curve(stated: Profile | Section) -> Curve:
    """A curve of the scene, in its own coordinates."""
    points = np.array(stated.control_points)
    weights = np.ones(len(points)) if stated.weights is None else np.array(stated.weights)
    return Curve(stated.degree, points, weights, np.array(stated.knots))


def plate_of(scene: Scene, frame: Frame, surface: Surface | Revolved | None) -> Plate:
    """The scene's solid in the box; creases of the surface are imprinted as regions too."""
    (_, length), (_, width) = frame.region(scene.surface.span)
    regions = [frame.region(load.region) for load in scene.loads if load.kind == "patch"]
    regions += [frame.region(probe.region) for probe in scene.probes if hasattr(probe, "region")]
    if surface is not None:
        regions += [((0.0, x), (0.0, width)) for x in surface.creases(0)]
        regions += [((0.0, length), (0.0, y)) for y in surface.creases(1)]
    lines = [_loaded(scene, frame, load.at) for load in scene.loads if load.kind == "point"]
    return Plate(
        length,
        width,
        scene.thickness,
        tuple(_band(scene, frame, band) for band in scene.grooves),
        tuple(_band(scene, frame, band) for band in scene.protrusions),
        tuple(dict.fromkeys(regions)),
        tuple(dict.fromkeys(lines)),
        tuple(_mark(scene, frame, support) for support in scene.supports if _is_inside(scene, support)),
        scene.surface.closed,
    )


def _edge(scene: Scene, frame: Frame, edge: str) -> tuple[int, float]:
    """Axis and box coordinate of an edge."""
    axis, end = "xy".index(edge[0]), int(edge[1])
    return axis, frame.interval(axis, scene.surface.span[axis])[end]


def _support(scene: Scene, frame: Frame, support) -> tuple[tuple[tuple[int, float], ...], tuple[int, ...]]:
    """Place in the box, as pairs (axis, value), and held components of a support."""
    name = getattr(support, "corner", None) or support.edge or ""
    place = tuple(_edge(scene, frame, name[i : i + 2]) for i in range(0, len(name), 2))
    if support.kind == "clamp":
        return place, (0, 1, 2)
    if support.kind == "symmetry":
        return place, ("XYZ".index(support.normal),)
    heights = {"face": (), "middle": (0.0,), "bottom": (-scene.thickness / 2,), "top": (scene.thickness / 2,)}
    place += tuple((2, z) for z in heights[support.over])
    return place, tuple("XYZ".index(component) for component in support.components)


def _is_inside(scene: Scene, support) -> bool:
    """Whether the line or point that a support holds may lie inside a face of the solid: a protrusion may cover it."""
    over = getattr(support, "over", "face")
    return over == "middle" or any(band.face == over for band in scene.protrusions)


def _mark(scene: Scene, frame: Frame, support) -> tuple[Place, Place]:
    """Ends, in the box, of the line or point that a support holds."""
    sides = dict(_support(scene, frame, support)[0])
    spans = [frame.interval(axis, span) for axis, span in enumerate(scene.surface.span)]
    return tuple((*(sides.get(axis, spans[axis][end]) for axis in (0, 1)), sides[2]) for end in (0, 1))


def _band(scene: Scene, frame: Frame, band: SceneFeature) -> Feature:
    """A groove or protrusion in the box."""
    if hasattr(band, "outline"):
        return _outlined(frame, band)
    axis = "xy".index(band.along)
    section = band.depth
    if band.profile is not None:
        section = _curve(band.profile)
        section.points[:, 0] = frame.interval(1 - axis, section.points[:, 0])
    return Band(
        side=-1 if band.face == "bottom" else 1,
        axis=axis,
        across=frame.interval(1 - axis, band.edges),
        along=frame.interval(axis, band.extent or scene.surface.span[axis]),
        section=section,
    )


def _outlined(frame: Frame, shape: SceneFeature) -> Outlined:
    """What has an outline, in the box."""
    loop, surface = shape.outline, shape.depth_surface
    points = np.column_stack([frame.interval(k, np.array(loop.control_points)[:, k]) for k in (0, 1)])
    weights = np.ones(len(points)) if loop.weights is None else np.array(loop.weights)
    outline = Curve(loop.degree, points, weights, np.array(loop.knots))
    bottom = shape.depth
    if surface is not None:
        knots = tuple(np.array(frame.interval(k, np.array(surface.knots[k]))) for k in (0, 1))
        bottom = Floor(surface.degree, knots, np.array(surface.depths))
    return Outlined(-1 if shape.face == "bottom" else 1, outline, bottom)


def spacing_of(plate: Plate, size: float) -> Spacing:
    """Grading toward the plate's sides, grooves and loads by fixed ratios: all edges scale with `size` where no curve
    asks for shorter ones (`mesh.EDGES_PER_TURN`).

    Twist is carried by shear within about one thickness of each side (Kirchhoff's corner forces), and
    the stress is singular at the clamp and at the re-entrant edges of a groove; so the edges are half
    as long there, growing linearly over one thickness.
    """
    reach, half = plate.thickness, plate.thickness / 2
    x, y, z = (0.0, plate.length), (0.0, plate.width), (-half, half)
    places = [(x, (0.0, 0.0), z), (x, y[1:] * 2, z)]
    if not plate.closed:
        places += [((0.0, 0.0), y, z), (x[1:] * 2, y, z)]
    edges = []
    for band, cut in [(b, True) for b in plate.grooves] + [(b, False) for b in plate.protrusions]:
        if isinstance(band, Outlined):
            points = _edge_points(plate, band, half - band.depth if cut else half, reach / 4)
            edges += [(RATIO, reach, points)] if len(points) else []
        else:
            places += _feet(band, half, cut)
    return Spacing(size, tuple((RATIO, reach, *place) for place in places), tuple(edges))


def _edge_points(plate: Plate, shape: Outlined, height: float, apart: float) -> np.ndarray:
    """Points (k, 3) along an outline's re-entrant edge on the plate, at most `apart` from each other."""
    points = np.vstack([_along(*piece, shape.outline.degree) for piece in shape.pieces()])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    place = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, place[-1], int(np.ceil(place[-1] / apart)) + 1)
    xy = np.column_stack([np.interp(at, place, points[:, k]) for k in (0, 1)])
    xy = xy[np.all((xy >= 0) & (xy <= (plate.length, plate.width)), axis=1)]
    return np.column_stack([xy, np.full(len(xy), shape.side * height)])


def _along(points: np.ndarray, weights: np.ndarray, knots: np.ndarray, degree: int) -> np.ndarray:
    """Points (k, 2) of a NURBS curve without corners."""
    spline = BSpline(knots, np.column_stack([points * weights[:, None], weights]), degree)
    values = spline(np.linspace(knots[0], knots[-1], 2 if degree == 1 else EDGE_SAMPLES))
    return values[:, :2] / values[:, 2:]


def _feet(band: Band, half: float, cut: bool) -> list[tuple[Interval, Interval, Interval]]:
    """Re-entrant edges of a band: on the floor of a groove, at the foot of a protrusion; all of a curved one."""
    face = band.side * half
    floor = face - band.side * band.depth if cut else face + band.side * band.depth
    if isinstance(band.section, Curve):
        lines = [(band.across, (min(floor, face), max(floor, face)))]
    else:
        lines = [((edge, edge), (floor, floor) if cut else (face, face)) for edge in band.across]
    return [(band.along, across, z) if band.axis == 0 else (across, band.along, z) for across, z in lines]


def _load(scene: Scene, frame: Frame, solid: Solid, load, mass, centre) -> Load | Moment | FollowerPressure:
    """A load of the scene on the nodes; centre (n,): weights of the rim's."""
    history = np.array(load.history)
    if load.kind == "pressure":
        side = -1 if load.face == "bottom" else 1
        if load.follower:
            return follower_pressure(solid, side, scene.thickness / 2, load.pressure, history)
        return Load(load.pressure * pressure_force(solid, side, scene.thickness / 2), history)
    if load.kind == "moment":
        slope = slope_share(solid, *_edge(scene, frame, load.edge))
        return Moment(slope, slope @ solid.mesh.doflocs.T, np.array(load.moment), history)
    if load.kind == "gravity":
        row = np.asarray(mass.sum(axis=1)).ravel()
        row = row if centre is None else row + scene.rim.mass * centre
        return Load(np.outer(row, load.acceleration), history)
    if load.kind == "axle":
        return Load(np.outer(centre, load.force), history)
    if load.kind == "point":
        share = line_share(solid, _loaded(scene, frame, load.at))
    elif load.kind == "edge":
        share = face_share(solid, *_edge(scene, frame, load.edge))
    else:
        share = region_share(solid, frame.region(load.region))
    return Load(np.outer(share, load.force), history)


def _loaded(scene: Scene, frame: Frame, at: Interval) -> Interval:
    """Place in the box of a point load; what is at the end of a full turn is at its start."""
    x, y = frame.place(at)
    (_, end), _ = frame.region(scene.surface.span)
    return (0.0, y) if scene.surface.closed and x > (1 - SAME) * end else (x, y)


def _probe(frame: Frame, solid: Solid, probe) -> np.ndarray:
    """Weights (n,) of a probe of the scene."""
    if hasattr(probe, "region"):
        return region_share(solid, frame.region(probe.region))
    return point_weights(solid, (*frame.place(probe.at[:2]), probe.at[2]))


def _velocity(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Initial velocity (n, 3) in m/s at points (n, 3)."""
    if scene.initial is None:
        return np.zeros_like(points)
    return np.array(scene.initial.velocity) + np.cross(scene.initial.angular_velocity, points)
