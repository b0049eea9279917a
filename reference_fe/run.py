"""solve(scene, level) -> Result: this file and words.py alone of this package know scenes.

Readings a solver must choose:
- A clamp holds all displacements of the edge's face. The normal gradient there stays free, as in any
  displacement-based solid, so both readings of `gradients` are the same here.
- A hold and a plane of symmetry hold components at the nodes of their place; their middle line or point is
  imprinted in the mesh. A moment turns with the best straight line through the edge's face along z.
- A point load is spread evenly over the line through the thickness at its (x, y), a patch load over
  the kept volume of its region; both are dead loads.
- An initial angular velocity turns about the origin of space.
- h is the level's size: every edge length that the mesh is asked for is a fixed multiple of it. The mean
  volume of the tetrahedra is no measure, because in a thin plate it falls with the square of the size.
- Modes are small vibrations about the undeformed solid. Rigid motions that the supports leave free are counted,
  not listed.
- Steps divide each output interval evenly and are never longer than the level's time step. With
  error_per_step they are halved and doubled between output times and the corners of the load histories.
- A point of law "points" is a node of the face. A resultant and a pressure at an output time are the law's at that
  instant; the motion feels their mean over each step (contact.py), which is what the energies count.
"""

from __future__ import annotations

import resource
import sys
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline

from compare.result import OK, Contact, Outline, Result, Shots
from compare.scene import Feature as SceneFeature
from compare.scene import Profile, ReferenceLevel, Scene, Section
from reference_fe import dynamics, statics
from reference_fe.elasticity import Lame, lame, pattern, scalar_mass, tabulate
from reference_fe.estimate import memory_mb, tetrahedra, unknowns
from reference_fe.geometry import Band, Curve, Feature, Floor, Interval, MeshError, Outlined, Plate
from reference_fe.loads import Load, Moment, face_share, line_share, load_at, pressure_force, region_share, slope_share
from reference_fe.mesh import Solid, Spacing, make, store
from reference_fe.modes import ModesFailure, vibration
from reference_fe.newton import Memory, NewtonFailure
from reference_fe.outline import surface_triangles
from reference_fe.pace import Pace, march
from reference_fe.pressure import FollowerPressure, follower_pressure
from reference_fe.probes import point_slopes, point_weights
from reference_fe.rubber import MooneyRivlin, mooney_rivlin
from reference_fe.supports import held
from reference_fe.surface import Frame, Revolved, Surface, lengths
from reference_fe.system import System, assemble
from reference_fe.words import has_gravity, words

Progress = Callable[[float], None]
EDGE_SAMPLES = 33
RATIO = 0.5  # edge length at sides and grooves over that elsewhere
RULE_DEGREE = 4  # 11 points: the least rule that integrates force and tangent exactly on straight tetrahedra


def solve(
    scene: Scene, level: ReferenceLevel, progress: Progress | None = None, mesh_folder: Path | None = None
) -> Result:
    """The scene at one resolution; `progress` is told the fraction done, the mesh is stored in `mesh_folder`.

    A failure of meshing or of Newton is a named status of the Result. Raises ValueError where a
    scene with inertia states no density.
    """
    if scene.material.density is None and (scene.analysis.kind != "static" or has_gravity(scene)):
        raise ValueError(f"{scene.name}: material.density is missing: inertia and gravity need it")
    start, cpu = clock.perf_counter(), clock.process_time()
    try:
        frame, surface = mid_surface(scene)
        plate = plate_of(scene, frame, surface)
        solid = make(plate, spacing_of(plate, level.size), surface)
        if mesh_folder is not None:
            store(solid, mesh_folder / f"{scene.name}_{level.size:g}.vtu")
        mesh_seconds = clock.perf_counter() - start
        model = discretise(scene, frame, solid)
    except MeshError as error:
        return _nothing(scene, level, error)
    answer = _vibrating if scene.analysis.kind == "modes" else _moved
    found, facts = answer(scene, level, model, progress or (lambda fraction: None))
    return Result(
        **_header(scene, level),
        **found,
        h=level.size,
        unknowns=model.system.unknowns,
        seconds=clock.perf_counter() - start,
        cpu_seconds=clock.process_time() - cpu,
        peak_mb=_peak_mb(),
        facts=_facts(model) | facts | {"mesh_seconds": mesh_seconds},
    )


def _moved(scene: Scene, level: ReferenceLevel, model: Model, progress: Progress) -> tuple[dict, dict]:
    """What a Result says of statics or dynamics, and facts."""
    history = _march(scene, level, model, progress)
    found = dict(
        times=np.array(history.times),
        probe_position=np.array(model.probes) @ model.solid.mesh.doflocs.T,
        displacement=np.array(history.displacement).reshape(-1, len(model.probes), 3),
        energies={kind: np.array(values) for kind, values in history.energies.items()},
        status=history.status,
        message=history.message,
        steps=history.steps,
        newton_iterations=model.memory.iterations,
        outline=_outline(model.solid, history.last, shots=history.shots),
    )
    if model.slopes:
        found["volume_ratio"] = np.array(history.volume_ratio).reshape(-1, len(model.slopes))
    if history.contact is not None:
        found["contact"] = Contact(**history.contact.arrays(model.frame))
    return found, history.facts


def _vibrating(scene: Scene, level: ReferenceLevel, model: Model, progress: Progress) -> tuple[dict, dict]:
    """What a Result says of modes, and facts."""
    points = model.solid.mesh.doflocs.T
    longest = float(np.linalg.norm(np.ptp(points, axis=0)))
    slow = 2 * _material(scene).mu * scene.thickness**2 / (scene.material.density * longest**4)  # 1/s2, as a plate's
    frequencies, shapes, facts, failed = np.empty(0), None, {}, {}
    try:
        modes = vibration(model.system, model.memory.solver, points, scene.analysis.count, slow)
        frequencies, shapes = modes.frequencies, modes.shapes
        facts = {"rigid_modes": modes.rigid, "solves": modes.solves}
        progress(1.0)
    except ModesFailure as failure:
        failed = {"status": failure.status, "message": str(failure)}
    except MemoryError as error:
        failed = {"status": "out_of_memory", "message": str(error)}
    model.memory.solver.close()
    found = dict(
        times=np.empty(0),
        probe_position=np.empty((0, 3)),
        displacement=np.empty((0, 0, 3)),
        energies={},
        frequencies=frequencies,
        outline=_outline(model.solid, np.zeros_like(points), shapes),
        **failed,
    )
    return found, facts


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


@dataclass
class History:
    """What a march has recorded so far; contact: an obstacles.Record where the scene has some."""

    times: list[float]
    displacement: list[np.ndarray]
    energies: dict[str, list[float]]
    facts: dict[str, float]
    last: np.ndarray
    contact: object = None
    status: str = OK
    message: str = ""
    steps: int = 0
    shots: Shots = field(default_factory=Shots)
    volume_ratio: list[list[float]] = field(default_factory=list)


def discretise(scene: Scene, frame: Frame, solid: Solid) -> Model:
    """Mass, pattern, loads, supports and probes of the scene on the mesh. Raises MeshError."""
    material = scene.material
    mass = None if material.density is None else scalar_mass(solid, material.density)
    fixed = np.zeros((solid.places.shape[1], 3), dtype=bool)
    for support in scene.supports:
        fixed |= held(solid, *_support(scene, frame, support))
    acting = [_load(scene, frame, solid, load, mass) for load in scene.loads]
    loads = load_at(tuple(load for load in acting if isinstance(load, Load)), fixed.shape)
    moments, pressures = (tuple(load for load in acting if isinstance(load, k)) for k in (Moment, FollowerPressure))
    probes = [_probe(frame, solid, probe) for probe in scene.probes]
    asked = [probe.at for probe in scene.probes if getattr(probe, "volume_ratio", False)]
    slopes = [point_slopes(solid, (*frame.place(at[:2]), at[2])) for at in asked]
    table = tabulate(solid, RULE_DEGREE)
    where = pattern(table.nodes, fixed.all(axis=1), [np.flatnonzero(moment.slope) for moment in moments])
    system = assemble(table, _material(scene), where, mass, loads, 1e-6 * solid.extent, fixed, moments, pressures)
    if scene.obstacles:
        from reference_fe.obstacles import contact_of

        system = replace(system, contact=contact_of(scene.obstacles, solid, where))
    velocity = np.where(fixed, 0.0, _velocity(scene, solid.mesh.doflocs.T))[where.free]
    total = None if mass is None else float(mass.sum())
    return Model(frame, solid, system, system.memory(), probes, slopes, velocity, total)


def _material(scene: Scene) -> Lame | MooneyRivlin:
    """The scene's law."""
    stated = scene.material
    if stated.kind == "svk":
        return lame(stated.youngs_modulus, stated.poissons_ratio)
    return mooney_rivlin(stated.mu10, stated.mu01, stated.bulk_modulus)


def _march(scene: Scene, level: ReferenceLevel, model: Model, progress: Progress) -> History:
    """Advance from output time to output time until the end or a failure."""
    memory = model.memory
    nothing = np.zeros((model.solid.places.shape[1], 3))
    history = History([], [], {"kinetic": [], "strain": [], "external": []}, {}, nothing)
    if model.system.contact is not None:
        from reference_fe.obstacles import Record

        history.energies |= {"contact": [], "dissipated": []}
        history.contact = Record(model.system.contact)
    pace = _pace(scene, level)
    begin, advance = _marching(scene, level, model, pace)
    times = _output_times(scene)
    try:
        state = begin()
        _record(history, model, state)
        for time in times[1:]:
            state, steps = advance(state, time)
            history.steps += steps
            _record(history, model, state)
            progress(time / times[-1])
    except NewtonFailure as failure:
        reached = f"after t = {history.times[-1]:.6g} s" if history.times else "before the first output time"
        history.status, history.message = failure.status, f"{reached}: {failure}"
    except MemoryError as error:
        history.status, history.message = "out_of_memory", str(error)
    history.facts["factorisations"] = memory.factorisations
    if pace is not None and history.steps:
        history.facts |= {"smallest_step": pace.shortest, "largest_step": pace.longest}
        history.facts["rejected_steps"] = pace.rejected
    history.facts |= {f"{part}_seconds": seconds for part, seconds in memory.seconds.items()}
    memory.solver.close()
    return history


def _marching(scene: Scene, level: ReferenceLevel, model: Model, pace: Pace | None) -> tuple[Callable, Callable]:
    """begin() -> state and advance(state, time) -> (state, steps) of the scene's kind of analysis."""
    system, memory, step = model.system, model.memory, level.time_step
    if scene.analysis.kind == "static":
        return (
            lambda: statics.balance(system, statics.begin(system), 0.0, memory),
            lambda state, time: statics.advance(system, state, time, step, memory),
        )
    trapezoidal = dynamics.TRAPEZOIDAL if system.contact is None else dynamics.MEAN
    scheme = trapezoidal if level.integrator == "trapezoidal" else dynamics.generalized_alpha()
    if pace:
        return _adaptive_dynamics(scheme, level.error_per_step, model, pace)
    return (
        lambda: dynamics.begin(system, model.velocity),
        lambda state, time: dynamics.advance(system, scheme, state, time, step, memory),
    )


def _adaptive_dynamics(scheme: dynamics.Scheme, allowed: float, model: Model, pace: Pace) -> tuple[Callable, Callable]:
    """begin and advance of `_marching` by steps of an estimated error of at most `allowed` (m)."""
    attempt = dynamics.within(model.system, scheme, allowed, model.memory)

    def begin() -> dynamics.State:
        state = dynamics.begin(model.system, model.velocity)
        pace.wanted = dynamics.first_step(scheme, state, allowed)
        return state

    return begin, lambda state, time: march(pace, state, time, attempt)


def _pace(scene: Scene, level: ReferenceLevel) -> Pace | None:
    """Where steps are chosen: between the corners of the load histories a time step sees smooth loads."""
    if level.error_per_step is None:
        return None
    return Pace(level.time_step, tuple(sorted({time for load in scene.loads for time, _ in load.history})))


def _record(history: History, model: Model, state: dynamics.State | statics.Balance) -> None:
    """Append one output time."""
    full = history.last = model.system.expand(state.u)
    history.times.append(state.time)
    history.shots.take(len(history.times) - 1, full)
    history.displacement.append(np.array([weights @ full for weights in model.probes]))
    pressed = {} if state.touch is None else {"contact": state.touch.stored, "dissipated": state.touch.spent}
    for kind, values in history.energies.items():
        values.append(pressed[kind] if kind in pressed else getattr(state, kind, 0.0))
    if model.slopes:
        history.volume_ratio.append([float(np.linalg.det(np.eye(3) + slope @ full)) for slope in model.slopes])
    if history.contact is not None:
        velocity = getattr(state, "v", np.zeros_like(state.u))
        history.contact.add(state.touch, full, model.system.expand(velocity))


def _output_times(scene: Scene) -> np.ndarray:
    """0, every, 2 every, ... until, which is a multiple of every."""
    until, every = scene.analysis.until, scene.analysis.every
    return until * np.linspace(0, 1, round(until / every) + 1)


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
    lines = [frame.place(load.at) for load in scene.loads if load.kind == "point"]
    return Plate(
        length,
        width,
        scene.thickness,
        tuple(_band(scene, frame, band) for band in scene.grooves),
        tuple(_band(scene, frame, band) for band in scene.protrusions),
        tuple(dict.fromkeys(regions)),
        tuple(dict.fromkeys(lines)),
        tuple(_middle(scene, frame, support) for support in scene.supports if getattr(support, "over", "") == "middle"),
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


def _middle(scene: Scene, frame: Frame, support) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ends, in the box, of the mid-surface line or point that a support holds."""
    sides = dict(place for place in _support(scene, frame, support)[0] if place[0] < 2)
    spans = [frame.interval(axis, span) for axis, span in enumerate(scene.surface.span)]
    return tuple(tuple(sides.get(axis, spans[axis][end]) for axis in (0, 1)) for end in (0, 1))


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
    """Grading toward the plate's sides, grooves and loads by fixed ratios, so that all edges scale with `size`.

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


def estimate(scene: Scene, level: ReferenceLevel) -> dict[str, object]:
    """What a solve would model and about what it costs, without meshing.

    {"unknowns", "elements", "memory_mb": of the whole process, "modelled": [...], "left_out": [...]}
    """
    plate = plate_of(scene, *mid_surface(scene))
    spacing = spacing_of(plate, level.size)
    elements = tetrahedra(plate, spacing)
    free = unknowns(elements)
    modelled, left_out = words(scene, level)
    return {
        "unknowns": free,
        "elements": elements,
        "memory_mb": memory_mb(free),
        "modelled": modelled,
        "left_out": left_out,
    }


def _load(scene: Scene, frame: Frame, solid: Solid, load, mass) -> Load | Moment | FollowerPressure:
    """A load of the scene on the nodes."""
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
        return Load(np.outer(np.asarray(mass.sum(axis=1)).ravel(), load.acceleration), history)
    if load.kind == "point":
        share = line_share(solid, frame.place(load.at))
    elif load.kind == "edge":
        share = face_share(solid, *_edge(scene, frame, load.edge))
    else:
        share = region_share(solid, frame.region(load.region))
    return Load(np.outer(share, load.force), history)


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


def _header(scene: Scene, level: ReferenceLevel) -> dict:
    """What every Result of this solver says of itself."""
    number = version("groovecheck")
    names = tuple(probe.name for probe in scene.probes)
    return dict(
        scene=scene.physics(), solver="reference", version=number, level=level.model_dump(mode="json"), probes=names
    )


def _nothing(scene: Scene, level: ReferenceLevel, error: MeshError) -> Result:
    """The Result of a mesh that could not be made."""
    count = len(scene.probes)
    return Result(
        **_header(scene, level),
        h=level.size,
        unknowns=0,
        times=np.empty(0),
        probe_position=np.full((count, 3), np.nan),
        displacement=np.empty((0, count, 3)),
        energies={},
        status=error.status,
        message=str(error),
    )


def _facts(model: Model) -> dict[str, float]:
    """Scalars worth a look."""
    solid = model.solid
    facts = {
        "volume": solid.volume,
        "exact_volume": solid.exact_volume,
        "smallest_jacobian": solid.smallest_jacobian,
        "tetrahedra": solid.tetrahedra,
    }
    return facts if model.mass is None else {**facts, "mass": model.mass}


def _outline(
    solid: Solid, displacement: np.ndarray, shapes: np.ndarray | None = None, shots: Shots | None = None
) -> Outline:
    """The surface with the displacement (n, 3) of all nodes; shapes (k, n, 3) are scaled to the largest size 1."""
    nodes, triangles, edges = surface_triangles(solid)
    modes = path = index = None
    if shapes is not None:
        modes = shapes[:, nodes] / np.linalg.norm(shapes[:, nodes], axis=2).max(axis=1)[:, None, None]
    if shots is not None and shots.states:
        path, index = np.array([state[nodes] for state in shots.states], np.float32), np.array(shots.index)
    return Outline(solid.mesh.doflocs.T[nodes], displacement[nodes], triangles, edges, modes, path, index)


def _peak_mb() -> float:
    """Largest resident memory of this process so far (MB)."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10)
