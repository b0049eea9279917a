"""solve(scene, level) -> Result: what this solver makes of each word of a scene.

Readings a solver must choose:
- A clamp holds all displacements of the edge's face. The normal gradient there stays free, as in any
  displacement-based solid, so both readings of `gradients` are the same here.
- A hold and a plane of symmetry hold components at the nodes of their place; their middle line or point, and that of
  a face with protrusions, is imprinted in the mesh. A moment turns with the best straight line through the edge's
  face along z.
- A point load is spread evenly over the line through the thickness at its (x, y), a patch load over
  the kept volume of its region; both are dead loads.
- An initial angular velocity turns about the origin of space.
- h is the level's size: every edge length that the mesh is asked for is a fixed multiple of it, but for those along
  the curves of grooves and protrusions, none of which is longer than a sixth of a full turn. Where that is the
  shorter one, coarse levels are as fine as finer ones, and their errors need not fall evenly. The mean volume of
  the tetrahedra is no measure, because in a thin plate it falls with the square of the size.
- Modes are small vibrations about the undeformed solid. Rigid motions that the supports leave free are counted,
  not listed.
- A rim's nodes are all those on the faces of its edges, its translation is their mean. What keeps its stated motion is
  a mean over the last step where the scheme balances means (with obstacles).
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

from compare.result import OK, Contact, Outline, Result, Rim, Shots
from compare.scene import ReferenceLevel, Scene
from reference_fe import dynamics, statics
from reference_fe.estimate import memory_mb, tetrahedra, unknowns
from reference_fe.geometry import MeshError
from reference_fe.mesh import Solid, make, store
from reference_fe.modes import ModesFailure, vibration
from reference_fe.newton import NewtonFailure
from reference_fe.outline import surface_triangles
from reference_fe.pace import Pace, march
from reference_fe.unpack import Model, discretise, material_of, mid_surface, plate_of, spacing_of
from reference_fe.words import has_gravity, words

Progress = Callable[[float], None]


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
    if scene.surface_stress:
        found["outline"] = replace(found["outline"], stress=_stress(scene, model, history.last))
    if model.slopes:
        found["volume_ratio"] = np.array(history.volume_ratio).reshape(-1, len(model.slopes))
    if model.system.rim is not None:
        found["rim"] = Rim(*np.array(history.rim).reshape(-1, 3, 3).swapaxes(0, 1))
    if history.contact is not None:
        found["contact"] = Contact(**history.contact.arrays(model.frame))
    return found, history.facts


def _vibrating(scene: Scene, level: ReferenceLevel, model: Model, progress: Progress) -> tuple[dict, dict]:
    """What a Result says of modes, and facts."""
    points = model.solid.mesh.doflocs.T
    longest = float(np.linalg.norm(np.ptp(points, axis=0)))
    slow = 2 * material_of(scene).mu * scene.thickness**2 / (scene.material.density * longest**4)  # 1/s2, as a plate's
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
    rim: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)


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
    if model.system.rim is not None:
        history.rim.append(model.system.rim.pull(state.rest, state.u, state.time))
    if history.contact is not None:
        velocity = getattr(state, "v", np.zeros_like(state.u))
        history.contact.add(state.touch, full, model.system.expand(velocity))


def _output_times(scene: Scene) -> np.ndarray:
    """0, every, 2 every, ... until, which is a multiple of every."""
    until, every = scene.analysis.until, scene.analysis.every
    return until * np.linspace(0, 1, round(until / every) + 1)


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


def _stress(scene: Scene, model: Model, displacement: np.ndarray) -> np.ndarray:
    """Von Mises stress (n,) at the nodes of the surface."""
    from reference_fe.stress import von_mises

    return von_mises(model.solid, displacement, material_of(scene))[surface_triangles(model.solid)[0]]


def _peak_mb() -> float:
    """Largest resident memory of this process so far (MB)."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10)
