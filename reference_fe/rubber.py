"""Mooney-Rivlin solids on quadratic tetrahedra, in terms of the deformation gradient F.

With J = det F, its derivative c = cof F, C = FᵀF, I1 = F : F, I2 = (I1² - C : C) / 2 and G = I1 F - F C = I2_F / 2,

    W = mu10 (I1 J^(-2/3) - 3) + mu01 (I2 J^(-4/3) - 3) + k/2 (J - 1)²,
    P = W_F = a F + b G + s c,    a = 2 mu10 J^(-2/3),  b = 2 mu01 J^(-4/3),  s = W_J at fixed I1, I2,
    W_FF = a I + b G_F + s c_F - 2/3 a/J (F x c + c x F) - 4/3 b/J (G x c + c x G) + W_JJ c x c,

the force of node a is ∫ P g_a dV and the tangent of nodes a, b ∫ g_a . W_FF . g_b dV, g_a the gradient of shape
function a in the reference configuration (Bonet, Wood, Nonlinear Continuum Mechanics for FEA, sections 6.4 to 6.6).

Quadratic tetrahedra lock as k / mu grows: J at all points of an element asks too much of its nodes. So only SPLIT mu of
the bulk modulus acts on J at the points; the rest acts on its mean J' over each tetrahedron,

    k_point/2 ∫ (J - 1)² dV + k_mean/2 (J' - 1)² V,    k_point + k_mean = k.

All of k on the mean (P2-P0, stable; Boffi, Brezzi, Fortin 2013, section 8.6) is too soft in bending, where one pressure
per element misses what is linear through the thickness: 30 % on two elements. Rubber of k < SPLIT mu is not split.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import csr_matrix
from skfem import Basis, BilinearForm, LinearForm
from skfem.helpers import ddot, det, eye, grad, identity, inv, mul, trace, transpose

from reference_fe.kernel import FAST, _displacement_gradient, _gather, _scatter, inlined

SPLIT = 20.0


@dataclass(frozen=True)
class MooneyRivlin:
    """Constants mu10 and mu01, and the bulk moduli k_point and k_mean (Pa)."""

    mu10: float
    mu01: float
    k_point: float
    k_mean: float = 0.0

    @property
    def mu(self) -> float:
        """Shear modulus (Pa) at rest."""
        return 2 * (self.mu10 + self.mu01)


def mooney_rivlin(mu10: float, mu01: float, bulk: float) -> MooneyRivlin:
    """The material with its bulk modulus (Pa) split."""
    k_point = min(bulk, SPLIT * 2 * (mu10 + mu01))
    return MooneyRivlin(mu10, mu01, k_point, bulk - k_point)


@inlined
def _cofactor(F, c):
    """Fill c (3, 3) with the cofactors of F; returns det F."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for p in range(3):
            q, r = (p + 1) % 3, (p + 2) % 3
            c[i, p] = F[j, q] * F[k, r] - F[j, r] * F[k, q]
    return F[0, 0] * c[0, 0] + F[0, 1] * c[0, 1] + F[0, 2] * c[0, 2]


@inlined
def _kinematics(gradient, u, F, c, G):
    """Fill F, c and G (3, 3) at one point; returns J, I1, I2."""
    _displacement_gradient(gradient, u, F)
    for i in range(3):
        F[i, i] += 1.0
    J = _cofactor(F, c)
    I1 = square = 0.0
    for p in range(3):
        for r in range(3):
            product = F[0, p] * F[0, r] + F[1, p] * F[1, r] + F[2, p] * F[2, r]
            square += product * product
            if p == r:
                I1 += product
    for i in range(3):
        for p in range(3):
            G[i, p] = I1 * F[i, p]
            for r in range(3):
                G[i, p] -= F[i, r] * (F[0, r] * F[0, p] + F[1, r] * F[1, p] + F[2, r] * F[2, p])
    return J, I1, 0.5 * (I1 * I1 - square)


@inlined
def _mean_ratio(gradient, weight, u, F, c):
    """Mean of det F over an element, and its volume: gradient (q, 10, 3), weight (q,)."""
    deformed = volume = 0.0
    for q in range(weight.shape[0]):
        _displacement_gradient(gradient[q], u, F)
        for i in range(3):
            F[i, i] += 1.0
        deformed += weight[q] * _cofactor(F, c)
        volume += weight[q]
    return deformed / volume, volume


@njit(cache=True, fastmath=FAST)
def add_force(nodes, gradient, weight, mu10, mu01, k_point, k_mean, displacement, force):
    """Add the internal force to `force` (n, 3); returns the strain energy."""
    F, c, G, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    u, f = np.empty((10, 3)), np.empty((10, 3))
    energy = 0.0
    for e in range(nodes.shape[0]):
        _gather(displacement, nodes[e], u)
        f[:] = 0.0
        mean, volume = _mean_ratio(gradient[e], weight[e], u, F, c) if k_mean else (1.0, 1.0)
        energy += k_mean / 2 * (mean - 1) ** 2 * volume
        for q in range(weight.shape[1]):
            g, w = gradient[e, q], weight[e, q]
            J, I1, I2 = _kinematics(g, u, F, c, G)
            first, second = mu10 * J ** (-2 / 3), mu01 * J ** (-4 / 3)
            energy += w * (first * I1 + second * I2 - 3 * (mu10 + mu01) + k_point / 2 * (J - 1) ** 2)
            s = k_point * (J - 1) + k_mean * (mean - 1) - (2 / 3 * first * I1 + 4 / 3 * second * I2) / J
            for i in range(3):
                for p in range(3):
                    P[i, p] = w * (2 * first * F[i, p] + 2 * second * G[i, p] + s * c[i, p])
            for a in range(10):
                for i in range(3):
                    f[a, i] += P[i, 0] * g[a, 0] + P[i, 1] * g[a, 1] + P[i, 2] * g[a, 2]
        for a in range(10):
            for i in range(3):
                force[nodes[e, a], i] += f[a, i]
    return energy


@inlined
def _moduli(mu10, mu01, bulk, pressure, J, I1, I2, F, c, G, A):
    """Fill A (3, 3, 3, 3) = W_FF; the volumetric energy has the derivatives `pressure` and `bulk` by J."""
    first, second = mu10 * J ** (-2 / 3), mu01 * J ** (-4 / 3)
    s = pressure - (2 / 3 * first * I1 + 4 / 3 * second * I2) / J
    s_J = bulk + (10 / 9 * first * I1 + 28 / 9 * second * I2) / (J * J)
    a_J, b_J = -4 / 3 * first / J, -8 / 3 * second / J
    for i in range(3):
        for p in range(3):
            for j in range(3):
                for r in range(3):
                    value = s_J * c[i, p] * c[j, r] + a_J * (F[i, p] * c[j, r] + c[i, p] * F[j, r])
                    value += b_J * (G[i, p] * c[j, r] + c[i, p] * G[j, r])
                    value += 2 * second * (2 * F[i, p] * F[j, r] - F[i, r] * F[j, p])
                    if i != j and p != r:
                        sign = 1.0 if (j - i) % 3 == (r - p) % 3 else -1.0
                        value += s * sign * F[3 - i - j, 3 - p - r]
                    if i == j:
                        C_pr = F[0, p] * F[0, r] + F[1, p] * F[1, r] + F[2, p] * F[2, r]
                        value -= 2 * second * C_pr
                    if p == r:
                        b_ij = F[i, 0] * F[j, 0] + F[i, 1] * F[j, 1] + F[i, 2] * F[j, 2]
                        value -= 2 * second * b_ij
                        if i == j:
                            value += 2 * first + 2 * second * I1
                    A[i, p, j, r] = value


@njit(cache=True, fastmath=FAST)
def add_tangent(
    nodes, gradient, weight, mu10, mu01, k_point, k_mean, displacement, factor, number, indptr, slot, values
):
    """Add factor x tangent to the upper-triangle CSR values."""
    F, c, G = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    A, D = np.empty((3, 3, 3, 3)), np.empty((3, 3, 3))
    u, f = np.empty((10, 3)), np.empty((10, 3))
    K = np.empty((10, 10, 3, 3))
    for e in range(nodes.shape[0]):
        _gather(displacement, nodes[e], u)
        K[:] = 0.0
        f[:] = 0.0
        mean, volume = _mean_ratio(gradient[e], weight[e], u, F, c) if k_mean else (1.0, 1.0)
        for q in range(weight.shape[1]):
            g, w = gradient[e, q], factor * weight[e, q]
            J, I1, I2 = _kinematics(g, u, F, c, G)
            pressure = k_point * (J - 1) + k_mean * (mean - 1)
            _moduli(mu10, mu01, k_point, pressure, J, I1, I2, F, c, G, A)
            for a in range(10):
                for i in range(3):
                    f[a, i] += w * (c[i, 0] * g[a, 0] + c[i, 1] * g[a, 1] + c[i, 2] * g[a, 2])
                    for j in range(3):
                        for r in range(3):
                            D[i, j, r] = w * (
                                g[a, 0] * A[i, 0, j, r] + g[a, 1] * A[i, 1, j, r] + g[a, 2] * A[i, 2, j, r]
                            )
                for d in range(a, 10):
                    for i in range(3):
                        for j in range(3):
                            K[a, d, i, j] += D[i, j, 0] * g[d, 0] + D[i, j, 1] * g[d, 1] + D[i, j, 2] * g[d, 2]
        scale = k_mean / (volume * factor)
        for a in range(10):
            for d in range(a, 10):
                for i in range(3):
                    for j in range(3):
                        K[a, d, i, j] += scale * f[a, i] * f[d, j]
                if slot[e, a, d] >= 0:
                    _scatter(K[a, d], False, number[nodes[e, a]], slot[e, a, d], indptr, values)
                elif slot[e, d, a] >= 0:
                    _scatter(K[a, d], True, number[nodes[e, d]], slot[e, d, a], indptr, values)


def forces_by_forms(basis: Basis, material: MooneyRivlin, displacement: np.ndarray) -> np.ndarray:
    """The internal force (3 n,) again, as a scikit-fem form of the second Piola-Kirchhoff stress, without k_mean."""

    @LinearForm
    def force(v, w):
        F, S = _stress(w["u"], material)[:2]
        return ddot(mul(F, S), grad(v))

    return force.assemble(basis, u=basis.interpolate(displacement.ravel()))


def tangent_by_forms(basis: Basis, material: MooneyRivlin, displacement: np.ndarray) -> csr_matrix:
    """The tangent (3 n, 3 n) again, as a scikit-fem form, without k_mean."""

    @BilinearForm
    def stiffness(u, v, w):
        F, S, C, Ci, (f1, f2, s, s_J) = _stress(w["u"], material)
        dC = mul(transpose(F), grad(u)) + mul(transpose(grad(u)), F)
        relative = ddot(Ci, dC) / 2  # dJ / J
        dI1, one = trace(dC), identity(grad(u))
        dI2 = trace(C) * dI1 - ddot(C, dC)
        df1, df2 = -2 / 3 * f1 * relative, -4 / 3 * f2 * relative
        ds = s_J * relative - 2 / 3 * f1 * dI1 - 4 / 3 * f2 * dI2
        dS = 2 * (df1 + df2 * trace(C) + f2 * dI1) * one - 2 * df2 * C - 2 * f2 * dC
        dS = dS + ds * Ci - s * mul(Ci, mul(dC, Ci))
        return ddot(mul(grad(u), S) + mul(F, dS), grad(v))

    return stiffness.assemble(basis, u=basis.interpolate(displacement.ravel()))


def _stress(u, material: MooneyRivlin):
    """F, S, C, C^-1, and f1, f2, s, s_J of a displacement field, in scikit-fem's notation."""
    H = grad(u)
    F = H + identity(H)
    C = mul(transpose(F), F)
    J, I1, Ci = det(F), trace(C), inv(C)
    I2 = (I1**2 - ddot(C, C)) / 2
    f1, f2 = material.mu10 * J ** (-2 / 3), material.mu01 * J ** (-4 / 3)
    s = -2 / 3 * f1 * I1 - 4 / 3 * f2 * I2 + material.k_point * J * (J - 1)
    s_J = 4 / 9 * f1 * I1 + 16 / 9 * f2 * I2 + material.k_point * J * (2 * J - 1)
    S = eye(2 * f1 + 2 * f2 * I1, 3) - 2 * f2 * C + s * Ci
    return F, S, C, Ci, (f1, f2, s, s_J)
