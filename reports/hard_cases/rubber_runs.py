"""Units of the chapter on rubber: one plate in both solvers, moving and at rest, and the solid's volumetric split."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.scene import AncfLevel, ReferenceLevel, Scene, load

MU = 2.0e6 / 3  # Pa: as stiff as the table's plate


def bulk(nu: float) -> float:
    """Bulk modulus (Pa) of Poisson's ratio `nu`."""
    return MU * 2 * (1 + nu) / (3 * (1 - 2 * nu))


def plate(nu: float, mode: str) -> Scene:
    """The patch-loaded cantilever of Mooney-Rivlin rubber, 50 N, "static" or "dynamic"; det F at one point too."""
    law = {"kind": "mooney-rivlin", "mu10": 0.45 * MU, "mu01": 0.05 * MU, "bulk_modulus": bulk(nu), "density": 2000.0}
    base = load("cantilever_plain_patch")
    probes = [probe.model_dump(mode="json") for probe in base.probes]
    probes.append({"name": "J", "at": [0.3, 0.5, 0.02], "volume_ratio": True})
    changes: dict[str, Any] = {"material": law, "ancf": None, "probes": probes, "surface_stress": False}
    if mode == "static":
        changes |= {"analysis.kind": "static", "analysis.every": 1.0}
    return base.override(changes)


def heights(nu: float, mode: str, solver: str, levels: Sequence[dict[str, Any]], split: float | None = None) -> dict:
    """Height (m) of the patch and det F at one point, level by level.

    split: of the solid's bulk modulus, how many mu act on det F at each point instead of its mean (None: as shipped).
    """
    if split is not None:
        from reference_fe import rubber

        rubber.SPLIT = split
    question, rows = plate(nu, mode), []
    for level in levels:
        if solver == "ancf":
            from ancf.run import solve

            result = solve(question, AncfLevel(points=(4, 4, 3), **level))
        else:
            from reference_fe.run import solve

            result = solve(question, ReferenceLevel(**level))
        ok = result.status == "ok"
        row = {"height": float(result.position("P")[-1, 2]) if ok else None, "status": result.status}
        rows.append(row | {"J": float(result.volume_ratio[-1, 0]) if ok else None, "unknowns": result.unknowns})
    return {"rows": rows}
