"""The moduli of the Mooney-Rivlin law summed over the columns of elements, compiled; see `ancf.columns`.

With the moduli dS/dE = C_prst, the stress S and the gradients R_Pp of the parameters in the frame of a point, the
tangent needs

    A_aPbT = R_Pp (S_pt delta_ab + F_ar C_rpst F_bs) R_Tt dV,

of which each column keeps sums over its points with the factors zeta of two slots. With the strains V_aP that unit
gradients make, six components each, it is V C V^T.

LANES points are computed side by side: rows of a small array of their own, so that the compiler sees that they do not
overlap and takes them for vectors of the processor. Formulas without loops are tuples for the same reason.
"""

from __future__ import annotations

import numpy as np

from ancf.rubber import compiled, inlined

LANES = 8
# Rows of the work array: C, root, F, R, weight, scaled weight, compliance, normal strains, A.
C_ROW, ROOT, F_ROW, R_ROW, WEIGHT, SCALED, COMPLIANCE, U_ROW, A_ROW, ROWS = 0, 6, 7, 16, 25, 26, 27, 28, 37, 91


@inlined
def load(source, at, count, w, row):
    """Fill rows of w from `row` on with source (k, q) at `count` points from `at` on; lanes beyond repeat the last."""
    for k in range(len(source)):
        if count == LANES:
            for l in range(LANES):
                w[row + k, l] = source[k, np.uintp(at + l)]
        else:
            for l in range(LANES):
                w[row + k, l] = source[k, at + min(l, count - 1)]


@inlined
def dot(x, y):
    """Sum of the products of six components."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3] + x[4] * y[4] + x[5] * y[5]


@inlined
def strain(F, R):
    """F_p R_r of vectors (3,) in six components, F_p R_r + F_r R_p for p < r."""
    x, y, z = F
    r, s, t = R
    return x * r, y * s, z * t, y * t + z * s, x * t + z * r, x * s + y * r


@inlined
def strains(F, R):
    """Strains (3, 6) of one component F (3,) of the deformation gradient with each R (3, 3)."""
    return strain(F, R[0]), strain(F, R[1]), strain(F, R[2])


@inlined
def scaled_dots(weight, x, M):
    """Weight times x M (6,) of x (6,) and symmetric M (6, 6)."""
    a, b, c = weight * dot(x, M[0]), weight * dot(x, M[1]), weight * dot(x, M[2])
    return a, b, c, weight * dot(x, M[3]), weight * dot(x, M[4]), weight * dot(x, M[5])


@inlined
def modulus(h_i, K_j, K_i, h_j, s, K_pa, K_rb, K_pb, K_ra):
    """h_i K_j + K_i h_j - s (K_pa K_rb + K_pb K_ra) of the components i = (p, r) and j = (a, b)."""
    return h_i * K_j + K_i * h_j - s * (K_pa * K_rb + K_pb * K_ra)


@inlined
def stress_and_moduli(law, shear, C, root):
    """S (6,) and M (6, 6) = dS/dE of C (6,) at a point, transverse shears times `shear`; root = det C^(-1/3).

    The formulas are those of `material.MooneyRivlin` with K = C^-1, s and half of its c.
    """
    mu10, mu01, bulk = law
    C0, C1, C2, C3, C4, C5 = C
    K0, K1, K2 = C1 * C2 - C3 * C3, C0 * C2 - C4 * C4, C0 * C1 - C5 * C5
    K3, K4, K5 = C4 * C5 - C0 * C3, C5 * C3 - C1 * C4, C4 * C3 - C2 * C5
    square = C0 * K0 + C5 * K5 + C4 * K4
    I1, I2, J = C0 + C1 + C2, K0 + K1 + K2, np.sqrt(square)
    f1, f2, inverse = mu10 * root, mu01 * root * root, 1.0 / square
    s = -2.0 / 3.0 * f1 * I1 - 4.0 / 3.0 * f2 * I2 + bulk * (square - J)
    half_c = 2.0 / 9.0 * f1 * I1 + 8.0 / 9.0 * f2 * I2 + bulk * (square - 0.5 * J)
    K0, K1, K2, K3, K4, K5 = K0 * inverse, K1 * inverse, K2 * inverse, K3 * inverse, K4 * inverse, K5 * inverse
    on, more, f, g = 2.0 * f1 + 2.0 * f2 * I1, -4.0 / 3.0 * f1 - 8.0 / 3.0 * f2 * I1, 8.0 / 3.0 * f2, 2.0 * f2
    S0, S1, S2 = s * K0 - g * C0 + on, s * K1 - g * C1 + on, s * K2 - g * C2 + on
    S3, S4, S5 = shear * (s * K3 - g * C3), shear * (s * K4 - g * C4), s * K5 - g * C5
    h0, h1, h2 = f * C0 + half_c * K0 + more, f * C1 + half_c * K1 + more, f * C2 + half_c * K2 + more
    h3, h4, h5 = f * C3 + half_c * K3, f * C4 + half_c * K4, f * C5 + half_c * K5
    M00, M01 = modulus(h0, K0, K0, h0, s, K0, K0, K0, K0), modulus(h0, K1, K0, h1, s, K5, K5, K5, K5) + 2.0 * g
    M11, M12 = modulus(h1, K1, K1, h1, s, K1, K1, K1, K1), modulus(h1, K2, K1, h2, s, K3, K3, K3, K3) + 2.0 * g
    M22, M02 = modulus(h2, K2, K2, h2, s, K2, K2, K2, K2), modulus(h0, K2, K0, h2, s, K4, K4, K4, K4) + 2.0 * g
    M03, M04 = shear * modulus(h0, K3, K0, h3, s, K5, K4, K4, K5), shear * modulus(h0, K4, K0, h4, s, K0, K4, K4, K0)
    M13, M14 = shear * modulus(h1, K3, K1, h3, s, K1, K3, K3, K1), shear * modulus(h1, K4, K1, h4, s, K5, K3, K3, K5)
    M23, M24 = shear * modulus(h2, K3, K2, h3, s, K3, K2, K2, K3), shear * modulus(h2, K4, K2, h4, s, K4, K2, K2, K4)
    M05, M15 = modulus(h0, K5, K0, h5, s, K0, K5, K5, K0), modulus(h1, K5, K1, h5, s, K5, K1, K1, K5)
    M25, M55 = modulus(h2, K5, K2, h5, s, K4, K3, K3, K4), modulus(h5, K5, K5, h5, s, K0, K1, K5, K5) - g
    M35, M45 = shear * modulus(h3, K5, K3, h5, s, K5, K3, K1, K4), shear * modulus(h4, K5, K4, h5, s, K0, K3, K5, K4)
    both = shear * shear
    M33, M44 = modulus(h3, K3, K3, h3, s, K1, K2, K3, K3) - g, modulus(h4, K4, K4, h4, s, K0, K2, K4, K4) - g
    M33, M34, M44 = both * M33, both * modulus(h3, K4, K3, h4, s, K5, K2, K3, K4), both * M44
    return (S0, S1, S2, S3, S4, S5), (
        (M00, M01, M02, M03, M04, M05),
        (M01, M11, M12, M13, M14, M15),
        (M02, M12, M22, M23, M24, M25),
        (M03, M13, M23, M33, M34, M35),
        (M04, M14, M24, M34, M44, M45),
        (M05, M15, M25, M35, M45, M55),
    )


@inlined
def condensed_row(x, u):
    """A row x (6,) of moduli without the normal stress; u (6,): n n : C / D."""
    n = x[2]
    return x[0] - n * u[0], x[1] - n * u[1], n - n * u[2], x[3] - n * u[3], x[4] - n * u[4], x[5] - n * u[5]


@inlined
def condense(M, condensed):
    """Moduli (6, 6) without the normal stress, and u = n n : C / D (6,); as they are, and u = 0, unless condensed."""
    a, b, n, c, d, e = M
    inverse = 1.0 / n[2] if condensed else 0.0
    u = n[0] * inverse, n[1] * inverse, n[2] * inverse, n[3] * inverse, n[4] * inverse, n[5] * inverse
    first = condensed_row(a, u), condensed_row(b, u), condensed_row(n, u)
    return (*first, condensed_row(c, u), condensed_row(d, u), condensed_row(e, u)), u


@inlined
def store(w, k, l, x, y, z):
    """Three rows of w from k on, in lane l."""
    w[k, l], w[k + 1, l], w[k + 2, l] = x, y, z


@inlined
def store_block(w, k, l, VM, V, S):
    """Nine rows of w from k on, in lane l: V M V^T of two components, plus S (3, 3)."""
    x, y, z = V
    for_x, for_y, for_z = VM
    store(w, k, l, dot(for_x, x) + S[0], dot(for_x, y) + S[5], dot(for_x, z) + S[4])
    store(w, k + 3, l, dot(for_y, x) + S[5], dot(for_y, y) + S[1], dot(for_y, z) + S[3])
    store(w, k + 6, l, dot(for_z, x) + S[4], dot(for_z, y) + S[3], dot(for_z, z) + S[2])


@inlined
def row(w, k, l):
    """Three rows of w from k on, in lane l."""
    return w[k, l], w[k + 1, l], w[k + 2, l]


@inlined
def at_points(law, shear, condensed, w):
    """Fill the rows of A, 3 P + T for each of DIRECTIONS, compliance and normal strains (zero if not condensed)."""
    none = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for l in range(LANES):
        weight, C = w[WEIGHT, l], (*row(w, C_ROW, l), *row(w, C_ROW + 3, l))
        R = row(w, R_ROW, l), row(w, R_ROW + 3, l), row(w, R_ROW + 6, l)
        S, M = stress_and_moduli(law, shear, C, w[ROOT, l])
        V = strains(row(w, F_ROW, l), R), strains(row(w, F_ROW + 3, l), R), strains(row(w, F_ROW + 6, l), R)
        f, w[COMPLIANCE, l] = w[SCALED, l], weight / M[2][2]
        M, u = condense(M, condensed)
        store(w, U_ROW, l, f * dot(V[0][0], u), f * dot(V[0][1], u), f * dot(V[0][2], u))
        store(w, U_ROW + 3, l, f * dot(V[1][0], u), f * dot(V[1][1], u), f * dot(V[1][2], u))
        store(w, U_ROW + 6, l, f * dot(V[2][0], u), f * dot(V[2][1], u), f * dot(V[2][2], u))
        x = scaled_dots(weight, V[0][0], M), scaled_dots(weight, V[0][1], M), scaled_dots(weight, V[0][2], M)
        y = scaled_dots(weight, V[1][0], M), scaled_dots(weight, V[1][1], M), scaled_dots(weight, V[1][2], M)
        z = scaled_dots(weight, V[2][0], M), scaled_dots(weight, V[2][1], M), scaled_dots(weight, V[2][2], M)
        a, b, c = strains(R[0], R)
        d, e = strain(R[1], R[1]), strain(R[1], R[2])
        f = strain(R[2], R[2])
        pushed = scaled_dots(weight, S, (a, d, f, e, c, b))
        store_block(w, A_ROW, l, x, V[0], pushed)
        store_block(w, A_ROW + 9, l, y, V[1], pushed)
        store_block(w, A_ROW + 18, l, z, V[2], pushed)
        store_block(w, A_ROW + 27, l, x, V[1], none)
        store_block(w, A_ROW + 36, l, x, V[2], none)
        store_block(w, A_ROW + 45, l, y, V[2], none)


@inlined
def add_even_mid(total, k, w, p):
    """Add to three rows of total what is even in (P, T) of rows p to p + 9 of w, for slots of the mid-surface."""
    for l in range(LANES):
        total[k, l] += w[p, l]
        total[k + 1, l] += w[p + 4, l]
        total[k + 2, l] += 0.5 * (w[p + 1, l] + w[p + 3, l])


@inlined
def add_even(total, k, w, p, z, i):
    """Add to six rows of total what is even in (P, T), for slots i to i + 3 with the factors z."""
    for l in range(LANES):
        x, y = z[i, l], z[i + 2, l]
        square, both = x * x, 0.5 * x * y
        total[k, l] += square * w[p, l]
        total[k + 1, l] += square * w[p + 4, l]
        total[k + 2, l] += y * y * w[p + 8, l]
        total[k + 3, l] += both * (w[p + 5, l] + w[p + 7, l])
        total[k + 4, l] += both * (w[p + 2, l] + w[p + 6, l])
        total[k + 5, l] += 0.5 * square * (w[p + 1, l] + w[p + 3, l])


@inlined
def add_odd_mid(total, k, w, p):
    """Add to a row of total what is odd in (P, T), for slots of the mid-surface."""
    for l in range(LANES):
        total[k, l] += 0.5 * (w[p + 1, l] - w[p + 3, l])


@inlined
def add_odd(total, k, w, p, z, i):
    """Add to three rows of total what is odd in (P, T), for slots i to i + 3."""
    for l in range(LANES):
        x, y = z[i, l], z[i + 2, l]
        both = 0.5 * x * y
        total[k, l] += both * (w[p + 5, l] - w[p + 7, l])
        total[k + 1, l] += both * (w[p + 2, l] - w[p + 6, l])
        total[k + 2, l] += 0.5 * x * x * (w[p + 1, l] - w[p + 3, l])


@inlined
def add_three(total, k, w, p, by_T, l, x, y):
    """Add to three rows of total those of w, one for each T, times x in the plane and y along z; in lane l."""
    total[k, l] += x * w[p, l]
    total[k + 1, l] += x * w[p + by_T, l]
    total[k + 2, l] += y * w[p + 2 * by_T, l]


@inlined
def add_cross_mid(total, k, w, p, by_P, by_T, z, j):
    """Add to six rows of total those of w, for P of the mid-surface and slots j to j + 3."""
    for l in range(LANES):
        x, y = z[j, l], z[j + 2, l]
        add_three(total, k, w, p, by_T, l, x, y)
        add_three(total, k + 3, w, p + by_P, by_T, l, x, y)


@inlined
def add_cross(total, k, w, p, by_P, by_T, z, i, j):
    """Add to nine rows of total those of w, for slots i to i + 3 and j to j + 3."""
    for l in range(LANES):
        xx, xy, yx, yy = z[i, l] * z[j, l], z[i, l] * z[j + 2, l], z[i + 2, l] * z[j, l], z[i + 2, l] * z[j + 2, l]
        add_three(total, k, w, p, by_T, l, xx, xy)
        add_three(total, k + 3, w, p + by_P, by_T, l, xx, xy)
        add_three(total, k + 6, w, p + 2 * by_P, by_T, l, yx, yy)


@inlined
def add_up(total, w, z, rows):
    """Add the rows of A of one level to the blocks of total, which have `rows` (blocks,) each, in the order of
    `ColumnProducts.blocks`. A factor in z that is zero at these points, below a floor, adds nothing.
    """
    block, start = 0, 0
    for second in range(len(z) // 3 + 1):
        j = 3 * second - 1
        used = second < 2 or np.any(z[j + 2])
        for first in range(second):
            each = rows[block] // 9
            for d in range(9 if used else 0):
                i, k, p = 3 * first - 1, start + d * each, A_ROW + 9 * (d if d < 6 else d - 3)
                if first == 0 and d < 6:
                    add_cross_mid(total, k, w, p, 3, 1, z, j)
                elif first == 0:
                    add_cross_mid(total, k, w, p, 1, 3, z, j)
                elif d < 6:
                    add_cross(total, k, w, p, 3, 1, z, i, j)
                else:
                    add_cross(total, k, w, p, 1, 3, z, i, j)
            block, start = block + 1, start + rows[block]
        for d in range(6 if used else 0):
            k, p = start + d * (rows[block] // 6), A_ROW + 9 * d
            if second:
                add_even(total, k, w, p, z, j)
            else:
                add_even_mid(total, k, w, p)
        block, start = block + 1, start + rows[block]
        for d in range(3 if used else 0):
            k, p = start + d * (rows[block] // 3), A_ROW + 9 * (d + 3)
            if second:
                add_odd(total, k, w, p, z, j)
            else:
                add_odd_mid(total, k, w, p)
        block, start = block + 1, start + rows[block]


@inlined
def load_level(C, roots, F, R, zeta, volume, scale, q, lanes, w, z):
    """Fill w and z (s, LANES) with what `lanes` points from q on have; the weight of lanes beyond is zero."""
    load(C, q, lanes, w, C_ROW)
    load(F, q, lanes, w, F_ROW)
    load(R, q, lanes, w, R_ROW)
    load(zeta, q, lanes, z, 0)
    for l in range(LANES):
        at = q + min(l, lanes - 1)
        w[ROOT, l], w[WEIGHT, l] = roots[at], volume[at] if l < lanes else 0.0
        w[SCALED, l] = w[WEIGHT, l] * scale[at]


@inlined
def add_normal_strains(total, w, z):
    """Add to total (3 s, LANES) the normal strains of w times the factors z (s, LANES) of the slots."""
    count = len(z)
    for a in range(3):
        for i in range(count):
            k, P = a * count + i, U_ROW + 3 * a + ((i + 1) % 3 if i > 1 else i)
            for l in range(LANES):
                total[k, l] += w[P, l] * z[i, l]


@inlined
def put(total, rows, blocks, elements, e, block, A):
    """Put the rows of total (n, LANES) where A of `elasticity` has those of element e and one block of columns."""
    k, start = 0, 0
    for own in rows:
        for r in range(own):
            at = start + (e * own + r) * blocks + block
            for l in range(LANES):
                A[at, l] = total[k + r, l]
        k, start = k + own, start + elements * own * blocks


@compiled
def elasticity(law, shear, condensed, F, C, roots, volume, R, zeta, levels, scale, rows, A, T, compliance):
    """Fill A (e n c / LANES, LANES) with the sums over the points of each column, in N m, part after part of
    `ColumnProducts`: of each part (e, rows, c) of its elements, the c columns filled up to a multiple of LANES.

    law (mu10, mu01, bulk) in Pa; F (e, 3, 3, q), C (e, 6, q), roots (e, q) = det C^(-1/3), volume (q,); R (9, q):
    gradients of the parameters in the frames of the points; zeta (s, q), levels (l,) of `Columns`; rows (parts,).
    condensed: take the normal stress out of the moduli, fill T (e, 3, s, c) with the sums of F_ar (n n : C)_rp / D dV
    R_Pp zeta_s scale, scale (q,), and compliance (e, q) = dV^2 / D / dV, D = n n : C : n n, of `ancf.relaxation`.
    """
    count, columns, blocks = len(zeta), levels[0], (levels[0] + LANES - 1) // LANES
    w, z, total = np.empty((ROWS, LANES)), np.empty((count, LANES)), np.empty((rows.sum(), LANES))
    normal = np.empty((3 * count, LANES))
    for e in range(len(C)):
        own_F = F[e].reshape(9, -1)
        for begin in range(0, columns, LANES):
            total[:], normal[:], q = 0.0, 0.0, begin
            for reached in levels:
                lanes = min(LANES, reached - begin)
                if lanes <= 0:
                    break
                load_level(C[e], roots[e], own_F, R, zeta, volume, scale, q, lanes, w, z)
                at_points(law, shear, condensed, w)
                if condensed:
                    compliance[e, q : q + lanes] = w[COMPLIANCE, :lanes]
                    add_normal_strains(normal, w, z)
                add_up(total, w, z, rows)
                q += reached
            put(total, rows, blocks, len(C), e, begin // LANES, A)
            if condensed:
                for k in range(3 * count):
                    for l in range(LANES):
                        T[e, k // count, k % count, begin + l] = normal[k, l]
