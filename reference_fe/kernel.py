"""Compiled loops of St. Venant-Kirchhoff elasticity on quadratic tetrahedra (formulas: elasticity.py).

Array shapes: nodes (e, 10), gradient (e, q, 10, 3), weight (e, q), displacement and step (n, 3).
"""

from __future__ import annotations

import numpy as np
from numba import njit

FAST = {"reassoc", "contract", "nsz"}  # may regroup sums; NaN and infinity keep their meaning
# What a kernel calls is always inlined: of a function that is compiled apart the compiling process links another
# version than the one that the cache holds, and with regrouped sums it rounds differently.
inlined = njit(cache=True, fastmath=FAST, forceinline=True)


@inlined
def _displacement_gradient(gradient, u, H):
    """Fill H (3, 3) = du/dX at one point: gradient (10, 3), u (10, 3)."""
    for i in range(3):
        x = y = z = 0.0
        for a in range(10):
            x += u[a, i] * gradient[a, 0]
            y += u[a, i] * gradient[a, 1]
            z += u[a, i] * gradient[a, 2]
        H[i, 0], H[i, 1], H[i, 2] = x, y, z


@inlined
def _gather(field, nodes, local):
    """Copy the values (10, 3) of one element's nodes."""
    for a in range(10):
        for i in range(3):
            local[a, i] = field[nodes[a], i]


@inlined
def _stress(gradient, lam, mu, u, step, mixed, F, S):
    """Fill F and S (3, 3) at one point: gradient (10, 3), u and step (10, 3); returns the energy density."""
    if mixed:
        _displacement_gradient(gradient, step, F)
        for p in range(3):
            for r in range(p, 3):
                S[p, r] = -0.5 * (F[0, p] * F[0, r] + F[1, p] * F[1, r] + F[2, p] * F[2, r])
    else:
        S[:] = 0.0
    _displacement_gradient(gradient, u, F)
    strain = 0.0
    for p in range(3):
        for r in range(p, 3):
            product = F[0, p] * F[0, r] + F[1, p] * F[1, r] + F[2, p] * F[2, r]
            S[p, r] += 0.5 * (F[p, r] + F[r, p] + product)
    volumetric = S[0, 0] + S[1, 1] + S[2, 2]
    for p in range(3):
        for r in range(p, 3):
            strain += (1.0 if p == r else 2.0) * S[p, r] * S[p, r]
            S[p, r] = 2.0 * mu * S[p, r] + (lam * volumetric if p == r else 0.0)
            S[r, p] = S[p, r]
    for i in range(3):
        F[i, i] += 1.0
    return 0.5 * lam * volumetric * volumetric + mu * strain


@njit(cache=True, fastmath=FAST)
def add_force(nodes, gradient, weight, lam, mu, displacement, step, mixed, force):
    """Add the internal force to `force` (n, 3); returns the strain energy."""
    F, S, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    u, du, f = np.empty((10, 3)), np.empty((10, 3)), np.empty((10, 3))
    energy = 0.0
    for e in range(nodes.shape[0]):
        _gather(displacement, nodes[e], u)
        if mixed:
            _gather(step, nodes[e], du)
        f[:] = 0.0
        for q in range(weight.shape[1]):
            energy += weight[e, q] * _stress(gradient[e, q], lam, mu, u, du, mixed, F, S)
            for i in range(3):
                for p in range(3):
                    P[i, p] = weight[e, q] * (F[i, 0] * S[0, p] + F[i, 1] * S[1, p] + F[i, 2] * S[2, p])
            for a in range(10):
                g0, g1, g2 = gradient[e, q, a, 0], gradient[e, q, a, 1], gradient[e, q, a, 2]
                for i in range(3):
                    f[a, i] += P[i, 0] * g0 + P[i, 1] * g1 + P[i, 2] * g2
        for a in range(10):
            for i in range(3):
                force[nodes[e, a], i] += f[a, i]
    return energy


@njit(cache=True, fastmath=FAST)
def smallest_volume_ratio(nodes, gradient, displacement):
    """Least det F over all quadrature points: below zero where an element has turned inside out."""
    F, u = np.empty((3, 3)), np.empty((10, 3))
    least = np.inf
    for e in range(nodes.shape[0]):
        _gather(displacement, nodes[e], u)
        for q in range(gradient.shape[1]):
            _displacement_gradient(gradient[e, q], u, F)
            for i in range(3):
                F[i, i] += 1.0
            ratio = F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
            ratio -= F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
            ratio += F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
            least = min(least, ratio)
    return least


@njit(cache=True, fastmath=FAST)
def add_tangent(nodes, gradient, weight, lam, mu, displacement, step, mixed, factor, number, indptr, slot, values):
    """Add factor x tangent to the upper-triangle CSR values."""
    F, S, b = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    u, du, f, s = np.empty((10, 3)), np.empty((10, 3)), np.empty((10, 3)), np.empty((10, 3))
    K = np.empty((10, 10, 3, 3))
    for e in range(nodes.shape[0]):
        _gather(displacement, nodes[e], u)
        if mixed:
            _gather(step, nodes[e], du)
        K[:] = 0.0
        for q in range(weight.shape[1]):
            g = gradient[e, q]
            w = factor * weight[e, q]
            _stress(g, lam, mu, u, du, mixed, F, S)
            for i in range(3):
                for j in range(3):
                    b[i, j] = w * mu * (F[i, 0] * F[j, 0] + F[i, 1] * F[j, 1] + F[i, 2] * F[j, 2])
            for a in range(10):
                for i in range(3):
                    f[a, i] = F[i, 0] * g[a, 0] + F[i, 1] * g[a, 1] + F[i, 2] * g[a, 2]
                    s[a, i] = w * (S[i, 0] * g[a, 0] + S[i, 1] * g[a, 1] + S[i, 2] * g[a, 2])
            for a in range(10):
                for c in range(a, 10):
                    geometric = s[a, 0] * g[c, 0] + s[a, 1] * g[c, 1] + s[a, 2] * g[c, 2]
                    shear = g[a, 0] * g[c, 0] + g[a, 1] * g[c, 1] + g[a, 2] * g[c, 2]
                    for i in range(3):
                        for j in range(3):
                            K[a, c, i, j] += w * (lam * f[a, i] * f[c, j] + mu * f[c, i] * f[a, j]) + shear * b[i, j]
                        K[a, c, i, i] += geometric
        for a in range(10):
            for c in range(a, 10):
                if slot[e, a, c] >= 0:
                    _scatter(K[a, c], False, number[nodes[e, a]], slot[e, a, c], indptr, values)
                elif slot[e, c, a] >= 0:
                    _scatter(K[a, c], True, number[nodes[e, c]], slot[e, c, a], indptr, values)


@inlined
def _scatter(block, transposed, row, k, indptr, values):
    """Add a 3 x 3 block to the k-th block of a block row; of the diagonal block only its upper triangle."""
    for i in range(3):
        start = indptr[3 * row + i] + 3 * k - i
        for j in range(i if k == 0 else 0, 3):
            values[start + j] += block[j, i] if transposed else block[i, j]
