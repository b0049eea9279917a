"""Measurements of the tire, each a unit of `reports.unit`. Forces, areas and energies are the whole tire's."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from compare.result import Result
from reports.tire.scenes import FALL, PER_POINT, SHARE, WEIGHT, tire

OF_SCENE = ("until", "stiffness", "bulk", "depth", "ground")
SOLVERS = {"ancf": "ancf.run", "reference": "reference_fe.run"}
COARSE = {"ancf": {"mesh": [6, 3]}, "reference": {"size": 0.4}}
SAMPLES = 2001  # places of the section that are looked at
WALLS = 0.03  # m: deeper than this is a groove's floor, or near it


def _solve(solver: str) -> Callable[..., Result]:
    return importlib.import_module(SOLVERS[solver]).solve


def solved(scene, level, solver: str) -> Result:
    """The scene's result, without what the first use of a new version pays for compiled kernels: a step of a coarse
    tire comes before."""
    solve = _solve(solver)
    moment = {"kind": "dynamic", "until": 0.002, "every": 0.002}
    solve(*tire(dict(COARSE[solver]), solver, height=0.0, analysis=moment))
    return solve(scene, level)


def drop(
    solver: str = "ancf", part: str = "quarter", height: float = FALL, law: str = "pressure", **told: Any
) -> dict[str, Any]:
    """A fall: paths, force, pressed area, det F below the tread, the energy's drift. told: of `tire` or the level."""
    of_scene = {key: told.pop(key) for key in OF_SCENE if key in told}
    if law == "points":
        of_scene["ground"] = PER_POINT | of_scene.get("ground", {})
    scene, level = tire(told, solver, part, height, **of_scene)
    result = solved(scene, level, solver)
    if result.contact is None or len(result.times) < 2:
        return {"status": result.status, "message": result.message}
    share = SHARE[part]
    force, area = share * result.contact.force[:, 0, 2], share * result.contact.area[:, 0]
    total = share * energy(result)
    fallen = share * result.facts["mass"] * WEIGHT * -result.displacement[:, 0, 2].min()
    return {
        "ended": result.status,
        "message": result.message,
        "unknowns": result.unknowns,
        "h": result.h,
        "elements": result.facts.get("elements", result.facts.get("tetrahedra")),
        "steps": result.steps,
        "iterations_per_step": result.newton_iterations / max(result.steps, 1),
        "cpu_seconds": result.cpu_seconds,
        "peak_mb_solver": result.peak_mb,
        "mass": share * result.facts["mass"],
        "volume": share * result.facts["volume"],
        "reached": float(result.times[-1]),
        "travel": float(-result.displacement[:, 0, 2].min()),
        "peak_force": float(force.max()),
        "footprint": float(area.max()),
        "lowest_ratio": float(result.volume_ratio.min()),
        "highest_ratio": float(result.volume_ratio.max()),
        "energy_residual": float(100 * np.abs(total - total[0]).max() / fallen),
        "energy_gain": float(100 * np.maximum.accumulate(total - total[0]).max() / fallen),
        "dissipated": float(share * result.energies["dissipated"][-1]),
        "finite": bool(np.isfinite(result.displacement).all()),
        "times": result.times.tolist(),
        "node_1": result.displacement[:, 0, 2].tolist(),
        "lower": result.displacement[:, 1, 2].tolist(),
        "force": force.tolist(),
        "area": area.tolist(),
        "ratio": result.volume_ratio[:, 0].tolist(),
        "energies": {kind: (share * values).tolist() for kind, values in result.energies.items()},
    }


def energy(result: Result) -> np.ndarray:
    """Kinetic + strain + contact + dissipated - external (t,) in J."""
    E = result.energies
    return E["kinetic"] + E["strain"] + E["contact"] + E["dissipated"] - E["external"]


def footprint(solver: str = "ancf", until: float = 0.18, **told: Any) -> dict[str, Any]:
    """The pressed face at a time: places on the ground (m) and traction (Pa) of the contact points that are near it."""
    scene, level = tire(told, solver, until=until, analysis={"kind": "dynamic", "until": until, "every": until})
    result = _solve(solver)(scene, level)
    x, y, z = result.contact.points.T
    near = np.pi - x < 0.35
    few = np.flatnonzero(near)[:: max(1, int(near.sum()) // 4000)]
    radius = -_outer(scene, y)
    return {
        "status": result.status,
        "x": ((np.pi - x) * radius)[few].tolist(),
        "y": _along(scene, y)[few].tolist(),
        "depth": (scene.thickness / 2 - z)[few].tolist(),
        "pressure": result.contact.pressure[few].tolist(),
        "in_grooves": float(result.contact.pressure[z < scene.thickness / 2 - WALLS].max(initial=0.0)),
    }


def _outer(scene, y: np.ndarray) -> np.ndarray:
    from compare.scene_revolved import section_curve

    return -section_curve(scene.surface, y)[0][1] - scene.thickness / 2


def _along(scene, y: np.ndarray) -> np.ndarray:
    from compare.scene_revolved import section_curve

    return section_curve(scene.surface, y)[0][0]


def part(solver: str = "ancf", part: str = "quarter", steps: int = 20, **told: Any) -> dict[str, Any]:
    """What a part of the tire costs from the first touch on, by step, and where node 1 is then."""
    step = 0.002
    analysis = {"kind": "dynamic", "until": steps * step, "every": steps * step}
    initial = {"velocity": [0.0, 0.0, -0.6]}
    scene, level = tire(told, solver, part, 0.0, analysis=analysis, initial=initial)
    built = 0.0
    if solver == "ancf":
        from ancf.unpack import build

        begin = time.process_time()
        build(scene, level)
        built = time.process_time() - begin
    result = solved(scene, level, solver)
    built = built or result.facts["mesh_seconds"]
    return {
        "status": result.status,
        "unknowns": result.unknowns,
        "elements": result.facts.get("elements", result.facts.get("tetrahedra")),
        "cpu_per_step": (result.cpu_seconds - built) / max(result.steps, 1),
        "memory": result.peak_mb,
        "node_1": float(result.displacement[-1, 0, 2]),
        "force": float(SHARE[part] * result.contact.force[-1, 0, 2]),
    }


def misfit(mesh: list[int]) -> dict[str, Any]:
    """How far (m) the mesh's middle is from the section, and its director's half from half the thickness, at most."""
    from ancf.unpack import build
    from compare.scene_revolved import section_curve

    scene, level = tire({"mesh": mesh})
    plate, y = build(scene, level).mesh, np.linspace(*scene.surface.span[1], SAMPLES)
    (along, radius), (along_u, radius_u) = section_curve(scene.surface, y)
    outward = np.array([-radius_u, along_u]) / np.hypot(along_u, radius_u)
    half = scene.thickness / 2
    middle, face = (_crown(plate, y, z) for z in (0.0, half))
    wanted = np.array([along, radius])
    return {
        "elements": len(plate.connectivity),
        "middle": float(np.linalg.norm(middle - wanted, axis=0).max()),
        "half": float(np.abs(np.einsum("cq,cq->q", face - middle, outward) - half).max()),
    }


def _crown(mesh, y: np.ndarray, z: float) -> np.ndarray:
    """Place along and from the axle (2, q) of the mesh's section at the top of the tire, at the height z."""
    from ancf.functional import interpolation

    x = np.full_like(y, mesh.x_lines[0])
    element = np.array([mesh.locate(*at) for at in zip(x, y, strict=True)])
    X = interpolation(mesh, element, np.column_stack([x, y, np.full_like(y, z)])) @ mesh.vectors
    return X[:, 1:].T
