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
- Statics asks for supports that leave no rigid motion, whether or not the loads need it; where obstacles or a rim may
  stop one, the tangents tell.
- A rim holds what a tangential clamp of its edges would; its translation is the mean of their positions. Its stated
  motion enters with its own velocity and acceleration; what keeps it is the residual there at each output.
- BLAS runs on one thread while a solve lasts: the products are small, and on cores that have other work
  the threads of one product wait for each other (a 0.5 s solve took 16 s). Solve several scenes at once
  in processes instead.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import version
from itertools import chain, pairwise
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import ThreadpoolController

from ancf.integrate import SCHEMES, advance, initial_state
from ancf.layer import KIND
from ancf.linear_solver import LinearSolver, SingularMatrix
from ancf.loads import brought_up
from ancf.modes import WORDS, lowest
from ancf.newton import OK, SINGULAR, equilibrium
from ancf.nurbs import GeometryError
from ancf.outline import facets, rows
from ancf.path import Point, follow
from ancf.sharing import possible, sharing
from ancf.supports import free_edges
from ancf.system import System, dividing, expected_memory
from ancf.unpack import Model, bands_of, build, held_of, initial_velocity, loose, material_of, mesh_of, rim_of
from ancf.wall import KINDS
from ancf.words import words
from compare.result import Contact, Outline, Result, Rim, Shots
from compare.scene import AncfLevel, Scene

if TYPE_CHECKING:
    from ancf import contact
    from ancf.border import BorderedSolver
    from ancf.mesh import Mesh
    from ancf.outline import Facets

SOLVER = "ancf"
GEOMETRY_FAILED = "geometry_failed"
LOST_ENERGY = "energy_not_kept"
LOST = 0.05  # of the energy that moves the plate or has gone into the contact
BLAS = ThreadpoolController()  # of NumPy and SciPy, which are loaded by now
Progress = Callable[[float], None] | None


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
    why: str = ""
    shots: Shots = field(default_factory=Shots)
    rim: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)


@BLAS.wrap(limits=1, user_api="blas")
def solve(scene: Scene, level: AncfLevel, progress: Progress = None) -> Result:
    """Solve the scene at one resolution; `progress` is called with the fraction of the time that is done.

    A solve that fails returns what it reached, under the name of the failure; a shape that folds, has no
    normal or no material left is "geometry_failed", statics of a plate that is not held "singular_tangent".
    """
    started, cpu = time.perf_counter(), time.process_time()
    try:
        model = build(scene, level)
    except GeometryError as error:
        return _nothing(scene, level, GEOMETRY_FAILED, str(error))
    except SingularMatrix as error:
        return _nothing(scene, level, SINGULAR, f"no layers can be chosen: {error}")
    with np.errstate(over="ignore", invalid="ignore"):
        answer = _vibrating if scene.analysis.kind == "modes" else _moved
        found, facts = answer(scene, level, model, progress)
    plate = {
        "volume": model.body.volume,
        "mass": model.body.total_mass,
        "elements": len(model.mesh.connectivity),
        "distinct_elements": model.body.shapes,
        "layer_vectors": int((model.mesh.kinds == KIND).sum()),
        "wall_vectors": int(np.isin(model.mesh.kinds, KINDS).sum()),
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
    if why := loose(scene, model.system):
        history, q = History(status=SINGULAR, why=why), model.mesh.vectors.ravel()
    else:
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
    if scene.rim is not None:
        found["rim"] = Rim(*np.array(history.rim).reshape(-1, 3, 3).swapaxes(0, 1))
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
    mesh, shear = model.mesh, material_of(scene).shear
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
    level = level.model_dump(mode="json")
    return dict(scene=scene.physics(), solver=SOLVER, version=_version(), level=level, probes=names)


@cache
def _version() -> str:
    """Of this package, which takes a look at its files."""
    return version("groovecheck")


def _nothing(scene: Scene, level: AncfLevel, status: str, message: str) -> Result:
    """The Result of what cannot be modelled: no unknowns, no times, h = 0."""
    count = len(scene.probes)
    return Result(
        **_header(scene, level),
        h=0.0,
        unknowns=0,
        times=np.empty(0),
        probe_position=np.full((count, 3), np.nan),
        displacement=np.empty((0, count, 3)),
        energies={},
        status=status,
        message=message,
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
        stress=_stress(scene, model, surface, q) if scene.surface_stress else None,
    )


def _stress(scene: Scene, model: Model, surface: Facets, q: np.ndarray) -> np.ndarray:
    """Von Mises stress (n,) at the surface's points."""
    from ancf.stress import von_mises

    return von_mises(model.mesh, surface, q.reshape(-1, 3), material_of(scene))


def _message(history: History) -> str:
    if history.status == OK:
        return ""
    reached = f"after t = {history.times[-1]:.6g} s" if history.times else "before the first output time"
    why = "the steps are too long for so stiff a contact" if history.status == LOST_ENERGY else history.why
    return f"{history.status} {reached}, after {history.steps} steps" + (f": {why}" if why else "")


def _output_times(scene: Scene) -> np.ndarray:
    """0, every, 2 every, ... until, which is a multiple of every."""
    return np.linspace(0.0, scene.analysis.until, round(scene.analysis.until / scene.analysis.every) + 1)


def _statics(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[History, np.ndarray]:
    """What acts at t = 0 is first brought up from nothing, then the path follows the histories."""
    history, q, work, touches, pull = History(), model.mesh.vectors.ravel().copy(), 0.0, _untouched(model), None
    solver, times = _solver(model.system), _output_times(scene)
    paths = [_bringing_up(scene, level, model)]
    paths += [(model.system, t0, t1, level.time_step) for t0, t1 in pairwise(times)]
    for t, (loaded, t0, t1, step) in zip(times, paths, strict=True):
        path = equilibrium(loaded, solver, q, t0, t1, step, touches, pull)
        history.steps += path.steps
        history.iterations += path.iterations
        history.factorisations += path.iterations
        history.status, q, work, touches = path.status, path.q, work + path.work, path.touches
        pull = path.pull
        if path.status != OK:
            break
        _record(history, model, float(t), q, np.zeros_like(q), work, touches, pull)
        _tell(progress, t / times[-1])
    return history, q


def _solver(acting: System) -> LinearSolver | BorderedSolver:
    """For the system's tangents, with a border where a rim is free."""
    if acting.rim is None or not acting.rim.free:
        return LinearSolver(acting.assembly.pattern)
    from ancf.border import bordered

    return bordered(acting)


def _untouched(model: Model) -> tuple[contact.Touch, ...]:
    """State of what may touch before anything has."""
    return () if model.system.contact is None else model.system.contact.untouched()


def _bringing_up(scene: Scene, level: AncfLevel, model: Model) -> tuple[System, float, float, float]:
    """System, range of its load parameter and load step that bring up what acts at t = 0: loads by steps, what lies
    on an obstacle at once."""
    acting = model.system
    kinds = "loads", "moments", "pressures"
    ramps = {kind: tuple(brought_up(load, 0.0) for load in getattr(acting, kind)) for kind in kinds}
    acts = any(load.factor(1.0) for loads in ramps.values() for load in loads)
    if acting.rim is not None:
        ramps["rim"] = brought_up(acting.rim, 0.0)
        acts = acts or bool(ramps["rim"].factor(1.0) and ramps["rim"].displacement.any())
    step = level.time_step / scene.analysis.until if acts else 1.0
    return replace(acting, **ramps), 0.0, float(acts or acting.contact is not None), step


def _path(scene: Scene, level: AncfLevel, model: Model, progress: Progress) -> tuple[History, np.ndarray]:
    """Statics by arc length, behind the loads that act at t = 0; every point is an output."""
    history, solver = History(), _solver(model.system)
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
    acting, solver = model.system, _solver(model.system)
    history = History()
    try:
        state = initial_state(acting, solver, q, initial_velocity(scene, model))
    except SingularMatrix:
        history.status = SINGULAR
        return history, q
    times, scheme, factor = _output_times(scene), SCHEMES[level.integrator], None
    _record(history, model, 0.0, state.q, state.v, 0.0, state.touches, state.pull)
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
        _record(history, model, float(t1), state.q, state.v, state.work, state.touches, state.pull)
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
    pull: np.ndarray | None = None,
) -> None:
    """pull (3 v,): the forces that keep a rim's stated motion."""
    kinetic, strain = model.system.energies(q, v)
    history.times.append(t)
    if model.ratios:
        history.volume_ratio.append([ratio.at(q) for ratio in model.ratios])
    history.displacement.append(model.probes @ (q.reshape(-1, 3) - model.mesh.vectors))
    history.kinetic.append(kinetic)
    history.strain.append(strain)
    history.external.append(work)
    history.touches.append(touches)
    if model.system.rim is not None:
        history.rim.append(model.system.rim.told(t, q, pull))
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


def _estimated_mesh(scene: Scene, level: AncfLevel) -> Mesh:
    """The mesh of a solve, without layers where none can be chosen."""
    if level.enrich is not None:
        try:
            return build(scene, level).mesh
        except SingularMatrix:
            pass
    return mesh_of(scene, level)


def estimate(scene: Scene, level: AncfLevel) -> dict[str, object]:
    """What a solve would model and what it costs, without solving.

    {"unknowns", "elements", "memory_mb": of the whole process, "modelled": [...], "left_out": [...]}
    """
    mesh = _estimated_mesh(scene, level)
    held, rim = held_of(scene, mesh), rim_of(scene, mesh)
    if rim is not None:
        held = held | rim.held
    spared = 0 if rim is None else rim.spared
    unknowns, free = int((~held).sum()) - spared, free_edges(mesh, held)
    divided = dividing(mesh, bands_of(scene), scene.thickness, free)
    first = sharing(mesh, divided, free, possible(mesh, level.points)).first
    modelled, left_out = words(scene, level)
    return {
        "unknowns": unknowns,
        "elements": len(mesh.connectivity),
        "memory_mb": expected_memory(mesh, unknowns, first),
        "modelled": modelled,
        "left_out": left_out,
    }
