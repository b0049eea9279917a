"""The thickness strain made free at every point: a plate of a nonlinear material without thickness and volume locking.

A director that is straight through the thickness stretches evenly there, but bending asks for a thickness strain
that varies with z (Poisson's effect), and an incompressible material for one at every point that undoes the change
of area. So each point q has a strain e_q of its own along the normal n of the undeformed mid-surface,

    E = E(displacement) + e_q n x n,    sum over q of e_q b_k(s, t) dV / |g_z|^2 = 0,

b_k the four bilinear functions of the element: the director keeps what is bilinear. The multipliers beta_k of these
conditions are the stress normal to the plate: n . S n = sum b_k beta_k / |g_z|^2 at each point, bilinear in the
element and constant through its thickness. These are the enhanced thickness strains of `ancf.enhanced` with as many
modes as points. The e_q belong to their points, the four betas to the element; Newton's method finds both,

    e <- e + (b . beta - n . S n) / D,    D = n n : dS/dE : n n,
    sum b b^T / D dV beta = sum b (n . S n / D - e) dV.

With f = dU/dQ at fixed beta, the tangent is that of the moduli without the normal stress,

    C - (C : n n)(n n : C) / D,    plus    L^T H^-1 L,    L = sum b (n n : C : E_Q) / D dV,  H = sum b b^T / D dV.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ancf.material import MooneyRivlin
from ancf.rubber import Six, State, state, stress

MOST = 25  # iterations
CLOSE = 1e-7  # change of e whose square no longer counts
LEAST = 0.2  # of J^2, that is left by one iteration

Sums = Callable[[np.ndarray], np.ndarray]  # (..., points) -> (..., elements): sums over the points of each element
Spread = Callable[[np.ndarray], np.ndarray]  # (..., elements) -> (..., points)


def relaxed(material: MooneyRivlin, C: Six, b: np.ndarray, volume: np.ndarray, sums: Sums, spread: Spread) -> State:
    """State of the strain with its relaxed part; not a number at the points of an element where there is none.

    C: right Cauchy-Green tensor of the displacement, n its third direction. b (4, points): b_k / |g_z|^2.
    """
    e, C33 = np.zeros_like(volume), C[2]
    for _ in range(MOST):
        at = state(material, (C[0], C[1], C33 + 2 * e, *C[3:]))
        S, D = stress(at)[2], normal_modulus(material, at)
        weight = volume / D
        beta = solved(b, weight, sums, sums(b * (weight * S - volume * e)))
        change = (np.einsum("kq,kq->q", b, spread(beta)) - S) / D
        least = (LEAST - 1) * at.square / (2 * at.cofactor[2])
        e = e + np.maximum(change, least)
        size = np.abs(change)
        if not size.max() > CLOSE:
            return state(material, (C[0], C[1], C33 + 2 * e, *C[3:]))
    lost = spread(sums((size > CLOSE).astype(float))) > 0
    return state(material, (C[0], C[1], np.where(lost, np.nan, C33 + 2 * e), *C[3:]))


def normal_modulus(material: MooneyRivlin, at: State) -> np.ndarray:
    """D = dS33/dE33."""
    inverse = at.cofactor[2] / at.square
    c = (4 / 9) * at.f1 * at.I1 + (16 / 9) * at.f2 * at.I2 + material.bulk * (2 * at.square - at.J)
    in_plane = at.C[0] + at.C[1]  # I1 - C33
    return inverse * ((c - 2 * at.s) * inverse - (8 / 3) * at.f1 - (16 / 3) * at.f2 * in_plane)


def small_matrix(b: np.ndarray, weight: np.ndarray, sums: Sums) -> np.ndarray:
    """H = sum b b^T weight (elements, 4, 4)."""
    first, second = np.triu_indices(len(b))
    H = np.empty((sums(weight).shape[-1], len(b), len(b)))
    H[:, first, second] = H[:, second, first] = sums(b[first] * b[second] * weight).T
    return H


def solved(b: np.ndarray, weight: np.ndarray, sums: Sums, right: np.ndarray) -> np.ndarray:
    """H^-1 right (4, elements); not a number where H has no inverse."""
    H = small_matrix(b, weight, sums)
    finite = np.isfinite(H).all(axis=(1, 2)) & np.isfinite(right).all(axis=0)
    safe = np.where(finite[:, None, None], H, np.eye(len(b)))
    try:
        x = np.linalg.solve(safe, right.T[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)
    return np.where(finite[:, None], x, np.nan).T
