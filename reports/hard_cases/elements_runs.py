"""Units of the chapter on elements: modes without energy, patches, slender and skewed plates, accuracy and time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.scene import AncfLevel, ReferenceLevel, Scene, load

E, THICKNESS, SIZE = 2.0e6, 0.05, 1.0
EXACT, ENOUGH = (7, 7, 3), (5, 5, 3)
GROOVE = {"name": "middle", "face": "bottom", "along": "x", "across": [0.4, 0.6], "depth": 0.02}
EDGES = ("x0", "x1", "y0", "y1")
# Control points of a unit square whose parameter lines are bent in the plane: degree 1, degree 2, and sheared by 60.
MAPS: dict[str, tuple[int, list]] = {
    "trapezoids": (1, [[[0, 0], [0.2, 1]], [[1, 0.1], [0.7, 0.8]]]),
    "curved lines": (
        2,
        [[[0, 0], [-0.1, 0.5], [0, 1]], [[0.5, 0.1], [0.6, 0.4], [0.5, 0.9]], [[1, 0], [1, 0.6], [1, 1]]],
    ),
    "skewed by 60°": (1, [[[0, 0], [np.sqrt(0.75), 0.5]], [[1, 0], [1 + np.sqrt(0.75), 0.5]]]),
}


def _surface(degree: int, points: Sequence):
    """Flat NURBS surface over the unit square of parameters."""
    from ancf.nurbs import Surface

    flat = [[[*point, 0.0] for point in row] for row in points]
    knots = [0.0] * (degree + 1) + [1.0] * (degree + 1)
    return Surface((degree, degree), (knots, knots), flat)


def _stiffness(plate, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Tangent (3 v, 3 v) of the undeformed plate, and the lengths (3 v,) that make its gradients comparable."""
    from ancf.system import system

    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), thickness)
    K = acting.assembly.pattern.full(acting.tangent(plate.mesh.vectors.ravel())).toarray()
    return K, acting.lengths


def modes(element: str) -> dict[str, Any]:
    """Eigenvalues of the stiffness of one element and of 3x2 unequal ones: how many are zero, and the next one."""
    from ancf.material import from_engineering
    from ancf.mesh import grid
    from ancf.shape import FAMILY
    from ancf.subdomain import BOTTOM, GROOVE, TOP, Band
    from ancf.system import body

    bands = (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 0.03), Band(TOP, GROOVE, 1, (0.35, 0.5), 0.015))
    meshes = {"one element": ([0, 1.2], [0, 0.6]), "3x2 elements": ([0, 0.3, 0.7, 1.2], [0, 0.25, 0.6])}
    rows = []
    for plate_name, own in (("plain", ()), ("two grooves", bands)):
        for mesh_name, lines in meshes.items():
            mesh = grid(*map(np.array, lines), shape=FAMILY[element])
            plate = body(mesh, own, THICKNESS, from_engineering(E, 0.3), 1.0, EXACT, free=EDGES)
            K, lengths = _stiffness(plate, THICKNESS)
            found = np.linalg.eigvalsh(K / np.outer(lengths, lengths)) / np.abs(K / np.outer(lengths, lengths)).max()
            rows.append({"plate": plate_name, "mesh": mesh_name, "zero": int(np.sum(found < 1e-11))})
            rows[-1] |= {"round_off": float(np.abs(found[:6]).max()), "least": float(found[6])}
    return {"rows": rows}


def patches(element: str, ratios: Sequence[float]) -> dict[str, Any]:
    """Energy over the exact one on 3x3 distorted elements whose boundary alone is held in a known state.

    Small displacements: stretching u = (x, 0) / 1000 (uniaxial stress) and bending w = x^2 / 2 + xy with the
    director -grad w, whose energy is that of Kirchhoff's plate.
    """
    return {
        "rows": [
            {"map": name, "state": state, "nu": nu, "energy": _patch(element, name, state, nu)}
            for name in MAPS
            for state in ("stretch", "bend")
            for nu in ratios
        ]
    }


def _patch(element: str, name: str, state: str, nu: float) -> float:
    from ancf.material import from_engineering
    from ancf.mesh import grid
    from ancf.shape import FAMILY
    from ancf.system import body

    surface, lines = _surface(*MAPS[name]), np.linspace(0, 1, 4)
    mesh = grid(lines, lines, surface, FAMILY[element])
    plate = body(mesh, (), THICKNESS, from_engineering(E, nu), 1.0, EXACT)
    u = _stretched(mesh, nu) if state == "stretch" else _bent(mesh, surface)
    x, y = mesh.parameters.T
    on_edge = (x == 0) | (x == 1) | (y == 0) | (y == 1)
    K, _ = _stiffness(plate, THICKNESS)
    u, inner = u.ravel(), np.repeat(~on_edge, 3)
    u[inner] = np.linalg.solve(K[np.ix_(inner, inner)], -K[np.ix_(inner, ~inner)] @ u[~inner])
    area = plate.volume / THICKNESS
    exact = E * THICKNESS / 2 if state == "stretch" else E * THICKNESS**3 / (24 * (1 - nu**2)) * (1 + 2 * (1 - nu))
    return float(u @ K @ u / 2 / (exact * area))


def _stretched(mesh, nu: float) -> np.ndarray:
    """Nodal displacements (v, 3) of uniaxial stress along X with unit strain."""
    return mesh.vectors * [1.0, -nu, -nu]


def _bent(mesh, surface) -> np.ndarray:
    """Nodal displacements (v, 3) of w = X^2 / 2 + X Y with the director -grad w."""
    from ancf.nurbs import surface_derivatives

    found, kinds = np.zeros(mesh.vectors.shape), mesh.kinds
    s = surface_derivatives(surface, *mesh.parameters.T)
    slope = np.stack([s.s[:, 0] + s.s[:, 1], s.s[:, 0]], axis=1)
    twist = s.s_u[:, 0] * s.s_v[:, 0] + s.s_u[:, 0] * s.s_v[:, 1] + s.s_u[:, 1] * s.s_v[:, 0]
    values = {
        "r": s.s[:, 0] ** 2 / 2 + s.s[:, 0] * s.s[:, 1],
        "r_x": np.sum(slope * s.s_u[:, :2], axis=1),
        "r_y": np.sum(slope * s.s_v[:, :2], axis=1),
        "r_xy": twist + np.sum(slope * s.s_uv[:, :2], axis=1),
    }
    for kind, value in values.items():
        found[kinds == kind, 2] = value[kinds == kind]
    found[kinds == "r_z", :2] = -slope[kinds == "r_z"]
    middle = np.flatnonzero(kinds == "d_e")
    ends = [_slopes(surface, mesh, middle, end) for end in (-1, 1)]
    found[middle, :2] = -(slope[middle] - (ends[0] + ends[1]) / 2)
    return found


def _slopes(surface, mesh, middle: np.ndarray, end: int) -> np.ndarray:
    """Gradient (n, 2) of w at one end of the edges with the given vectors d_e."""
    from ancf.nurbs import surface_derivatives

    at = mesh.parameters[middle].copy()
    along_x = np.abs(at[:, :1] - mesh.x_lines).min(axis=1) > 1e-9
    at[np.arange(len(at)), np.where(along_x, 0, 1)] += end / 6
    point = surface_derivatives(surface, *at.T).s
    return np.stack([point[:, 0] + point[:, 1], point[:, 0]], axis=1)


def slender(element: str, cases: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Tip of a clamped strip over Timoshenko's, end load, nu = 0: (thickness, width, elements along x) each.

    Small displacements, from the stiffness of the undeformed strip: no tolerance of Newton's method has a part.
    """
    return {"rows": [_strip(element, *case) for case in cases]}


def _strip(element: str, thickness: float, width: float, n: float) -> dict[str, Any]:
    from scipy.sparse.linalg import spsolve

    from ancf.unpack import build

    scene = load("rounded_groove").override(
        {
            "grooves": [],
            "surface.width": float(width),
            "thickness": float(thickness),
            "loads.0.force": [0.0, 0.0, -1.0],
            "probes": [{"name": "P", "at": [1.0, width / 2, 0.0]}],
        }
    )
    model = build(scene, AncfLevel(element=element, mesh=(int(n), 1), points=EXACT, time_step=0.5))
    acting, u = model.system, np.zeros(model.mesh.vectors.size)
    K = acting.assembly.pattern.full(acting.tangent(model.mesh.vectors.ravel())).tocsc()
    u[acting.assembly.free] = spsolve(K, acting.force_external(1.0))
    factor = 5 / 6 if element == "enriched" else 1.0
    exact = 4 / (E * width * thickness**3) + 2 / (factor * E * width * thickness)
    tip = -float(model.probes[0] @ u.reshape(-1, 3)[:, 2])
    return {"thickness": thickness, "width": width, "mesh": f"{int(n)}x1", "ratio": tip / exact}


def plate(kind: str, nu: float, mode: str) -> Scene:
    """The patch-loaded cantilever: "plain" or "groove", "static" or "dynamic"."""
    changes: dict[str, Any] = {"material.poissons_ratio": float(nu)}
    if kind == "groove":
        changes["grooves"] = [GROOVE]
    if mode == "static":
        changes |= {"analysis.kind": "static", "analysis.every": 1.0}
    return load("cantilever_plain_patch").override(changes)


STEP = {"static": 0.25, "dynamic": 0.02}


def heights(
    element: str,
    kind: str,
    nu: float,
    mode: str,
    meshes: Sequence[int],
    enrich: float | None = None,
    repeats: int = 1,
) -> dict[str, Any]:
    """Height (m) of the patch, unknowns and least CPU seconds of `repeats` runs, mesh by mesh."""
    from ancf.run import solve

    scene, rows = plate(kind, nu, mode), []
    for n in meshes:
        level = AncfLevel(element=element, mesh=(n, n), points=ENOUGH, time_step=STEP[mode], enrich=enrich)
        results = [solve(scene, level) for _ in range(repeats)]
        z = float(results[0].position("P")[-1, 2]) if results[0].status == "ok" else None
        row = {"mesh": n, "h": 1 / n, "height": z, "unknowns": results[0].unknowns, "status": results[0].status}
        rows.append(row | {"cpu_seconds": min(result.cpu_seconds for result in results)})
    return {"rows": rows}


X_LINES, Y_LINES = (0, 0.25, 0.5, 0.75, 0.93, 1), (0, 0.07, 0.3, 0.5, 0.7, 0.93, 1)


def graded(mode: str, force: float, halvings: int) -> dict[str, Any]:
    """Heights (m) of the plain plate, nu = 0, on X_LINES and Y_LINES, graded towards the free edges, halved again.

    force (N) on the patch. The enriched element; time steps as in `heights`.
    """
    rows, x, y = [], np.array(X_LINES, dtype=float), np.array(Y_LINES, dtype=float)
    for k in range(halvings + 1):
        rows.append({"h": 2.0**-k, "mesh": f"{len(x) - 1}x{len(y) - 1}", **_graded(mode, force, x, y)})
        x, y = (np.sort(np.r_[lines, (lines[1:] + lines[:-1]) / 2]) for lines in (x, y))
    return {"rows": rows}


def _graded(mode: str, force: float, x: np.ndarray, y: np.ndarray) -> dict[str, Any]:
    from ancf.functional import mean_over_region
    from ancf.integrate import SCHEMES, advance, initial_state
    from ancf.linear_solver import LinearSolver
    from ancf.loads import spread
    from ancf.material import from_engineering
    from ancf.mesh import grid
    from ancf.newton import equilibrium
    from ancf.shape import FAMILY
    from ancf.supports import clamp, free_edges
    from ancf.system import body, system

    mesh = grid(x, y, shape=FAMILY["enriched"])
    held = clamp(mesh, "x0", "tangential")
    plate = body(mesh, (), THICKNESS, from_engineering(E, 0.0), 2000.0, EXACT, free=free_edges(mesh, held))
    row = mean_over_region(mesh, (), THICKNESS, ((0.9, 1.0), (0.9, 1.0)))
    acting = system(plate, held, [spread(row, (0.0, 0.0, -force), ((0.0, 0.0), (1.0, 1.0)))], THICKNESS)
    q, solver = mesh.vectors.ravel().copy(), LinearSolver(acting.assembly.pattern)
    if mode == "static":
        found = equilibrium(acting, solver, q, 0.0, 1.0, STEP[mode])
        q = found.q
    else:
        state = initial_state(acting, solver, q, np.zeros_like(q))
        found = advance(acting, solver, SCHEMES["trapezoidal"], state, 1.0, STEP[mode], None)
        q = found.state.q
    return {"height": float(row @ q.reshape(-1, 3)[:, 2]), "unknowns": acting.unknowns, "status": found.status}


def reference(kind: str, nu: float, mode: str, sizes: Sequence[float]) -> dict[str, Any]:
    """Heights (m) of the reference at each mesh size."""
    from reference_fe.run import solve

    scene, rows = plate(kind, nu, mode), []
    for size in sizes:
        result = solve(scene, ReferenceLevel(size=size, time_step=STEP[mode]))
        z = float(result.position("P")[-1, 2]) if result.status == "ok" else None
        rows.append({"size": size, "height": z, "status": result.status, "cpu_seconds": result.cpu_seconds})
    return {"rows": rows}
