"""What the chapter of the grooves runs: the table's grooves at one level, and extreme grooves."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg

from ancf.run import solve
from ancf.unpack import build
from compare.scene import AncfLevel, ReferenceLevel, Scene, load

SQUARE = {"surface.length": 0.4, "surface.width": 0.4, "loads.0.region": [[0.3, 0.4], [0.3, 0.4]]}
SQUARE |= {"probes.0.region": [[0.3, 0.4], [0.3, 0.4]]}


def table(nu: float, mode: str, **level: Any) -> dict[str, Any]:
    """Height of P (m) of cantilever_patch, whose grooves are the table's, at t = 1 s or in equilibrium."""
    step = 0.25 if mode == "static" else 0.02
    scene = _scene("cantilever_patch", nu, mode)
    return _found(solve(scene, AncfLevel(time_step=step, **level)))


def reference(nu: float, mode: str, size: float) -> dict[str, Any]:
    """The same from the reference."""
    from reference_fe.run import solve as solve_reference

    scene = _scene("cantilever_patch", nu, mode)
    return _found(solve_reference(scene, ReferenceLevel(size=size, time_step=0.25 if mode == "static" else 0.02)))


def _scene(name: str, nu: float, mode: str) -> Scene:
    changes = {"material.poissons_ratio": nu}
    return load(name).override(
        changes | ({"analysis.kind": "static", "analysis.every": 1.0} if mode == "static" else {})
    )


def _found(result) -> dict[str, Any]:
    height = float(result.displacement[-1, 0, 2]) if result.status == "ok" else None
    return {"status": result.status, "height": height, "unknowns": result.unknowns, "cpu_seconds": result.cpu_seconds}


def extreme(width: float, depth: float, at: float, fit: list[float] | None, enrich: float | None) -> dict[str, Any]:
    """A square plate of 4 x 4 elements, 0.4 m wide, with one groove of this width and depth that begins at `at` (m).

    height (m) of the loaded corner; conditions of stiffness and mass with unit diagonals; the least eigenvalue of
    the mass, of unit diagonal too; the largest stable time step (s) of central differences, 2 / omega_max.
    """
    groove = {"name": "g", "face": "bottom", "along": "x", "across": [at, at + width], "depth": depth}
    scene = _scene("cantilever_patch", 0.3, "static").override({**SQUARE, "grooves": [groove]})
    level = AncfLevel(mesh=(4, 4), time_step=0.25, fit=fit, enrich=enrich)
    acting = build(scene, level).system
    pattern = acting.assembly.pattern
    K = pattern.full(acting.tangent(acting.body.mesh.vectors.ravel())).toarray()
    M = pattern.full(acting.mass_values).toarray()
    stiff, heavy = _scaled(K), _scaled(M)
    scale = 1 / np.sqrt(np.diag(M))
    fastest = scipy.linalg.eigh(K * scale * scale[:, None], heavy, eigvals_only=True)[-1]
    k, m = np.linalg.eigvalsh(stiff), np.linalg.eigvalsh(heavy)
    numbers = {"condition_stiffness": k[-1] / k[0], "condition_mass": m[-1] / m[0], "least_mass": m[0]}
    numbers |= {"least_stiffness": k[0], "critical_step": 2 / np.sqrt(fastest)}
    return _found(solve(scene, level)) | {name: float(value) for name, value in numbers.items()}


def _scaled(A: np.ndarray) -> np.ndarray:
    """A with a unit diagonal."""
    scale = 1 / np.sqrt(np.diag(A))
    return A * scale * scale[:, None]
