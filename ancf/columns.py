"""Points of an element in columns through its thickness, and its functions as products with a factor in z.

Every function of the family is N(x, y) Z(z): Z is 1 for the mid-surface, z for the director, and T(z) for what lies
beyond a floor (`ancf.layer`). With the parameters P = x, y, z its parametric gradient at any point of a column is

    S_iP = N_is zeta_s,    s = (Z, P):  N_x Z, N_y Z, N Z',

one value of the column times one of the point. So an integral of gradients of two functions is a product of their
values in the columns with sums over the points of each, and it costs as if the plate had a single point through its
thickness. s counts the slots: two of the mid-surface, where Z' is zero, three of every other Z.

Points are numbered level by level: the first of every column, then the second of all that have one, and so on, the
columns with most points first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ancf.shape import Plate, Wider


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of an element's q points.

    order (q,): the points level by level. levels (l,): number of columns that reach each. N (3, i, c): N_x, N_y and N
    of the functions in the c columns. in_z (i,): number of each function's Z. zeta (s, q): of each slot, in the
    order of the levels. inverse (q, P, 3): J_o^-1, in the same order.
    """

    order: np.ndarray
    levels: np.ndarray
    N: np.ndarray
    in_z: np.ndarray
    zeta: np.ndarray
    inverse: np.ndarray

    @property
    def count(self) -> int:
        """Number of columns c."""
        return int(self.levels[0])


def numbers(points: np.ndarray) -> np.ndarray:
    """Number of the column (q,) of each point (q, 2 or 3), those of a column one after the other."""
    return np.cumsum(np.append(False, np.any(np.diff(points[:, :2], axis=0) != 0, axis=1)))


def columns(shape: Plate | Wider, points: np.ndarray, size: tuple[float, float], inverse: np.ndarray) -> Columns:
    """Columns of points (q, 3), measured from the element's corner, those of a column one after the other.

    size: the element's sides. inverse (q, 3, 3): J_o^-1 at the points.
    """
    counts = np.bincount(numbers(points))
    first = np.cumsum(counts) - counts
    longest = np.argsort(-counts, kind="stable")
    levels = (counts[:, None] > np.arange(counts.max())).sum(axis=0)
    order = np.concatenate([first[longest[:count]] + level for level, count in enumerate(levels)])
    Z, slopes = shape.z_factors(points[order, 2])
    zeta = [Z[0], Z[0]]
    for value, slope in zip(Z[1:], slopes[1:], strict=True):
        zeta += [value, value, slope]
    N = _planar(shape, points[first[longest], :2], size)
    return Columns(order, levels, N, np.array(shape.in_z), np.array(zeta), inverse[order])


def slots(number: int) -> slice:
    """The slots of the Z with this number."""
    return slice(3 * number - 1, 3 * number + 2) if number else slice(0, 2)


def _planar(shape: Plate | Wider, places: np.ndarray, size: tuple[float, float]) -> np.ndarray:
    """N_x, N_y and N (3, i, c) of all functions at places (c, 2): each where its Z is not zero."""
    in_z = np.array(shape.in_z)
    found = np.empty((3, len(in_z), len(places)))
    for number, z in enumerate(shape.somewhere):
        own, Z = in_z == number, shape.z_factors(np.array([z]))[0][number]
        S, S_p = shape.evaluate(np.column_stack([places, np.full(len(places), z)]), size)
        found[:2, own] = S_p[:, own, :2].transpose(2, 1, 0) / Z
        found[2, own] = S[:, own].T / Z
    return found
