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

from typing import Protocol

import numpy as np

from ancf.material import MooneyRivlin
from ancf.rubber import Six, State, scalars, state

MOST = 25  # iterations
CLOSE = 1e-7  # change of e whose square no longer counts
LEAST = 0.2  # of J^2, that is left by one iteration


class Sums(Protocol):
    """Points by element, as `hyperelastic.Portion` has them; b_k / |g_z|^2 stands for b."""

    volume: np.ndarray

    def moments(self, values: np.ndarray) -> np.ndarray:
        """sum b_k values (4, e) of values (points,)."""

    def second_moments(self, values: np.ndarray) -> np.ndarray:
        """sum b_k b_l values (e, 4, 4)."""

    def bilinear(self, beta: np.ndarray) -> np.ndarray:
        """sum_k b_k beta_k (points,) of beta (4, e)."""


def relaxed(material: MooneyRivlin, C: Six, points: Sums) -> State:
    """State of the strain with its relaxed part; not a number where there is none.

    C: right Cauchy-Green tensor of the displacement, n its third direction; det C, I1 and I2 are linear in C33.
    """
    rest = state(material, C)
    in_plane, area, e, at = C[0] + C[1], rest.cofactor[2], np.zeros_like(points.volume), rest
    for _ in range(MOST):
        inverse = area / at.square
        S, D = normal_stress(at, in_plane, inverse), normal_modulus(material, at, in_plane, inverse)
        weight = points.volume / D
        beta = solved(points.second_moments(weight), points.moments(weight * S - points.volume * e))
        change = np.maximum((points.bilinear(beta) - S) / D, (LEAST - 1) / 2 / inverse)
        e += change
        if not np.abs(change).max() > CLOSE:
            return state(material, (C[0], C[1], C[2] + 2 * e, *C[3:]))
        at = at._replace(**scalars(material, rest.I1 + 2 * e, rest.I2 + 2 * in_plane * e, rest.square + 2 * area * e))
    return state(material, (C[0], C[1], np.full_like(e, np.nan), *C[3:]))


def normal_stress(at: State, in_plane: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """S33; in_plane: C11 + C22, inverse: (C^-1)33."""
    return 2 * at.f1 + 2 * at.f2 * in_plane + at.s * inverse


def normal_modulus(material: MooneyRivlin, at: State, in_plane: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """D = dS33/dE33."""
    c = (4 / 9) * at.f1 * at.I1 + (16 / 9) * at.f2 * at.I2 + material.bulk * (2 * at.square - at.J)
    return inverse * ((c - 2 * at.s) * inverse - (8 / 3) * at.f1 - (16 / 3) * at.f2 * in_plane)


def solved(H: np.ndarray, right: np.ndarray) -> np.ndarray:
    """H^-1 right (4, e) of H (e, 4, 4); not a number where H has no inverse."""
    try:
        return np.linalg.solve(H, right.T[..., None])[..., 0].T
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)
