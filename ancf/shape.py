"""Shape functions of the plate elements, one family member per class.

A member is a frozen dataclass with `kinds` (what each of its nodal vectors is), `positions` (which of
them are positions: these functions sum to one) and `evaluate(points, size)`. The rest of the package
knows nothing else of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))


class ShapeValues(NamedTuple):
    """Shape functions S_qi (q, i) and their derivatives S_qip (q, i, p) by x, y and z."""

    S: np.ndarray
    S_p: np.ndarray


@dataclass(frozen=True)
class Conforming:
    """Conforming 48-coordinate plate element of Mikkola and Shabana (2003), the element of the paper.

    Four corners (0,0), (1,0), (1,1), (0,1), each with r, r_x, r_y, r_z. The mid-surface is the tensor
    product of cubic Hermite polynomials without the twist r_xy; r_z is bilinear:

        corner (0, 0):  H1(s) H1(t),  H2(s) H1(t),  H1(s) H2(t),  z (1 - s)(1 - t)

    with s = x/a, t = y/b.
    """

    vectors_per_node: ClassVar[int] = 4
    kinds: ClassVar[tuple[str, ...]] = ("r", "r_x", "r_y", "r_z") * 4
    positions: ClassVar[tuple[int, ...]] = (0, 4, 8, 12)

    def evaluate(self, points: np.ndarray, size: tuple[float, float]) -> ShapeValues:
        """Values at points (q, 3), measured from the element's corner (0, 0), for sides `size` = (a, b)."""
        x, y, z = np.asarray(points, dtype=float).T
        (f, f_x), (g, g_y) = _hermite(x, size[0]), _hermite(y, size[1])
        (l, l_x), (k, k_y) = _linear(x, size[0]), _linear(y, size[1])
        S = np.empty((len(x), 16))
        S_p = np.zeros((len(x), 16, 3))
        for corner, (c, d) in enumerate(CORNERS):
            i = 4 * corner
            for kind, (m, n) in enumerate(((2 * c, 2 * d), (2 * c + 1, 2 * d), (2 * c, 2 * d + 1))):
                S[:, i + kind] = f[m] * g[n]
                S_p[:, i + kind, 0] = f_x[m] * g[n]
                S_p[:, i + kind, 1] = f[m] * g_y[n]
            S[:, i + 3] = z * l[c] * k[d]
            S_p[:, i + 3] = np.stack([z * l_x[c] * k[d], z * l[c] * k_y[d], l[c] * k[d]], axis=1)
        return ShapeValues(S, S_p)


def _hermite(x: np.ndarray, a: float) -> tuple[np.ndarray, np.ndarray]:
    """Cubic Hermite polynomials H1..H4 (4, q) on [0, a] and their derivatives: value, slope at 0 and at a."""
    s = x / a
    values = [1 - 3 * s**2 + 2 * s**3, a * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, a * (s**3 - s**2)]
    slopes = [(6 * s**2 - 6 * s) / a, 1 - 4 * s + 3 * s**2, (6 * s - 6 * s**2) / a, 3 * s**2 - 2 * s]
    return np.array(values), np.array(slopes)


def _linear(x: np.ndarray, a: float) -> tuple[np.ndarray, np.ndarray]:
    """Linear interpolation (2, q) on [0, a] and its derivatives."""
    s = x / a
    return np.array([1 - s, s]), np.array([np.full_like(s, -1 / a), np.full_like(s, 1 / a)])


CONFORMING = Conforming()
