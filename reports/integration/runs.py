"""Units of the integration study: matrices of one element by both rules, and volumes against the solid of OCC."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import numpy as np

from reports.integration import cases

DENSITY = 1500.0
UNIT = ((0.0, 1.0), (0.0, 1.0))
ALONG = 4  # points along x at least: exact for the product of two cubic functions
THROUGH = 2  # points through the thickness: exact in z for mass and stiffness of a field linear in z
FINE = 9  # points of the subdomain rule that stands for the limit
REPEATS = 3
VOLUME_POINTS = (4, 7, THROUGH)  # as many along y as a level has that names none
PORTION = 4096


def matrices(case: str, subdomain: list[int], whole: list[int]) -> dict[str, Any]:
    """Rows {rule, count, points, seconds, mass_norm, mass_error, stiffness_norm, stiffness_error} of a case.

    subdomain, whole: Gauss points along y (along x at least ALONG) of the subdomain and of the global rule. points: in
    the plane.
    Errors are norms of the difference to the subdomain rule of FINE points over the norm of that.
    """
    bands, thickness = _bands(case)
    limit = _matrices(bands, thickness, FINE, "subdomain")[:2]
    rows = []
    for rule, counts in (("subdomain", subdomain), ("global", whole)):
        for count in counts:
            *found, points, seconds = _matrices(bands, thickness, count, rule)
            row = {"case": case, "rule": rule, "count": count, "points": points, "seconds": seconds}
            for word, matrix, exact in zip(("mass", "stiffness"), found, limit, strict=True):
                row[f"{word}_norm"] = float(np.linalg.norm(matrix))
                row[f"{word}_error"] = float(np.linalg.norm(matrix - exact) / np.linalg.norm(exact))
            rows.append(row)
    return {"rows": rows}


def _bands(case: str) -> tuple[tuple, float]:
    from ancf.unpack import bands_of

    scene = cases.scene(case)
    return bands_of(scene), scene.thickness


def _matrices(bands, thickness: float, count: int, rule: str) -> tuple[np.ndarray, np.ndarray, int, float]:
    """Mass (48, 48), stiffness at rest (48, 48), points in the plane, and CPU seconds, least of REPEATS."""
    seconds = []
    for _ in range(REPEATS if count < FINE or rule == "global" else 1):
        begin = time.process_time()
        mass, stiffness, points = _integrated(bands, thickness, count, rule)
        seconds.append(time.process_time() - begin)
    return mass, stiffness, points, min(seconds)


def _integrated(bands, thickness: float, count: int, rule: str) -> tuple[np.ndarray, np.ndarray, int]:
    from ancf.element import integrand, mass
    from ancf.material import from_engineering
    from ancf.mesh import grid
    from ancf.shape import CONFORMING
    from ancf.subdomain import element_rule

    plate = grid([0.0, 1.0], [0.0, 1.0], None, CONFORMING)
    vectors = plate.vectors[plate.connectivity[0]]
    points = element_rule(UNIT, bands, thickness, (max(count, ALONG), count, THROUGH), rule)
    parts = integrand(CONFORMING, points, UNIT, vectors)
    M = np.kron(mass(parts, DENSITY), np.eye(3))
    C = from_engineering(2.0e6, 0.3).tangent(np.zeros((3, 3))).reshape(9, 9)
    F = np.einsum("ic,qip->qcp", vectors, parts.G)
    K = np.zeros((3 * len(vectors),) * 2)
    for start in range(0, len(parts.volume), PORTION):
        own = slice(start, start + PORTION)
        E_q = np.einsum("qap,qir->qpria", F[own], parts.G[own])
        E_q = ((E_q + E_q.swapaxes(1, 2)) / 2).reshape(-1, 9, K.shape[0])
        weighted = (C @ E_q) * parts.volume[own, None, None]
        K += E_q.reshape(-1, K.shape[0]).T @ weighted.reshape(-1, K.shape[0])
    return M, K, len(points.weights) // THROUGH


def volumes(case: str, meshes: list[int]) -> dict[str, Any]:
    """Volume, void ratio and the largest differences of volume, centroid and inertia to the solid that OCC cuts."""
    from ancf.subdomain import element_rule
    from reference_fe.geometry import moments, session
    from reference_fe.unpack import mid_surface, plate_of

    scene, (bands, thickness) = cases.scene(case), _bands(case)
    with session() as gmsh:
        volume, centroid, inertia = moments(gmsh, plate_of(scene, *mid_surface(scene)))
    found = []
    for n in meshes:
        sides = list(pairwise(np.linspace(0, 1, n + 1)))
        cells = [(x, y) for x in sides for y in sides]
        rules = [element_rule(cell, bands, thickness, VOLUME_POINTS) for cell in cells]
        weights, points = (np.concatenate([getattr(rule, name) for rule in rules]) for name in ("weights", "points"))
        own = weights.sum()
        centre = weights @ points / own
        second = np.einsum("q,qi,qj->ij", weights, points - centre, points - centre)
        turned = np.trace(second) * np.eye(3) - second
        found.append(
            [
                abs(own / volume - 1),
                float(np.abs(centre - centroid).max()),
                float(np.abs(turned - inertia).max() / np.abs(inertia).max()),
            ]
        )
    worst = np.max(found, axis=0)
    depth = max((getattr(band, "depth", None) or 0.0 for band in scene.grooves), default=0.0)
    return {
        "volume": float(own),
        "solid": volume,
        "void": float((thickness - own) / depth) if scene.tread else None,
        "stated_void": scene.tread.void if scene.tread else None,
        "grooves": len(scene.grooves),
        "volume_error": float(worst[0]),
        "centroid_error": float(worst[1]),
        "inertia_error": float(worst[2]),
    }
