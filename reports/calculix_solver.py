"""CalculiX as a third solver of a scene: the reference's mesh and nodal loads, another program's elements and steps.

What is shared with the reference is the mesh, the boundary nodes and the nodal forces of the stated load; element,
stress, time integration and equation solver are CalculiX's. Its C3D10 integrates at four points and it ends its
iterations at 0.5 % of the mean force, so it is an opinion, not a truth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from compare.external import calculix
from compare.result import Outline, Result, Shots
from compare.scene import BUDGETS, ReferenceLevel, Scene
from compare.study import Unit, unit
from reference_fe.outline import surface_triangles
from reports.speed_runs import discretised

NAME, MODULE = "calculix", "reports.calculix_solver"
STEP = 0.02  # s, as the reference's coarse levels take
LEVELS = ((0.3, "standard"), (0.2, "standard"), (0.14, "standard"), (0.1, "full"))  # edge length (m), budget


def units(scenes: Sequence[Scene], budget: str) -> list[Unit]:
    """Units of the scenes that CalculiX can be asked, where it is installed; none otherwise."""
    if not calculix.available():
        return []
    paid = BUDGETS[: BUDGETS.index(budget) + 1]
    levels = [ReferenceLevel(size=size, time_step=STEP, budget=b) for size, b in LEVELS if b in paid]
    return [unit(scene, None, NAME, MODULE, level) for scene in scenes if why_not(scene) is None for level in levels]


def why_not(scene: Scene) -> str | None:
    """Why a scene cannot be put to CalculiX by this module; None where it can."""
    if scene.analysis.kind != "dynamic" or scene.surface.kind != "rectangle":
        return "only dynamics of flat plates"
    if scene.material.kind != "svk" or scene.obstacles:
        return "only St. Venant-Kirchhoff solids that touch nothing"
    if any(support.kind != "clamp" for support in scene.supports) or scene.initial is not None:
        return "only clamped edges and a plate at rest"
    if len(scene.loads) != 1 or scene.loads[0].kind != "patch":
        return "only one patch load"
    return None


def solve(scene: Scene, level: ReferenceLevel, progress: Callable[[float], None] | None = None) -> Result:
    """Write the deck, run `ccx`, read probes and surface back. Raises CalculixError where it stops."""
    model = discretised(scene, level.size)
    system, nodes = model.system, model.solid.mesh.doflocs.T
    weights = np.array(model.probes)
    surface, triangles, edges = surface_triangles(model.solid)
    printed = np.union1d(np.flatnonzero(np.abs(weights).sum(axis=0)), surface)
    answer = calculix.solve(_problem(scene, level, system, nodes, printed))
    displacement = np.concatenate([np.zeros((1, len(printed), 3)), answer.displacement])
    moved = np.einsum("pk,tkc->tpc", weights[:, printed], displacement)
    return Result(
        scene=scene.physics(),
        solver=NAME,
        version=calculix.version(),
        level=level.model_dump(mode="json"),
        h=level.size,
        unknowns=3 * system.pattern.free.size,
        times=np.concatenate([[0.0], answer.times]),
        probes=tuple(probe.name for probe in scene.probes),
        probe_position=weights @ nodes,
        displacement=moved,
        energies={},
        cpu_seconds=answer.cpu_seconds,
        steps=len(answer.times),
        outline=_outline(nodes[surface], displacement[:, np.searchsorted(printed, surface)], triangles, edges),
    )


def _outline(points: np.ndarray, displacement: np.ndarray, triangles: np.ndarray, edges: np.ndarray) -> Outline:
    """The surface (n, 3) with its displacement (t, n, 3) at every step: the last one, and a few on the way."""
    shots = Shots()
    for output, state in enumerate(displacement):
        shots.take(output, state)
    path, index = np.array(shots.states, np.float32), np.array(shots.index)
    return Outline(points, displacement[-1], triangles, edges, path=path, path_index=index)


def _problem(scene: Scene, level: ReferenceLevel, system: Any, nodes: np.ndarray, printed: np.ndarray):
    material = scene.material
    return calculix.Problem(
        nodes=nodes,
        tetrahedra=system.table.nodes,
        fixed=np.flatnonzero(system.pattern.number < 0),
        force=system.loads(1.0),
        history=scene.loads[0].history,
        density=material.density,
        youngs_modulus=material.youngs_modulus,
        poissons_ratio=material.poissons_ratio,
        step=level.time_step,
        until=scene.analysis.until,
        printed=printed,
    )


def estimate(scene: Scene, level: ReferenceLevel) -> dict[str, Any]:
    """Unknowns and memory (MiB), roughly, as the pool wants them."""
    volume = scene.surface.length * scene.surface.width * scene.thickness
    unknowns = int(3 * 12 * volume / (scene.thickness * level.size**2 / 6))
    return {"unknowns": unknowns, "elements": unknowns // 6, "memory_mb": 100 + 0.05 * unknowns}
