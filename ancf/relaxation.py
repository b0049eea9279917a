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

import numpy as np

from ancf.packing import DIRECTIONS
from ancf.rubber import cofactors, compiled, factors, inlined, inverse_cube_roots

AB = np.array(DIRECTIONS)
MOST = 25  # iterations
CLOSE = 1e-7  # change of e whose square no longer counts
LEAST = 0.2  # of J^2, that is left by one iteration


@compiled
def relax(law, C, volume, b):
    """Add the relaxed part 2 e to C33 of elements; not a number where there is none.

    law (mu10, mu01, bulk); C (e, 6, q) of the displacement, n its third direction; volume (q,); b (4, q), over
    |g_z|^2. det C, I1 and I2 are linear in C33.
    """
    points = len(volume)
    rest, K = np.empty((4, points)), np.empty(6)
    e, S, D, floor, square = (np.empty(points), np.empty(points), np.empty(points), np.empty(points), np.empty(points))
    root, weight, moment = np.empty(points), np.empty(points), np.empty(points)
    H, beta = np.empty((4, 4)), np.empty(4)
    for own in C:
        for q in range(points):
            rest[0, q], rest[1, q], rest[2, q] = cofactors(own, q, K)
            rest[3, q], e[q] = K[2], 0.0
        found = False
        for _ in range(MOST):
            for q in range(points):
                square[q] = rest[2, q] + 2.0 * rest[3, q] * e[q]
            inverse_cube_roots(square, root)
            normal_stress(law, own, rest, e, square, root, S, D, floor)
            for q in range(points):
                weight[q] = volume[q] / D[q]
                moment[q] = weight[q] * S[q] - volume[q] * e[q]
            balance(b, weight, moment, H, beta)
            factorise(H)
            solve(H, beta)
            largest = 0.0
            for q in range(points):
                change = (b[0, q] * beta[0] + b[1, q] * beta[1] + b[2, q] * beta[2] + b[3, q] * beta[3] - S[q]) / D[q]
                change = floor[q] if change < floor[q] else change
                e[q] += change
                largest = max(largest, abs(change))
            if largest <= CLOSE:
                found = True
                break
        for q in range(points):
            own[2, q] = own[2, q] + 2.0 * e[q] if found else np.nan


@inlined
def normal_stress(law, C, rest, e, square, root, S, D, floor):
    """Fill S = S33, D = dS33/dE33 and the least change of e that one iteration may make, each (q,).

    square, root (q,): det C and det C^(-1/3) with the e (q,) of now.
    """
    mu10, mu01, bulk = law
    for q in range(len(e)):
        in_plane = C[0, q] + C[1, q]
        I1, I2 = rest[0, q] + 2.0 * e[q], rest[1, q] + 2.0 * in_plane * e[q]
        _, f1, f2, s, c = factors(mu10, mu01, bulk, I1, I2, square[q], root[q])
        inverse = rest[3, q] / square[q]  # (C^-1)33
        S[q] = 2.0 * f1 + 2.0 * f2 * in_plane + s * inverse
        D[q] = inverse * ((c - 2.0 * s) * inverse - 8.0 / 3.0 * f1 - 16.0 / 3.0 * f2 * in_plane)
        floor[q] = (LEAST - 1.0) / 2.0 / inverse


@inlined
def balance(b, weight, moment, H, right):
    """Fill H (4, 4), its lower triangle, and the right side (4,) of the equations for beta.

    weight dV / D and moment (n . S n / D - e) dV, both (q,).
    """
    for k in range(4):
        total = 0.0
        for q in range(len(weight)):
            total += b[k, q] * moment[q]
        right[k] = total
        for l in range(k + 1):
            total = 0.0
            for q in range(len(weight)):
                total += b[k, q] * b[l, q] * weight[q]
            H[k, l] = total


@inlined
def factorise(H):
    """Replace the lower triangle of H (4, 4) by L D L^T: D on the diagonal, L below; D may have any sign."""
    for k in range(4):
        for l in range(k):
            for m in range(l):
                H[k, l] -= H[k, m] * H[l, m]  # here H[k, m] is still L D
        for l in range(k):
            scaled = H[k, l] / H[l, l]
            H[k, k] -= scaled * H[k, l]
            H[k, l] = scaled


@inlined
def solve(H, right):
    """Replace right (4,) by the solution, H factorised."""
    for k in range(4):
        for l in range(k):
            right[k] -= H[k, l] * right[l]
    for k in range(4):
        right[k] /= H[k, k]
    for k in range(3, -1, -1):
        for l in range(k + 1, 4):
            right[k] -= H[l, k] * right[l]


@compiled
def add_low_rank(H, L, upper, lower):
    """Add L^T H^-1 L to packed tangents; see `ancf.packing` for the order of their entries.

    H (e, 4, 4), overwritten; L (e, 3, 4, i), overwritten; upper (e, 6, m), lower (e, 3, c).
    """
    n = L.shape[3]
    crossed = n * (n - 1) // 2
    Y = np.empty((3, 4, n))
    for e in range(len(H)):
        factorise(H[e])
        for a in range(3):
            for k in range(4):
                for l in range(k):
                    for i in range(n):
                        L[e, a, k, i] -= H[e, k, l] * L[e, a, l, i]
            for k in range(4):
                for i in range(n):
                    Y[a, k, i] = L[e, a, k, i] / H[e, k, k]
        for d in range(6):
            a, b = AB[d]
            X, Z = L[e, a], Y[b]
            for i in range(n):
                upper[e, d, crossed + i] += product(X, i, Z, i)
                begin = i * n - i * (i + 1) // 2 - i - 1  # of the pairs (i, k), less k = i + 1
                for k in range(i + 1, n):
                    upper[e, d, begin + k] += product(X, i, Z, k)
                    if d > 2:
                        lower[e, d - 3, begin + k] += product(X, k, Z, i)


@inlined
def product(X, i, Z, k):
    """Sum of X_li Z_lk over the four l."""
    return X[0, i] * Z[0, k] + X[1, i] * Z[1, k] + X[2, i] * Z[2, k] + X[3, i] * Z[3, k]
