"""Measurements of the drop, each a unit of `reports.unit`."""

from __future__ import annotations

import importlib
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.result import Result
from reports.plate_drop.scenes import BOTTOM, FALL, GROOVE, WEIGHT, drop, resting

REPEATS, COSTED = 5, 60  # runs of which the cheapest counts, and their time steps
COARSE = 5e-3  # s
PACKAGES = {"ancf": "ancf.run", "reference": "reference_fe.run"}


def _solved(scene, level, solver: str) -> Result:
    return importlib.import_module(PACKAGES[solver]).solve(scene, level)


def path(result: Result, probe: str = "plate") -> np.ndarray:
    """Displacement (t, 3) of the plate's mean, or of its centre C."""
    return result.displacement[:, result.probes.index(probe)]


def residual(result: Result, energy: float) -> float:
    """Drift of kinetic + strain + contact + dissipated - external, in percent of `energy` (J)."""
    E = result.energies
    total = E["kinetic"] + E["strain"] + E["contact"] + E["dissipated"] - E["external"]
    return float(100 * np.abs(total - total[0]).max() / energy)


def fall(law: str, solver: str = "ancf", height: float = FALL, **told: Any) -> dict[str, Any]:
    """A drop: what it looks like, its energy, and the pressed face at the end.

    told: of `scenes.drop` where it has that name, else of the level. Heights are of the mean of the plate above
    where it touches; the rebound is the highest after the lowest of the first landing.
    """
    of_scene = {key: told.pop(key) for key in ("depth", "grooves", "stiffness") if key in told}
    if solver == "reference":
        told.setdefault("time_step", COARSE)
    scene, level = drop(law, told, solver, height, **of_scene)
    result = _solved(scene, level, solver)
    z = path(result)[:, 2] + height
    force = result.contact.force[:, 0, 2]
    first = np.flatnonzero(force > 0)
    if not first.size:
        return {"status": result.status if result.status != "ok" else "never touched"}
    landing = result.times <= result.times[first[0]] + 0.2
    low = int(np.argmin(np.where(landing, z, np.inf)))
    fallen = result.facts["mass"] * WEIGHT * height
    return {
        "status": result.status,
        "message": result.message,
        "unknowns": result.unknowns,
        "steps": result.steps,
        "iterations_per_step": result.newton_iterations / result.steps,
        "cpu_per_step_ms": 1e3 * result.cpu_seconds / result.steps,
        "cpu_seconds": result.cpu_seconds,
        "mass": result.facts["mass"],
        "reached": float(result.times[-1]),
        "lowest": float(z[low]),
        "rebound": float(z[low:].max()),
        "peak_force": float(force[landing].max()),
        "energy_residual": residual(result, fallen),
        "dissipated": float(100 * result.energies["dissipated"][-1] / fallen),
        "times": result.times.tolist(),
        "centre": (path(result, "C")[:, 2] + height).tolist(),
        "height": z.tolist(),
        "force": force.tolist(),
        "floor_pressed": _floor_pressed(result),
        **_pressed(result),
    }


def _floor_pressed(result: Result) -> float | None:
    """Greatest traction on points of the groove's floor, at the end; None where no contact point lies on it."""
    floor = result.contact.points[:, 2] > BOTTOM + 1e-6
    return float(result.contact.pressure[floor].max()) if floor.any() else None


def _pressed(result: Result) -> dict[str, Any]:
    """The face at the end: coordinates (m) and traction of each contact point; of the reference's about a thousand."""
    few = slice(None, None, max(1, len(result.contact.share) // 1000))
    x, y, _ = result.contact.points[few].T
    return {"x": x.tolist(), "y": y.tolist(), "pressure": result.contact.pressure[few].tolist()}


def rest(law: str, solver: str = "ancf", **level: Any) -> dict[str, Any]:
    """The plate at rest: how deep its mean and its centre have sunk (m), and the ground's reaction over the weight."""
    scene, own = resting(law, {"time_step": 0.25} | level, solver)
    result = _solved(scene, own, solver)
    if result.status != "ok":
        return {"status": result.status, "message": result.message}
    weight = result.facts["mass"] * WEIGHT
    return {
        "status": result.status,
        "unknowns": result.unknowns,
        "cpu_seconds": result.cpu_seconds,
        "sunk": float(-path(result)[-1, 2]),
        "centre_sunk": float(-path(result, "C")[-1, 2]),
        "reaction": float(result.contact.force[-1, 0, 2] / weight),
    }


def strips(count: int, width: float = GROOVE[1] - GROOVE[0]) -> list[list[float]]:
    """As many grooves as `count` across the plate, together `width` wide."""
    centres, half = (np.arange(count) + 0.5) / count, width / count / 2
    return [[float(c - half), float(c + half)] for c in centres]


def detail(
    counts: Sequence[int] = (1, 2, 4), mesh: Sequence[int] = (1, 1), element: str = "conforming"
) -> dict[str, Any]:
    """Time per step (ms of CPU, the least of REPEATS) of grooves once, twice, four times as detailed, in one process.

    In free flight, and on the ground with one and the same number of contact points per subdomain.
    """
    found: dict[str, Any] = {"counts": list(counts), "flight": [], "ground": [], "points": []}
    level = {"mesh": list(mesh), "element": element, "points": [7, 5, 3], "time_step": COARSE}
    until = {"analysis": {"kind": "dynamic", "until": COSTED * COARSE, "every": COSTED * COARSE}}
    posed = {}
    for name, more in (("flight", {"obstacles": []}), ("ground", {})):
        for count in counts:
            posed[name, count] = drop("pressure", level, height=0.0, grooves=strips(count), **until, **more)
    spent = [[_per_step(*own) for own in posed.values()] for _ in range(REPEATS)]  # in turn: a busy machine hits all
    for (name, _), least in zip(posed, np.min(spent, axis=0), strict=True):
        found[name].append(float(least))
    found["points"] = [len(_solved(*posed["ground", count], "ancf").contact.share) for count in counts]
    return found


def _per_step(scene, level) -> float:
    """CPU time (ms) per step, without the time that it takes to build the plate."""
    from ancf import run, unpack

    begin = time.process_time()
    unpack.build(scene, level)
    built = time.process_time() - begin
    result = run.solve(scene, level)
    return 1e3 * (result.cpu_seconds - built) / result.steps
