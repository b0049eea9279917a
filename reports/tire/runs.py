"""Measurements of the tire, each a unit of `reports.unit`. Forces, areas and energies are the whole tire's."""

from __future__ import annotations

import importlib
import time
from typing import Any

import numpy as np

from compare.result import Result
from reports.timing import least
from reports.tire.scenes import FALL, PER_POINT, SHARE, WEIGHT, stated, tire

OF_SCENE = ("until", "stiffness", "bulk", "depth", "ground")
SOLVERS = {"ancf": "ancf.run", "reference": "reference_fe.run"}
WALLS = 0.03  # m: deeper than this is a groove's floor, or near it


def _solved(scene, level, solver: str) -> Result:
    return importlib.import_module(SOLVERS[solver]).solve(scene, level)


def drop(
    solver: str = "ancf", part: str = "quarter", height: float = FALL, law: str = "pressure", **told: Any
) -> dict[str, Any]:
    """A fall: paths, force, pressed area, det F below the tread, the energy's drift. told: of `tire` or the level."""
    of_scene = {key: told.pop(key) for key in OF_SCENE if key in told}
    if law == "points":
        of_scene["ground"] = PER_POINT | of_scene.get("ground", {})
    scene, level = tire(told, solver, part, height, **of_scene)
    result = _solved(scene, level, solver)
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
    result = _solved(scene, level, solver)
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
    run = importlib.import_module(SOLVERS[solver])
    built = 0.0
    if solver == "ancf":
        from ancf.unpack import build

        begin = time.process_time()
        build(scene, level)
        built = time.process_time() - begin
    result = run.solve(scene, level)
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


def rubber(mesh: tuple[int, int] = (12, 5), **told: Any) -> dict[str, Any]:
    """Microseconds per element of force and tangent with the tread's grooves, one thread, the least of five."""
    from ancf.run import BLAS
    from ancf.unpack import build

    scene, level = tire({"mesh": list(mesh), **told})
    with BLAS.limit(limits=1, user_api="blas"):
        model = build(scene, level)
        system = model.system
        q = model.mesh.vectors.ravel() * (1 + 1e-3 * np.sin(np.arange(model.mesh.vectors.size)))
        count, force, tangent = len(model.mesh.connectivity), *seconds(model.body.elements, system.assembly.gather(q))
        plain = _plain(mesh, told)
    points = sum(len(form.volume) for group in _groups(model.body.elements) for form in _forms(group))
    return {
        "elements": count,
        "points_per_element": points / count,
        "force_us": 1e6 * force / count,
        "tangent_us": 1e6 * tangent / count,
        "force_us_plain": 1e6 * plain[0],
        "tangent_us_plain": 1e6 * plain[1],
    }


def _plain(mesh, told) -> tuple[float, float]:
    """Seconds per element of force and tangent without any groove."""
    from ancf.unpack import build

    scene, level = tire({"mesh": list(mesh), **told}, grooves=[])
    model = build(scene, level)
    spent = seconds(model.body.elements, model.system.assembly.gather(model.mesh.vectors.ravel()))
    count = len(model.mesh.connectivity)
    return spent[0] / count, spent[1] / count


def seconds(elements, Q) -> tuple[float, float]:
    """CPU seconds of a force and of a tangent of all elements, whose groups give theirs span by span."""
    pairs = list(zip(_groups(elements), Q if hasattr(elements, "groups") else [Q], strict=True))
    force = least(lambda: [group.force(own) for group, own in pairs])
    return force, least(lambda: [list(group.tangent(own)) for group, own in pairs])


def _groups(elements) -> tuple:
    """Groups of elements with equally many functions."""
    return getattr(elements, "groups", (elements,))


def _forms(elements) -> list:
    elements = getattr(elements, "isochoric", elements)
    return [elements.forms[form] for form in elements.form_of]


def pressed(deflection: float, inflation: float = 0.0, solver: str = "ancf", **level: Any) -> dict[str, Any]:
    """The weightless tire with its beads held on a rigid rim, pressed on the ground by the rim: load, footprint.

    deflection (m): how far the rim is nearer to the ground than where the undeformed tread touches it. inflation (Pa):
    follows the inner face.
    """
    inner = {"kind": "pressure", "face": "bottom", "pressure": inflation, "follower": True}
    more = {
        "loads": [inner | {"history": [[0.0, 0.0], [1.0, 1.0]]}] if inflation else [],
        "supports": [*stated()["supports"], {"kind": "clamp", "edge": "y1"}],
        "analysis": {"kind": "static", "until": 1.0, "every": 1.0},
    }
    ground = {"damping": 0.0}
    scene, own = tire({"time_step": 0.25} | level, solver, "quarter", -deflection, ground=ground, **more)
    result = _solved(scene, own, solver)
    if result.status != "ok":
        return {"status": result.status, "message": result.message}
    return {
        "status": result.status,
        "unknowns": result.unknowns,
        "load": float(4 * result.contact.force[-1, 0, 2]),
        "footprint": float(4 * result.contact.area[-1, 0]),
        "lower": float(result.displacement[-1, 1, 2]),
        "ratio": float(result.volume_ratio[-1, 0]),
        "cpu_seconds": result.cpu_seconds,
        "iterations": result.newton_iterations,
    }
