"""Hard cases of contact: stiffness and steps far out, all points at once, stopping, an edge first, long rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from ancf.run import solve
from reports.plate_drop.runs import path, residual
from reports.plate_drop.scenes import WEIGHT, drop

SPEED = 1.0  # m/s
FRICTION = 0.75
STICK = 5e7  # N/m3: with the ground's own, friction would grow over 7 mm
DOWN = {"velocity": [0.0, 0.0, -SPEED]}
LEVEL = {"mesh": [1, 1], "element": "conforming", "points": [7, 3, 3]}


def _moved(step: float, until: float, integrator: str = "energy-momentum", outputs: int = 50, **told: Any):
    """Result of the plate that starts on the ground."""
    analysis = {"kind": "dynamic", "until": until, "every": until / outputs}
    height = told.pop("height", 0.0)
    scene, level = drop(
        "pressure", LEVEL | {"time_step": step, "integrator": integrator}, "ancf", height, analysis=analysis, **told
    )
    return solve(scene, level)


def _told(result, energy: float, **values: Any) -> dict[str, Any]:
    finite = bool(np.all(np.isfinite(result.displacement)))
    return {
        "status": "ok",
        "ended": result.status if finite else "not finite",
        "steps": result.steps,
        "iterations_per_step": result.newton_iterations / max(result.steps, 1),
        "energy_residual": residual(result, energy),
        **values,
    }


def landing(stiffness: float, step: float, integrator: str = "energy-momentum") -> dict[str, Any]:
    """Flat on the ground at 1 m/s, every point at once, no weight, for 0.2 s (0.05 s in steps below 0.1 ms)."""
    until = 0.2 if step >= 1e-4 else 0.05
    result = _moved(step, until, integrator, round(until / step), stiffness=stiffness, initial=DOWN, loads=[])
    return _told(result, result.facts["mass"] * SPEED**2 / 2, peak_force=float(result.contact.force[..., 2].max()))


def stopping(step: float = 2e-3) -> dict[str, Any]:
    """Ten thousand times as stiff a plate slides at 1 m/s, sunk in as far as carries it: stops after v^2 / (2 mu g)."""
    weight = 7860.0 * (0.05 - 0.2 * 0.03) * WEIGHT
    sunk = weight / (535500.0 * 0.8)
    result = _moved(
        step,
        0.4,
        height=-sunk,
        initial={"velocity": [SPEED, 0.0, 0.0]},
        ground={"stick_stiffness": STICK},
        material={"kind": "svk", "youngs_modulus": 2e9, "poissons_ratio": 0.0, "density": 7860.0},
    )
    x = path(result)[:, 0]
    late = x[result.times > 0.3]
    return _told(
        result,
        result.facts["mass"] * SPEED**2 / 2,
        value=float(late.mean()),
        expected=SPEED**2 / (2 * FRICTION * WEIGHT),
        swings=float(np.ptp(late)),
    )


def edge_on(step: float = 2e-3, degrees: float = 60.0) -> dict[str, Any]:
    """An edge first at 1 m/s, on a ground that stands askew."""
    tilt = np.radians(degrees)
    normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    shape = {"kind": "plane", "point": [0.0, 0.0, -0.025], "normal": normal.tolist()}
    velocity = (-SPEED * normal).tolist()
    result = _moved(step, 0.5, ground={"shape": shape}, initial={"velocity": velocity}, loads=[])
    energy = result.facts["mass"] * SPEED**2 / 2
    return _told(result, energy, pressed=float(result.contact.area.max()))


def resting(step: float = 1e-2, slope: float = 0.5) -> dict[str, Any]:
    """Ten seconds on a slope of 0.5 below the friction of 0.75; the weight grows in the first second."""
    tilt = np.arctan(slope)
    pull = [float(WEIGHT * np.sin(tilt)), 0.0, float(-WEIGHT * np.cos(tilt))]
    gravity = {"kind": "gravity", "acceleration": pull, "history": [[0.0, 0.0], [1.0, 1.0]]}
    result = _moved(step, 10.0, loads=[gravity], ground={"damping": 12600.0})
    x = path(result)
    energy = result.facts["mass"] * WEIGHT * float(np.abs(x[-1]).max())
    return _told(result, energy, creep=float(np.ptp(x[result.times >= 5.0], axis=0).max()), sunk=float(-x[-1, 2]))
