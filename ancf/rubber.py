"""The Mooney-Rivlin law at the points of many elements, compiled: the fast twin of `ancf.material`.

The formulas are those of `material.MooneyRivlin`. Symmetric tensors have their six components (not doubled) in the
order of VOIGT. Arrays of an element have its points q last: F (3, 3, q), C (6, q). With the second Piola-Kirchhoff
stress S forces need

    T_ap = F_ar S_rp dV;

what tangents need is in `ancf.moduli`.
Every loop over points is one pass of a few hundred operations; as array expressions each of them would be a pass.
"""

from __future__ import annotations

import numpy as np
from numba import njit

VOIGT = np.array([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)])
NEAR = 0.6  # of det C and its inverse: in between its cube root is iterated
FAST = {"reassoc", "contract", "nsz"}  # may regroup sums; NaN and infinity keep their meaning
compiled = njit(cache=True, fastmath=FAST, error_model="numpy")
# What a kernel calls: left apart, it may be linked in another version than the cache holds, of other rounding.
inlined = njit(cache=True, fastmath=FAST, error_model="numpy", forceinline=True)


@compiled
def add_cauchy_green(F, factor, C):
    """Add factor F^T F to C (e, 6, q); F (e, 3, 3, q)."""
    for e in range(len(F)):
        for m in range(6):
            p, r = VOIGT[m]
            for q in range(F.shape[3]):
                product = F[e, 0, p, q] * F[e, 0, r, q] + F[e, 1, p, q] * F[e, 1, r, q] + F[e, 2, p, q] * F[e, 2, r, q]
                C[e, m, q] += factor * product


@inlined
def cofactors(C, q, K):
    """Fill K (6,) with the cofactors of C (6, q) at a point; returns I1, I2 and det C = J^2."""
    C11, C22, C33, C23, C13, C12 = C[0, q], C[1, q], C[2, q], C[3, q], C[4, q], C[5, q]
    K[0], K[1], K[2] = C22 * C33 - C23 * C23, C11 * C33 - C13 * C13, C11 * C22 - C12 * C12
    K[3], K[4], K[5] = C13 * C12 - C11 * C23, C12 * C23 - C22 * C13, C13 * C23 - C33 * C12
    return C11 + C22 + C33, K[0] + K[1] + K[2], C11 * K[0] + C12 * K[5] + C13 * K[4]


@inlined
def inverse_cube_roots(square, root):
    """Fill root (q,) with square^(-1/3), of det C = J^2.

    Near one by iterations of third order that need no library and run several at a time: from an error below 0.02 at
    both ends three of them end in round-off. Where any is farther off by logarithms, not a number where it is negative.
    """
    least, most = np.inf, -np.inf
    for q in range(len(square)):
        least, most = min(least, square[q]), max(most, square[q])
    if least >= NEAR and most <= 1.0 / NEAR:
        for q in range(len(square)):
            x = square[q] - 1.0
            x = 1.0 - x / 3.0 * (1.0 - x / 1.5 * (1.0 - x / 1.5))
            for _ in range(3):
                short = 1.0 - square[q] * x * x * x
                x *= 1.0 + short / 3.0 * (1.0 + short / 1.5)
            root[q] = x
    else:
        for q in range(len(square)):
            root[q] = np.exp(np.log(square[q]) / -3.0)


@inlined
def determinants(C, square, root):
    """Fill square (q,) with det C of C (6, q), and root (q,) with square^(-1/3)."""
    for q in range(len(square)):
        C11, C22, C33, C23, C13, C12 = C[0, q], C[1, q], C[2, q], C[3, q], C[4, q], C[5, q]
        square[q] = C11 * (C22 * C33 - C23 * C23) + C12 * (C13 * C23 - C33 * C12) + C13 * (C12 * C23 - C22 * C13)
    inverse_cube_roots(square, root)


@inlined
def factors(mu10, mu01, bulk, I1, I2, square, root):
    """J, f1, f2, s and c of `material.MooneyRivlin`; square = det C, root = square^(-1/3)."""
    J = np.sqrt(square)
    f1, f2 = mu10 * root, mu01 * root * root
    s = -2.0 / 3.0 * f1 * I1 - 4.0 / 3.0 * f2 * I2 + bulk * (square - J)
    c = 4.0 / 9.0 * f1 * I1 + 16.0 / 9.0 * f2 * I2 + bulk * (2.0 * square - J)
    return J, f1, f2, s, c


@compiled
def inverse_roots(C):
    """det C^(-1/3) (e, q) of elements, C (e, 6, q)."""
    squares, roots = np.empty(C.shape[2]), np.empty((len(C), C.shape[2]))
    for e in range(len(C)):
        determinants(C[e], squares, roots[e])
    return roots


@compiled
def energy(law, C, volume):
    """Strain energy (J) of elements: law (mu10, mu01, bulk) in Pa, C (e, 6, q), volume (q,)."""
    mu10, mu01, bulk = law
    K, total = np.empty(6), 0.0
    squares, roots = np.empty(len(volume)), np.empty(len(volume))
    for e in range(len(C)):
        determinants(C[e], squares, roots)
        for q in range(len(volume)):
            I1, I2, square = cofactors(C[e], q, K)
            J, f1, f2, _, _ = factors(mu10, mu01, bulk, I1, I2, square, roots[q])
            total += volume[q] * (f1 * I1 + f2 * I2 - 3.0 * (mu10 + mu01) + bulk / 2.0 * (J - 1.0) ** 2)
    return total


@inlined
def stress_at(C, q, K, I1, f1, f2, inverse, shear, S):
    """Fill S (6,) at a point, its transverse shears times `shear`; K: cofactors, inverse = s / det C."""
    for m in range(6):
        S[m] = inverse * K[m] - 2.0 * f2 * C[m, q]
        if m < 3:
            S[m] += 2.0 * f1 + 2.0 * f2 * I1
    S[3] *= shear
    S[4] *= shear


@inlined
def pushed(F, q, S, weight, T):
    """Fill T_ap (3, 3, q) = F_ar S_rp weight at a point."""
    for a in range(3):
        x, y, z = weight * F[a, 0, q], weight * F[a, 1, q], weight * F[a, 2, q]
        T[a, 0, q] = x * S[0] + y * S[5] + z * S[4]
        T[a, 1, q] = x * S[5] + y * S[1] + z * S[3]
        T[a, 2, q] = x * S[4] + y * S[3] + z * S[2]


@compiled
def stresses(law, shear, F, C, volume, T):
    """Fill T (e, 3, 3, q) in N m; C (e, 6, q) may hold more than F^T F."""
    mu10, mu01, bulk = law
    K, S = np.empty(6), np.empty(6)
    squares, roots = np.empty(len(volume)), np.empty(len(volume))
    for e in range(len(C)):
        determinants(C[e], squares, roots)
        for q in range(len(volume)):
            I1, I2, square = cofactors(C[e], q, K)
            _, f1, f2, s, _ = factors(mu10, mu01, bulk, I1, I2, square, roots[q])
            stress_at(C[e], q, K, I1, f1, f2, s / square, shear, S)
            pushed(F[e], q, S, volume[q], T[e])
