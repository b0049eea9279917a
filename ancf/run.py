"""Scene and level -> Result: what this solver makes of each word of a scene.

Readings chosen here
- Point load: spread over the material line through the thickness; edge and patch loads uniform over
  the kept area or volume.
- Clamp "all": every nodal vector of the nodes and edges on it. "tangential": r, r_z (d_e) and the
  gradient along the edge. A hold does so for its components, over the middle without r_z (d_e); a plane of
  symmetry for its normal, and keeps the gradient out of the edge along the normal.
- A moment acts on the edge's mean slope through the thickness, so on r_z and d_e alone.
- An initial angular velocity turns about the origin of space: v = velocity + angular_velocity x r.
- The time step is the largest that divides the time between two outputs and is not longer than the level's.
- The global rule (Eq. 7) also integrates the mass.
- Contact points are those of the level's rule in (x, y), subdomain by subdomain, on the true face: on a groove's floor
  those of the floor, none on upright walls. A pressure acts on the area of the undeformed face. Points are listed
  obstacle by obstacle.
- In a step the damper of a point that enters an obstacle acts for the part of the step spent inside; with the
  energy-momentum scheme forces are means over a step, and what a result says of them is that of the last one.
- Modes are small vibrations about the undeformed plate. Rigid motions that the supports leave free are counted,
  not listed.
- BLAS runs on one thread while a solve lasts: the products are small, and on cores that have other work
  the threads of one product wait for each other (a 0.5 s solve took 16 s). Solve several scenes at once
  in processes instead.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from itertools import chain, pairwise
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import ThreadpoolController

from ancf.functional import (
    mean_over_edge,
    mean_over_region,
    mean_through_thickness,
    pressure_on_face,
    slope_through_edge,
    value_at,
)
from ancf.integrate import SCHEMES, advance, initial_state
from ancf.layer import KIND, layer_vectors, only, with_layers
from ancf.linear_solver import LinearSolver, SingularMatrix
from ancf.loads import EdgeMoment, Load, brought_up, gravity, pressure, spread
from ancf.material import MooneyRivlin, SaintVenantKirchhoff, from_engineering
from ancf.mesh import Mesh, grid
from ancf.modes import WORDS, lowest
from ancf.newton import OK, SINGULAR, equilibrium
from ancf.nurbs import Curve, GeometryError, Revolved, Surface, surface_derivatives
from ancf.outline import facets, rows
from ancf.path import Point, follow
from ancf.pressure import FollowerPressure, follower_pressure
from ancf.refine import band_edges, chosen, fitted
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, PROTRUSION, TOP, Band, Feature, Outlined, element_rule
from ancf.supports import clamp, free_edges, hold_corner, hold_edge, hold_whole, symmetry
from ancf.system import RELAXED, Body, System, body, distinct, expected_memory, system
from ancf.volume_ratio import VolumeRatio, volume_ratio
from ancf.words import words
from compare.result import Contact, Outline, Result, Shots
from compare.scene import AncfLevel, Scene
from compare.scene import Feature as SceneFeature

if TYPE_CHECKING:
    from ancf import contact

SOLVER = "ancf"
SAME = 0.01  # of the thickness: edges this near to each other share a grid line
LENGTH_POINTS = 65
GEOMETRY_FAILED = "geometry_failed"
LOST_ENERGY = "energy_not_kept"
LOST = 0.05  # of the energy that moves the plate or has gone into the contact
BLAS = ThreadpoolController()  # of NumPy and SciPy, which are loaded by now
Progress = Callable[[float], None] | None


@dataclass(frozen=True, eq=False)
class Model:
    """A scene unpacked: geometry, body, system, probes as rows (p, v), and the points whose det F is asked for."""

    mesh: Mesh
    bands: tuple[Feature, ...]
    body: Body
    system: System
    probes: np.ndarray
    ratios: tuple[VolumeRatio, ...]


@dataclass
class History:
    """What is written down at each output time."""

    times: list[float] = field(default_factory=list)
    displacement: list[np.ndarray] = field(default_factory=list)
    kinetic: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    external: list[float] = field(default_factory=list)
    load_parameter: list[float] = field(default_factory=list)
    volume_ratio: list[list[float]] = field(default_factory=list)
    touches: list[tuple[contact.Touch, ...]] = field(default_factory=list)
    steps: int = 0
    iterations: int = 0
    factorisations: int = 0
    status: str = OK
    shots: Shots = field(default_factory=Shots)


@BLAS.wrap(limits=1, user_api="blas")
def solve(scene: Scene, level: AncfLevel, progress: Progress = None) -> Result:
    """Solve the scene at one resolution; `progress` is called with the fraction of the time that is done.

    A solve that fails returns what it reached, under the name of the failure; a shape that folds, has no
    normal or no material left is "geometry_failed".
    """
    started, cpu = time.perf_counter(), time.process_time()
    try:
        model = build(scene, level)
    except GeometryError as error:
        return _nothing(scene, level, error)
    with np.errstate(over="ignore", invalid="ignore"):
        answer = _vibrating if scene.analysis.kind == "modes" else _moved
        found, facts = answer(scene, level, model, progress)
    plate = {
        "volume": model.body.volume,
        "mass": model.body.total_mass,
        "elements": len(model.mesh.connectivity),
        "distinct_elements": model.body.shapes,
        "layer_vectors": int((model.mesh.kinds == KIND).sum()),
    }
    return Result(
        **_header(scene, level),
        **found,
        h=float(model.mesh.edge_lengths.max()),
        unknowns=model.system.unknowns,
        seconds=time.perf_counter() - started,
        cpu_seconds=time.process_time() - cpu,
        peak_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        facts=plate | facts,
    )


def _moved(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[dict, dict]:
    """What a Result says of statics or dynamics."""
    history, q = _way(scene)(scene, level, model, progress)
    found = dict(
        times=np.array(history.times),
        probe_position=model.probes @ model.mesh.vectors,
        displacement=np.array(history.displacement).reshape(-1, len(model.probes), 3),
        energies={kind: np.array(getattr(history, kind)) for kind in ("kinetic", "strain", "external")},
        status=history.status,
        message=_message(history),
        steps=history.steps,
        newton_iterations=history.iterations,
        outline=_outline(scene, model, q, shots=history.shots),
        load_parameter=np.array(history.load_parameter) if scene.analysis.follow == "arc-length" else None,
    )
    if model.ratios:
        found["volume_ratio"] = np.array(history.volume_ratio).reshape(-1, len(model.ratios))
    if scene.obstacles:
        found["contact"] = _contact(model, history)
        for kind in ("stored", "dissipated"):
            sums = [sum(getattr(touch, kind) for touch in touches) for touches in history.touches]
            found["energies"]["contact" if kind == "stored" else kind] = np.array(sums)
    return found, {"factorisations": history.factorisations}


def _contact(model: Model, history: History) -> Contact:
    """What the obstacles did to the plate."""
    pairs, count = model.system.contact.pairs, len(history.touches)
    forces = np.array([[touch.force for touch in touches] for touches in history.touches])
    areas = np.array(
        [
            [pair.share[touch.pressure > 0].sum() for pair, touch in zip(pairs, touches, strict=True)]
            for touches in history.touches
        ]
    )
    points, share = (
        np.concatenate(parts) for parts in ([pair.face.points for pair in pairs], [pair.share for pair in pairs])
    )
    last = [touch.pressure for touch in history.touches[-1]] if count else [np.zeros(len(share))]
    return Contact(
        forces.reshape(count, len(pairs), 3), areas.reshape(count, len(pairs)), points, share, np.concatenate(last)
    )


def _vibrating(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[dict, dict]:
    """What a Result says of modes, and facts."""
    mesh, shear = model.mesh, _material(scene).shear
    size = np.linalg.norm(np.ptp(mesh.vectors[mesh.kinds == "r"], axis=0))
    slow = 2 * shear / scene.material.density * scene.thickness**2 / size**4  # 1/s2, of a plate of this size
    modes = lowest(model.system, scene.analysis.count, slow)
    _tell(progress, 1.0)
    found = dict(
        times=np.empty(0),
        probe_position=np.empty((0, 3)),
        displacement=np.empty((0, 0, 3)),
        energies={},
        frequencies=np.sqrt(modes.eigenvalues) / (2 * np.pi),
        status=modes.status,
        message=WORDS.get(modes.status, ""),
        outline=_outline(scene, model, mesh.vectors, modes.shapes),
    )
    return found, {"rigid_modes": modes.rigid, "solves": modes.solves}


def _way(scene: Scene) -> Callable:
    """How the scene's statics or dynamics are followed."""
    if scene.analysis.kind == "dynamic":
        return _dynamics
    return _statics if scene.analysis.follow == "load" else _path


def _header(scene: Scene, level: AncfLevel) -> dict:
    """What every Result of this solver says of itself."""
    names = tuple(probe.name for probe in scene.probes)
    number = version("groovecheck")
    return dict(scene=scene.physics(), solver=SOLVER, version=number, level=level.model_dump(mode="json"), probes=names)


def _nothing(scene: Scene, level: AncfLevel, error: GeometryError) -> Result:
    """The Result of a shape that cannot be modelled: no unknowns, no times, h = 0."""
    count = len(scene.probes)
    return Result(
        **_header(scene, level),
        h=0.0,
        unknowns=0,
        times=np.empty(0),
        probe_position=np.full((count, 3), np.nan),
        displacement=np.empty((0, count, 3)),
        energies={},
        status=GEOMETRY_FAILED,
        message=str(error),
    )


def _outline(
    scene: Scene, model: Model, q: np.ndarray, shapes: Sequence[np.ndarray] = (), shots: Shots | None = None
) -> Outline:
    """The surface of the nodal vectors q; shapes of vibration (k, 3 v) are scaled to the largest displacement 1."""
    surface, vectors = facets(model.mesh, model.bands, scene.thickness), model.mesh.vectors
    states = [] if shots is None else shots.states
    fields = [vectors, q.reshape(-1, 3) - vectors, *(shape.reshape(-1, 3) for shape in shapes)]
    fields += [state.reshape(-1, 3) - vectors for state in states]
    placed = (rows(model.mesh, surface) @ np.hstack(fields)).reshape(-1, len(fields), 3)
    reference, displacement, *others = placed.swapaxes(0, 1)
    modes, path = others[: len(shapes)], others[len(shapes) :]
    return Outline(
        reference,
        displacement,
        surface.triangles,
        surface.edges,
        modes=np.array([mode / np.linalg.norm(mode, axis=1).max() for mode in modes]) if modes else None,
        path=np.array(path, np.float32) if path else None,
        path_index=np.array(shots.index) if path else None,
    )


def _message(history: History) -> str:
    if history.status == OK:
        return ""
    reached = f"after t = {history.times[-1]:.6g} s" if history.times else "before the first output time"
    why = ": the steps are too long for so stiff a contact" if history.status == LOST_ENERGY else ""
    return f"{history.status} {reached}, after {history.steps} steps{why}"


def build(scene: Scene, level: AncfLevel) -> Model:
    """Mesh, integrate and assemble the scene. Raises GeometryError."""
    bands, mesh = _bands(scene), _mesh(scene, level)
    if level.enrich is None or not bands:
        return _model(scene, level, mesh, bands)
    every = with_layers(mesh, layer_vectors(mesh, bands, scene.thickness), bands, scene.thickness)
    inertia = scene.analysis.until**-2 if scene.analysis.kind == "dynamic" else 0.0
    trial = _model(scene, level, every, bands, pointwise=True)  # used once, which the tensors would not repay
    worth = chosen(trial.system, level.enrich, inertia)
    return _model(scene, level, only(every, worth), bands)


def _model(scene: Scene, level: AncfLevel, mesh: Mesh, bands: tuple[Feature, ...], pointwise: bool = False) -> Model:
    material = _material(scene)
    density = scene.material.density or 0.0
    held = _held(scene, mesh)
    free = free_edges(mesh, held)
    volume = level.volumetric or RELAXED
    integration = level.points, level.integration, pointwise, free, volume
    plate = body(mesh, bands, scene.thickness, material, density, *integration)
    loads = [_load(load, mesh, bands, scene.thickness, plate) for load in scene.loads]
    kinds = Load, EdgeMoment, FollowerPressure
    dead, *following = ([load for load in loads if isinstance(load, kind)] for kind in kinds)
    probes = [_probe(probe, mesh, bands, scene.thickness) for probe in scene.probes]
    acting = system(plate, held, dead, scene.thickness, *following)
    if scene.obstacles:
        acting = replace(acting, contact=_obstacles(scene, level, mesh, bands, acting))
    return Model(mesh, bands, plate, acting, np.array(probes), tuple(_ratios(scene, level, mesh, bands, plate)))


def _material(scene: Scene) -> SaintVenantKirchhoff | MooneyRivlin:
    stated = scene.material
    if stated.kind == "svk":
        return from_engineering(stated.youngs_modulus, stated.poissons_ratio)
    return MooneyRivlin(stated.mu10, stated.mu01, stated.bulk_modulus)


def _mesh(scene: Scene, level: AncfLevel) -> Mesh:
    surface = _surface(scene)
    return grid(*_lines(scene, level, surface), surface, FAMILY[level.element], scene.surface.closed)


def _surface(scene: Scene) -> Surface | Revolved | None:
    """The mid-surface, None where it is flat."""
    stated = scene.surface
    if stated.kind == "nurbs":
        return Surface(stated.degree, stated.knots, stated.control_points, stated.weights)
    if stated.kind == "revolved":
        section = stated.section
        curve = Curve(section.degree, section.knots, section.control_points, section.weights)
        return Revolved(curve, "XYZ".index(stated.axis))
    return None


def _lines(scene: Scene, level: AncfLevel, surface: Surface | Revolved | None) -> Iterator[np.ndarray]:
    """Grid lines of each axis."""
    for axis, (span, count) in enumerate(zip(scene.surface.span, level.mesh, strict=True)):
        if level.fit is None:
            yield np.linspace(*span, count + 1)
        else:
            metre = 1.0 if surface is None else np.ptp(span) / _length(scene, surface, axis)
            unit = scene.thickness * metre
            beside = [distance * unit for distance in level.fit]
            yield fitted(span, count, band_edges(_bands(scene), axis), beside, SAME * unit)


def _length(scene: Scene, surface: Surface | Revolved, axis: int) -> float:
    """Length (m) of the surface's middle line along an axis."""
    spans = scene.surface.span
    at = [np.full(LENGTH_POINTS, np.mean(span)) for span in spans]
    at[axis] = np.linspace(*spans[axis], LENGTH_POINTS)
    return float(np.linalg.norm(np.diff(surface_derivatives(surface, *at).s, axis=0), axis=1).sum())


def _held(scene: Scene, mesh: Mesh) -> np.ndarray:
    """Held components (3 v,)."""
    held = np.zeros(3 * len(mesh.vectors), dtype=bool)
    for support in scene.supports:
        held |= _support(support, mesh)
    return held


def _support(support, mesh: Mesh) -> np.ndarray:
    """Held components (3 v,) of one support."""
    if support.kind == "clamp":
        return clamp(mesh, support.edge, support.gradients)
    if support.kind == "symmetry":
        return symmetry(mesh, support.edge, "XYZ".index(support.normal))
    components, face = ["XYZ".index(component) for component in support.components], support.over == "face"
    if support.whole:
        return hold_whole(mesh, components)
    if support.over not in ("face", "middle"):
        raise ValueError(f"a plate cannot hold the {support.over} of an edge apart from its face")
    if support.edge is not None:
        return hold_edge(mesh, support.edge, components, face)
    return hold_corner(mesh, (int(support.corner[1]), int(support.corner[3])), components, face)


def _bands(scene: Scene) -> tuple[Feature, ...]:
    grooves = [_band(band, GROOVE) for band in scene.grooves]
    return (*grooves, *(_band(band, PROTRUSION) for band in scene.protrusions))


def _band(band: SceneFeature, sign: int) -> Feature:
    face = BOTTOM if band.face == "bottom" else TOP
    if hasattr(band, "outline"):
        loop, surface = band.outline, band.depth_surface
        outline = Curve(loop.degree, loop.knots, loop.control_points, loop.weights)
        depth = band.depth
        if surface is not None:
            depth = Surface(surface.degree, surface.knots, np.array(surface.depths)[..., None])
        return Outlined(face, sign, outline, depth)
    profile = band.profile
    section = band.depth
    if profile is not None:
        section = Curve(profile.degree, profile.knots, profile.control_points, profile.weights)
    along = {} if band.extent is None else {"extent": band.extent}
    return Band(_side(band.face), sign, "xy".index(band.along), band.edges, section, **along)


def _side(face: str) -> int:
    """BOTTOM or TOP."""
    return BOTTOM if face == "bottom" else TOP


def _load(load, mesh: Mesh, bands, thickness: float, plate: Body) -> Load | EdgeMoment | FollowerPressure:
    if load.kind == "gravity":
        return gravity(plate.mass_row, load.acceleration, load.history)
    if load.kind == "pressure":
        face = -1 if load.face == "bottom" else 1
        if load.follower:
            return follower_pressure(mesh, thickness, face, load.pressure, load.history)
        row = pressure_on_face(mesh, thickness, face)
        return pressure(row, load.pressure, load.history)
    if load.kind == "moment":
        row = slope_through_edge(mesh, bands, thickness, load.edge)
        return EdgeMoment(row, np.array(load.moment), tuple(load.history))
    if load.kind == "point":
        row = mean_through_thickness(mesh, bands, thickness, *load.at)
    elif load.kind == "edge":
        row = mean_over_edge(mesh, bands, thickness, load.edge)
    else:
        row = mean_over_region(mesh, bands, thickness, load.region)
    return spread(row, load.force, load.history)


def _obstacles(scene: Scene, level: AncfLevel, mesh: Mesh, bands, acting: System) -> contact.Contact:
    """What each obstacle may touch; the code of contact is loaded only here."""
    from ancf import obstacle as rigid
    from ancf.contact import Contact, Pair
    from ancf.contact_law import Law
    from ancf.face import face

    def body(shape):
        if shape.kind == "plane":
            return rigid.plane(shape.point, shape.normal)
        if shape.kind == "sphere":
            return rigid.sphere(shape.centre, shape.radius)
        return rigid.drum(shape.point, shape.axis, shape.radius)

    faces = {
        side: face(mesh, bands, scene.thickness, level.points[:2], _side(side), acting.assembly, level.integration)
        for side in {stated.face for stated in scene.obstacles}
    }
    pairs = []
    for stated in scene.obstacles:
        own = faces[stated.face]
        k, c = stated.stick_stiffness, stated.stick_damping
        sticks = (stated.stiffness if k is None else k, stated.damping if c is None else c)
        law = Law(stated.stiffness, stated.damping, stated.friction, *sticks)
        share = own.share if stated.law == "pressure" else np.ones(len(own.share))
        pairs.append(Pair(own, body(stated.shape), law, share))
    return Contact(tuple(pairs))


def _probe(probe, mesh: Mesh, bands, thickness: float) -> np.ndarray:
    if hasattr(probe, "region"):
        return mean_over_region(mesh, bands, thickness, probe.region)
    return value_at(mesh, *probe.at)


def _ratios(scene: Scene, level: AncfLevel, mesh: Mesh, bands, plate: Body) -> Iterator[VolumeRatio]:
    """The points whose det F the scene asks for."""
    for probe in scene.probes:
        if getattr(probe, "volume_ratio", False):
            e = mesh.locate(*probe.at[:2])
            rule = element_rule(mesh.cells[e], bands, scene.thickness, level.points, level.integration, mesh.levels(e))
            yield volume_ratio(mesh, plate.elements, probe.at, rule)


def _output_times(scene: Scene) -> np.ndarray:
    """0, every, 2 every, ... until, which is a multiple of every."""
    return np.linspace(0.0, scene.analysis.until, round(scene.analysis.until / scene.analysis.every) + 1)


def _statics(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[History, np.ndarray]:
    """Loads that act at t = 0 are first brought up from nothing, then the path follows the histories."""
    history, q, work, touches = History(), model.mesh.vectors.ravel().copy(), 0.0, _untouched(model)
    solver, times = LinearSolver(model.system.assembly.pattern), _output_times(scene)
    paths = [_bringing_up(scene, level, model)]
    paths += [(model.system, t0, t1, level.time_step) for t0, t1 in pairwise(times)]
    for t, (loaded, t0, t1, step) in zip(times, paths, strict=True):
        path = equilibrium(loaded, solver, q, t0, t1, step, touches)
        history.steps += path.steps
        history.iterations += path.iterations
        history.factorisations += path.iterations
        history.status, q, work, touches = path.status, path.q, work + path.work, path.touches
        if path.status != OK:
            break
        _record(history, model, float(t), q, np.zeros_like(q), work, touches)
        _tell(progress, t / times[-1])
    return history, q


def _untouched(model: Model) -> tuple[contact.Touch, ...]:
    """State of what may touch before anything has."""
    return () if model.system.contact is None else model.system.contact.untouched()


def _bringing_up(scene: Scene, level: AncfLevel, model: Model) -> tuple[System, float, float, float]:
    """System, range of its load parameter and load step that bring up the loads acting at t = 0."""
    acting = model.system
    kinds = "loads", "moments", "pressures"
    ramps = {kind: tuple(brought_up(load, 0.0) for load in getattr(acting, kind)) for kind in kinds}
    acts = any(load.factor(1.0) for loads in ramps.values() for load in loads)
    return replace(acting, **ramps), 0.0, float(acts), level.time_step / scene.analysis.until


def _path(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[History, np.ndarray]:
    """Statics by arc length, behind the loads that act at t = 0; every point is an output."""
    history, solver = History(), LinearSolver(model.system.assembly.pattern)
    ramp, t0, t1, step = _bringing_up(scene, level, model)
    begun = equilibrium(ramp, solver, model.mesh.vectors.ravel().copy(), t0, t1, step)
    points = [Point(0.0, 0.0, begun.q, 0.0, begun.status, begun.iterations)]
    if begun.status == OK:
        points = chain(points, follow(model.system, solver, begun.q, scene.analysis.until, level.time_step))
    for point in points:
        history.steps += 1
        history.iterations += point.iterations
        history.factorisations += point.iterations
        history.status = point.status
        if point.status != OK:
            break
        _record(history, model, point.length, point.q, np.zeros_like(point.q), begun.work + point.work)
        history.load_parameter.append(point.t)
        _tell(progress, max(history.load_parameter) / scene.analysis.until)
    return history, point.q


def _dynamics(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[History, np.ndarray]:
    q = model.mesh.vectors.ravel().copy()
    acting, solver = model.system, LinearSolver(model.system.assembly.pattern)
    history = History()
    try:
        state = initial_state(acting, solver, q, _initial_velocity(scene, model))
    except SingularMatrix:
        history.status = SINGULAR
        return history, q
    times, scheme, factor = _output_times(scene), SCHEMES[level.integrator], None
    _record(history, model, 0.0, state.q, state.v, 0.0, state.touches)
    dt = times[1] / np.ceil(times[1] / level.time_step - 1e-9)
    for t1 in times[1:]:
        motion = advance(acting, solver, scheme, state, float(t1), dt, factor)
        state, factor = motion.state, motion.factor
        history.steps += motion.steps
        history.iterations += motion.iterations
        history.factorisations += motion.factorisations
        history.status = motion.status
        if motion.status != OK:
            break
        _record(history, model, float(t1), state.q, state.v, state.work, state.touches)
        if scene.obstacles and _lost(history) > LOST:
            history.status = LOST_ENERGY
            break
        _tell(progress, t1 / times[-1])
    return history, state.q


def _record(
    history: History,
    model: Model,
    t: float,
    q: np.ndarray,
    v: np.ndarray,
    work: float,
    touches: tuple[contact.Touch, ...] = (),
) -> None:
    kinetic, strain = model.system.energies(q, v)
    history.times.append(t)
    if model.ratios:
        history.volume_ratio.append([ratio.at(q) for ratio in model.ratios])
    history.displacement.append(model.probes @ (q.reshape(-1, 3) - model.mesh.vectors))
    history.kinetic.append(kinetic)
    history.strain.append(strain)
    history.external.append(work)
    history.touches.append(touches)
    history.shots.take(len(history.times) - 1, q)


def _lost(history: History) -> float:
    """Energy that the steps have made or lost since the start, as a part of the most that there was to lose."""
    through = sum(touch.most for touch in history.touches[-1])
    moving = max(kinetic + strain for kinetic, strain in zip(history.kinetic, history.strain, strict=True))
    return abs(_total(history, -1) - _total(history, 0)) / max(through, moving) if through > 0 else 0.0


def _total(history: History, k: int) -> float:
    """Energy (J) at an output time, less what the loads have brought."""
    contact = sum(touch.stored + touch.dissipated for touch in history.touches[k])
    return history.kinetic[k] + history.strain[k] + contact - history.external[k]


def _tell(progress: Progress, fraction: float) -> None:
    if progress is not None:
        progress(float(fraction))


def _initial_velocity(scene: Scene, model: Model) -> np.ndarray:
    """Components (3 v,) of a rigid velocity; held components rest."""
    mesh, v = model.mesh, np.zeros((len(model.mesh.vectors), 3))
    if scene.initial is not None:
        is_position = (mesh.kinds == "r")[:, None]
        v = np.cross(scene.initial.angular_velocity, mesh.vectors) + is_position * np.array(scene.initial.velocity)
    v = v.ravel()
    v[model.system.assembly.unknown_of < 0] = 0.0
    return v


def estimate(scene: Scene, level: AncfLevel) -> dict[str, object]:
    """What a solve would model and what it costs, without solving.

    {"unknowns", "elements", "memory_mb": of the whole process, "modelled": [...], "left_out": [...]}
    """
    mesh = _mesh(scene, level) if level.enrich is None else build(scene, level).mesh
    held = _held(scene, mesh)
    unknowns, first = int((~held).sum()), distinct(mesh, _bands(scene), free_edges(mesh, held))[1]
    modelled, left_out = words(scene, level)
    return {
        "unknowns": unknowns,
        "elements": len(mesh.connectivity),
        "memory_mb": expected_memory(mesh, unknowns, first),
        "modelled": modelled,
        "left_out": left_out,
    }
