"""Stress at the nodes: that of each element's own quadratic field, averaged over the elements that meet there."""

from __future__ import annotations

import numpy as np
from skfem import ElementTetP2

from reference_fe.elasticity import Lame
from reference_fe.mesh import Solid


def von_mises(solid: Solid, displacement: np.ndarray, material: Lame) -> np.ndarray:
    """Von Mises stress (n,) in Pa of the mean Cauchy stress at the nodes; displacement (n, 3) in m.

    sigma = F S F^T / det F with S = lam tr(E) I + 2 mu E and 2 E = F^T F - I.
    """
    element = ElementTetP2()
    nodes = solid.mesh.dofs.element_dofs.T
    slopes = np.stack([element.lbasis(element.doflocs.T, i)[1].T for i in range(10)], axis=1)  # (node, shape, 3)
    points = solid.mesh.doflocs.T
    J, G = (np.einsum("kap,eai->ekip", slopes, field[nodes]) for field in (points, displacement))
    F = np.eye(3) + G @ np.linalg.inv(J)
    E = 0.5 * (F.swapaxes(2, 3) @ F - np.eye(3))
    S = material.lam * np.trace(E, axis1=2, axis2=3)[..., None, None] * np.eye(3) + 2 * material.mu * E
    sigma = F @ S @ F.swapaxes(2, 3) / np.linalg.det(F)[..., None, None]
    mean = np.zeros((len(points), 3, 3))
    np.add.at(mean, nodes, sigma)
    mean /= np.bincount(nodes.ravel(), minlength=len(points))[:, None, None]
    deviator = mean - np.trace(mean, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator))
