"""Probes as weights (n,) on the nodal values: the solver evaluates its own field."""

from __future__ import annotations

import numpy as np
from skfem import ElementTetP2

from reference_fe.geometry import MeshError
from reference_fe.mesh import Solid

CANDIDATES = 12
NEWTON_STEPS = 8  # a straight tetrahedron needs one


def point_weights(solid: Solid, at: tuple[float, float, float]) -> np.ndarray:
    """Values of the quadratic shape functions at the box point (x, y, z). Raises MeshError "probe_outside"."""
    tetrahedron, where = _place(solid, at)
    weights = np.zeros(solid.mesh.doflocs.shape[1])
    for a, node in enumerate(solid.mesh.dofs.element_dofs[:, tetrahedron]):
        weights[node] += ElementTetP2().lbasis(where, a)[0][0]
    return weights


def point_slopes(solid: Solid, at: tuple[float, float, float]) -> np.ndarray:
    """Derivatives (3, n) by X, Y, Z of the quadratic shape functions at a box point: F = 1 + sum of u (x) slope."""
    tetrahedron, where = _place(solid, at)
    element, slopes = ElementTetP2(), np.zeros((3, solid.mesh.doflocs.shape[1]))
    inverse = solid.mesh.mapping().invDF(where[:, None, :], np.array([tetrahedron]))[:, :, 0, 0]
    for a, node in enumerate(solid.mesh.dofs.element_dofs[:, tetrahedron]):
        slopes[:, node] += element.lbasis(where, a)[1][:, 0] @ inverse
    return slopes


def _place(solid: Solid, at: tuple[float, float, float]) -> tuple[int, np.ndarray]:
    """The tetrahedron that holds a box point, and its place (3, 1) there. Raises MeshError "probe_outside"."""
    box, point = solid.box, np.asarray(at, dtype=float)
    corners = box.p[:, box.t]
    edges = (corners[:, 1:] - corners[:, :1]).transpose(2, 0, 1)
    local = np.linalg.solve(edges, (point - corners[:, 0].T)[:, :, None])[:, :, 0]
    near = np.argsort(-_depth(local.T))[:CANDIDATES]
    mapping, local = box.mapping(), local[near].T[:, :, None]
    for _ in range(NEWTON_STEPS):
        miss = mapping.F(local, near) - point[:, None, None]
        local = local - np.einsum("ijek,jek->iek", mapping.invDF(local, near), miss)
    local = local[:, :, 0]
    best = int(np.argmax(_depth(local)))
    if not _depth(local)[best] > -1e-6:
        raise MeshError("probe_outside", f"the probe at {tuple(at)} lies outside the grooved solid")
    return int(near[best]), local[:, best, None]


def _depth(local: np.ndarray) -> np.ndarray:
    """How far inside the unit tetrahedron points (3, k) lie: their least barycentric coordinate (k,)."""
    return np.minimum(local.min(axis=0), 1 - local.sum(axis=0))
