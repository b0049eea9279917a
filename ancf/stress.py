"""Stress on the surface, as plate theory recovers it: from the strains along the mid-surface, normal stress zero."""

from __future__ import annotations

import numpy as np

from ancf.material import SaintVenantKirchhoff
from ancf.mesh import Mesh
from ancf.outline import Facets

THINNEST = 0.1  # of the thickness: what a stretched plate is taken to keep at least


def von_mises(mesh: Mesh, facets: Facets, vectors: np.ndarray, material: SaintVenantKirchhoff) -> np.ndarray:
    """Von Mises stress (n,) in Pa of the Cauchy stress at the facets' points; vectors (v, 3): the deformed plate.

    A face is free of traction, but a director that is straight in z leaves a normal stress in it: so the second
    Piola-Kirchhoff stress is that of S_33 = S_13 = S_23 = 0 in the frame t_1, t_2 (along the surface at that z),
    t_3. With F_a = F t_a and E_ab = 1/2 (F_a . F_b - delta_ab), a, b = 1, 2:

        S_ab = 2 lam mu / (lam + 2 mu) E_cc delta_ab + 2 mu E_ab,   E_33 = -lam / (lam + 2 mu) E_cc,
        sigma = S_ab F_a F_b / J,   J = |F_1 x F_2| sqrt(1 + 2 E_33)

    Beyond E_cc = (lam + 2 mu) / (2 lam), 0.61 at nu = 0.45, no thickness is left at which S_33 = 0: a St.
    Venant-Kirchhoff solid resists being pressed flat ever less. From THINNEST of the thickness on J is that of
    THINNEST, so that the stress stays a number and grows on with E_ab.
    """
    reference, deformed = _gradients(mesh, facets, mesh.vectors, vectors)
    t = _along(reference)
    F = deformed @ np.linalg.solve(reference, t)
    E = 0.5 * (np.einsum("qia,qib->qab", F, F) - np.eye(2))
    lam, mu = material.lame, material.shear
    trace = np.trace(E, axis1=1, axis2=2)
    S = 2 * lam * mu / (lam + 2 * mu) * trace[:, None, None] * np.eye(2) + 2 * mu * E
    stretch = np.sqrt(np.maximum(1 - 2 * lam / (lam + 2 * mu) * trace, THINNEST**2))
    J = np.linalg.norm(np.cross(F[:, :, 0], F[:, :, 1]), axis=1) * stretch
    sigma = np.einsum("qab,qia,qjb->qij", S, F, F) / J[:, None, None]
    deviator = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.sqrt(1.5 * np.einsum("qij,qij->q", deviator, deviator))


def _gradients(mesh: Mesh, facets: Facets, *fields: np.ndarray) -> list[np.ndarray]:
    """Derivatives (n, 3, 3) by x, y and z in the columns, at the facets' points, of fields of nodal vectors (v, 3)."""
    found = [np.empty((len(facets.points), 3, 3)) for _ in fields]
    order = np.argsort(facets.elements, kind="stable")
    elements, starts = np.unique(facets.elements[order], return_index=True)
    for e, own in zip(elements, np.split(order, starts[1:]), strict=True):
        (x0, x1), (y0, y1) = mesh.cells[e]
        shape, vectors = mesh.element(e)
        S_p = shape.evaluate(facets.points[own] - (x0, y0, 0.0), (x1 - x0, y1 - y0)).S_p
        for values, field in zip(found, fields, strict=True):
            values[own] = np.einsum("qip,ia->qap", S_p, field[vectors])
    return found


def _along(gradient: np.ndarray) -> np.ndarray:
    """Orthonormal vectors t_1, t_2 (n, 3, 2) that span the first two columns of gradients (n, 3, 3)."""
    normal = np.cross(gradient[:, :, 0], gradient[:, :, 1])
    first = gradient[:, :, 0] / np.linalg.norm(gradient[:, :, 0], axis=1)[:, None]
    second = np.cross(normal / np.linalg.norm(normal, axis=1)[:, None], first)
    return np.stack([first, second], axis=-1)
