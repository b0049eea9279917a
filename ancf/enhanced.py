"""Enhanced strains: what the straight director of a plate cannot do, at no unknown and no running cost.

An element with enhanced strains adds M_k alpha_k to E; the amplitudes belong to the element alone and
minimise its energy (Simo and Rifai 1990, here for the Green-Lagrange strain). For the constant tangent
C of St. Venant-Kirchhoff they are linear in E,

    alpha = - H^-1 integral M : C : E dV,   H = integral M : C : M dV,

so that the pre-integrated energy stays a quadratic form. g^x, g^y, g^z: gradients of x, y, z; p_k:
Legendre polynomials in s and t.

Thickness strain M = P_m(z) p_k(s, t) g^z g^z, m = 0, 1, 2. The thickness strain of a field linear in z is
constant in z, but Poisson's effect in bending asks for a linear one (thickness locking), and near nu = 1/2
the squared curvature in E for a quadratic one. The constant ones free the length of the director, which an
interpolated rotation shortens, and the volume of an element bent far. P_m is taken over the thickness of
the element, and each M_k is made orthogonal to the bilinear functions: constant stress does no work on it,
also where a groove makes the thickness lopsided, and the patch test holds.

Shear warping M = P_3'(zeta) p_k(s, t) (g^a g^z + g^z g^a), a = x, y: the displacement P_3(zeta) beta(x, y),
which bends the cross-section into the S that faces without traction ask for; zeta runs from -1 to 1 over
the thickness that is left at (x, y). With P_3' = 1 + 5 P_2 a shear strain constant in z keeps the energy
(1 + b)^2 + 5 b^2 of its own, least at b = -1/6: 5/6, Reissner's shear factor. These strains are not
orthogonal to a constant: where only a straight cross-section was wrong, that one changes.

On a free edge of the plate there is also the layer of `ancf.free_edge`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legvander, legvander2d

from ancf.columns import numbers
from ancf.free_edge import layer_strains
from ancf.quadrature import Rule
from ancf.shape import Plate

NOTHING = 1e-8  # of a mode's size: what round-off leaves of one that is bilinear


def enhanced_strains(
    shape: Plate, rule: Rule, cell, inverse: np.ndarray, volume: np.ndarray, free: Sequence[str] = ()
) -> np.ndarray:
    """Strains M (q, p, r, k) of mean square 1 of an element on `cell`.

    inverse (q, p, c): J_o^-1, whose rows are g^x, g^y, g^z. volume (q,): weight of each point in m3. free:
    the free edges of the plate that the element lies on.
    """
    g_x, g_y, g_z = inverse.swapaxes(0, 1)
    low, high = np.array(cell).T
    at = np.column_stack([2 * (rule.points[:, :2] - low) / (high - low) - 1, rule.points[:, 2]])
    parts = [np.zeros((len(volume), 3, 3, 0))]
    if shape.thickness is not None:
        parts.append(_times(_thickness_modes(at, volume, shape.thickness), g_z, g_z))
    if shape.shear is not None:
        modes = _warping(rule)[:, None] * legvander2d(*at[:, :2].T, [shape.shear] * 2)
        parts += [_times(modes, g_x, g_z), _times(modes, g_y, g_z)]
    for edge in free if shape.layer is not None else ():
        g_along, g_across = (g_y, g_x) if edge[0] == "x" else (g_x, g_y)
        E_13, E_12, E_11, turn = layer_strains(rule, cell, edge, inverse, shape.layer)
        modes = 2 * _times(E_13, g_along, g_z) + 2 * _times(E_12, g_along, g_across) + _times(E_11, g_along, g_along)
        parts += [modes, _times(_warping(rule)[:, None] * turn, g_along, g_z)]
    M = np.concatenate(parts, axis=-1)
    return M / np.sqrt(np.einsum("qprk,qprk,q->k", M, M, volume / volume.sum()))


def _times(modes: np.ndarray, f: np.ndarray, g: np.ndarray) -> np.ndarray:
    """Modes (q, k) times the symmetric part of f g (q, 3) each."""
    both = np.einsum("qp,qr->qpr", f, g)
    return modes[:, None, None] * (both + both.swapaxes(1, 2))[..., None] / 2


def _thickness_modes(at: np.ndarray, volume: np.ndarray, degree: int) -> np.ndarray:
    """Modes P_m(z) p_k(s, t) (q, k), m to 2 and k to `degree` in s and in t, less their best bilinear fit."""
    s, t, z = at.T
    mean = volume @ z / volume.sum()
    through = legvander((z - mean) / np.abs(z - mean).max(), 2)[:, :, None]
    bilinear, full = (legvander2d(s, t, [n, n]) for n in (1, degree))
    root = np.sqrt(volume / volume.sum())[:, None]
    modes = (through * full[:, None]).reshape(len(z), -1)
    modes -= bilinear @ np.linalg.lstsq(root * bilinear, root * modes, rcond=None)[0]
    return modes[:, np.linalg.norm(root * modes, axis=0) > NOTHING]


def _warping(rule: Rule) -> np.ndarray:
    """P_3'(zeta) (q,)."""
    return (15 * _zeta(rule) ** 2 - 3) / 2


def _zeta(rule: Rule) -> np.ndarray:
    """zeta (q,) of the points of a rule, which lie in columns through the thickness, one after the other.

    From the mean and the variance h^2 / 12 of z in each column.
    """
    column, z = numbers(rule.points), rule.points[:, 2]

    def mean(values: np.ndarray) -> np.ndarray:
        return (np.bincount(column, rule.weights * values) / np.bincount(column, rule.weights))[column]

    z = z - mean(z)
    return z / np.sqrt(3 * mean(z**2))


def inverse_root(M: np.ndarray, CM: np.ndarray) -> np.ndarray:
    """R^-1 (k, k), H = M^T CM = R R^T, for M and C M dV (n, k): with X the strains, the enhanced ones that belong to
    them are -M R^-T R^-1 CM^T X."""
    return np.linalg.inv(np.linalg.cholesky(M.T @ CM))
