"""Cook's rubber membrane on bricks, one through the thickness: what the program behind a published table solves.

The table of deal.II's code gallery (Pelteret, McBride, Quasi-Static Finite-Strain Compressible Elasticity, 2016)
speaks of plane strain. Its program looks for the faces to hold at |x| = 0.5 mm, where |z| = 0.5 mm is meant, so no face
is held; and it prints the upper corner of the loaded edge. This module solves the same bricks with those faces free or
held. It shares nothing with either solver but scikit-fem's shape functions; the law is

    W = mu/2 (I1 J^(-2/3) - 3) + U(J),   U = k/4 (J² - 1 - 2 ln J) (the gallery's) or k/2 (J - 1)² (ours),
    P = W_F = mu J^(-2/3) (F - I1/3 H) + J U' H,   H = F^-T,

with the tangent that follows from dH = -H dFᵀ H and dJ = J H : dF (Holzapfel, Nonlinear Solid Mechanics, 6.4).
Letters: e brick, q point, a b shape function, i k component, J L reference direction.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementHex2, FacetBasis, LinearForm, MeshHex

from reports.hard_cases.benchmark_rubber import COOK

MU, BULK = 2 * COOK["mu10"], COOK["bulk_modulus"]  # MPa
FORCE, EDGE, STEPS = 1.0, 16.0, 10  # N, mm, equal parts of the load
ENOUGH, MOST = 1e-9, 20  # residual over the load at which an iteration ends; iterations
BRICKS = {1: ElementHex1, 2: ElementHex2}
SLOPES = {
    "gallery": lambda J: (BULK / 2 * (J - 1 / J), BULK / 2 * (1 + 1 / J**2)),
    "ours": lambda J: (BULK * (J - 1), BULK),
}
"""U' and U'' (MPa) at the volume ratio J."""


def membrane(elements: int) -> MeshHex:
    """`elements` a side of the quadrilateral (0, 0), (48, 44), (48, 60), (0, 44), one in z from -0.5 to 0.5 (mm)."""
    lines = np.linspace(0.0, 1.0, elements + 1)
    square = MeshHex.init_tensor(lines, lines, np.array([-0.5, 0.5]))
    x, y, z = square.p
    return MeshHex(np.stack([48 * x, 44 * x + y * (44 - 28 * x), z]), square.t)


def stress(F: np.ndarray, law: str) -> tuple[np.ndarray, np.ndarray]:
    """P (e, q, i, J) in MPa and its derivative by F (e, q, i, J, k, L)."""
    H, J, I1 = np.swapaxes(np.linalg.inv(F), -1, -2), np.linalg.det(F)[..., None, None], np.sum(F * F, (-1, -2))
    slope, curve = SLOPES[law](J)
    I1, weak = I1[..., None, None], MU * J ** (-2 / 3)
    P = weak * (F - I1 / 3 * H) + J * slope * H

    def outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.einsum("eqiJ,eqkL->eqiJkL", a, b)

    turned = np.einsum("eqiL,eqkJ->eqiJkL", H, H)
    same = np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
    A = weak[..., None, None] * (same + (I1 / 3)[..., None, None] * turned) - outer(2 / 3 * weak * H, F)
    A += outer(-2 / 3 * weak * (F - I1 / 3 * H) + J * (slope + J * curve) * H, H)
    return P, A - (J * slope)[..., None, None] * turned


def solve(elements: int, degree: int, faces: str, law: str) -> dict[str, Any]:
    """Displacement (mm) of the loaded edge's upper corner and middle at z = 0.5 under the full load, as `run` has it.

    degree: 1 or 2, of the bricks. faces: "free" or "held" (in z, at z = -0.5 and 0.5). law: a key of SLOPES.
    """
    mesh, brick = membrane(elements), BRICKS[degree]()
    basis = Basis(mesh, brick, intorder=2 * degree + 1)
    edge = FacetBasis(mesh, brick, intorder=2 * degree + 1, facets=mesh.facets_satisfying(lambda x: x[0] > 48 - 1e-9))
    load = np.zeros((basis.N, 3))
    load[:, 1] = LinearForm(lambda v, w: FORCE / EDGE * v).assemble(edge)
    free = np.ones((basis.N, 3), dtype=bool)
    free[basis.doflocs[0] < 1e-9] = False
    if faces == "held":
        free[np.abs(basis.doflocs[2]) > 0.5 - 1e-9, 2] = False
    u, status = _equilibrium(basis, law, load, free)
    places = {"corner": [48.0, 60.0, 0.5], "middle": [48.0, 52.0, 0.5]}
    found = (basis.probes(np.array(list(places.values())).T) @ u).tolist()
    moves = {name: [move] for name, move in zip(places, found, strict=True)} if status == "ok" else {}
    return {"status": status, "moves": moves, "places": places, "unknowns": u.size}


def _equilibrium(basis: Basis, law: str, load: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, str]:
    """Displacements (n, 3) after STEPS equal parts of the load, by Newton's method."""
    g = np.stack([function[0].grad for function in basis.basis])  # a, J, e, q
    g = np.ascontiguousarray(g.transpose(2, 3, 0, 1))
    u = np.zeros((basis.N, 3))
    for part in np.arange(1, STEPS + 1) / STEPS:
        for _ in range(MOST):
            force, K = _assembled(basis, g, u, law)
            rest = (part * load - force)[free]
            if np.abs(rest).max() <= ENOUGH * np.abs(load).max():
                break
            u[free] += splu(K[free.ravel()][:, free.ravel()].tocsc()).solve(rest)
        else:
            return u, "no_convergence"
    return u, "ok"


def _assembled(basis: Basis, g: np.ndarray, u: np.ndarray, law: str) -> tuple[np.ndarray, csc_matrix]:
    """Force (n, 3) and tangent (3 n, 3 n) at the displacements u; g: gradients (e, q, a, J)."""
    nodes = basis.element_dofs.T
    F = np.einsum("eai,eqaJ->eqiJ", u[nodes], g) + np.eye(3)
    P, A = stress(F, law)
    f = np.einsum("eq,eqiJ,eqaJ->eai", basis.dx, P, g, optimize=True)
    half = np.einsum("eq,eqiJkL,eqbL->eqiJbk", basis.dx, A, g, optimize=True)
    K = np.einsum("eqaJ,eqiJbk->eaibk", g, half, optimize=True)
    force, size = np.zeros_like(u), u.size
    np.add.at(force, nodes, f)
    rows = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    n = rows.shape[1]
    pairs = (np.repeat(rows, n, axis=1).ravel(), np.tile(rows, n).ravel())
    return force, csc_matrix((K.reshape(len(nodes), n, n).ravel(), pairs), shape=(size, size))
