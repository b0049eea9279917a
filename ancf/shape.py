"""Shape functions of the plate elements: one family, whose members are data.

The rest of the package knows of a member its `node_kinds` and `edge_kinds` (what the nodal vectors of a
node and of an edge are), `kinds` and `positions` (those of one element; the functions of positions sum
to one), `thickness`, `shear` and `layer` (see `ancf.enhanced`), `least_points`, `evaluate(points, size)`, and the
functions' factors in z: `in_z`, `z_factors(z)` and `somewhere` (see `ancf.columns`).

Nodal vectors of an element: those of its corners (0,0), (1,0), (1,1), (0,1), then those of its edges
y = 0, x = a, y = b, x = 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))
# Axis along which an edge runs, and the corner where it begins.
EDGES = ((0, (0, 0)), (1, (1, 0)), (0, (0, 1)), (1, (0, 0)))


class Kink(NamedTuple):
    """T(z) = z - floor beyond the floor on the face (BOTTOM or TOP), zero elsewhere."""

    face: int
    floor: float

    def __call__(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Value and derivative (q,)."""
        beyond = self.face * (z - self.floor) > 0
        return beyond * (z - self.floor), beyond * 1.0


class ShapeValues(NamedTuple):
    """Shape functions S_qi (q, i) and their derivatives S_qip (q, i, p) by x, y and z."""

    S: np.ndarray
    S_p: np.ndarray


@dataclass(frozen=True)
class Plate:
    """A fully parameterized plate element: r = r_mid(x, y) + z d(x, y) with s = x/a, t = y/b.

    The mid-surface is the tensor product of cubic Hermite polynomials and C1. With `twist` a node has
    r, r_x, r_y, r_xy, which makes it bicubic; without, r_xy is taken as zero at the nodes. Corner (0, 0):

        H1(s) H1(t),  H2(s) H1(t),  H1(s) H2(t),  H2(s) H2(t)

    With `blended` it is cubic along one direction and linear along the other, both summed less the bilinear
    one, and C0 (Adini, Clough and Melosh); with L1(s) = 1 - s:

        H1(s) L1(t) + L1(s) H1(t) - L1(s) L1(t),  H2(s) L1(t),  L1(s) H2(t)

    The director d is bilinear in the nodes' r_z, and C0. With `edges` it is quadratic along each edge:
    an edge carries d_e, the excess of r_z at its middle over the mean of its ends. Corner (0, 0), edge y = 0:

        z (1 - s)(1 - t),  z 4 s (1 - s)(1 - t)

    thickness, shear: degrees in s and t of the enhanced strains of `ancf.enhanced`, None without them.
    layer: degree of the layer at a free edge (`ancf.free_edge`), None without one.
    least_points: Gauss points below which deformations without energy appear.
    """

    name: str
    twist: bool
    edges: bool
    blended: bool = False
    thickness: int | None = None
    shear: int | None = None
    layer: int | None = None
    least_points: tuple[int, int, int] = (1, 1, 1)

    @property
    def node_kinds(self) -> tuple[str, ...]:
        """What the nodal vectors of a node are."""
        return ("r", "r_x", "r_y", "r_xy", "r_z") if self.twist else ("r", "r_x", "r_y", "r_z")

    @property
    def edge_kinds(self) -> tuple[str, ...]:
        """What the nodal vectors of an edge are."""
        return ("d_e",) if self.edges else ()

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each nodal vector of an element is (i,)."""
        return self.node_kinds * 4 + self.edge_kinds * 4

    @property
    def starts(self) -> tuple[tuple[int, int], ...]:
        """The corner of each nodal vector (i,); of an edge's the one where it begins."""
        ends = [start for _, start in EDGES for _ in self.edge_kinds]
        return (*(corner for corner in CORNERS for _ in self.node_kinds), *ends)

    @property
    def positions(self) -> tuple[int, ...]:
        """The nodal vectors of an element that are positions."""
        return tuple(i for i, kind in enumerate(self.kinds) if kind == "r")

    @property
    def in_z(self) -> tuple[int, ...]:
        """Number in `z_factors` of the factor in z of each function (i,)."""
        return tuple(_factors(self)[2][: len(self.kinds)].tolist())

    @property
    def somewhere(self) -> tuple[float, ...]:
        """A z at which each factor of `z_factors` is not zero."""
        return (0.0, 1.0)

    def z_factors(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Factors in z of the functions and their slopes (k, q)."""
        return _through(z)

    def evaluate(self, points: np.ndarray, size: tuple[float, float]) -> ShapeValues:
        """Values at points (q, 3), measured from the element's corner (0, 0), for sides `size` = (a, b), also (q,)."""
        x, y, z = np.asarray(points, dtype=float).T
        (f, f_x), (g, g_y), (h, h_z) = _along(x, size[0]), _along(y, size[1]), _through(z)
        m, n, k = _factors(self)
        f, g, h = f[m], g[n], h[k]
        parts = (
            self._sums(f * g * h),
            self._sums(f_x[m] * g * h),
            self._sums(f * g_y[n] * h),
            self._sums(f * g * h_z[k]),
        )
        return ShapeValues(parts[0].T, np.stack([part.T for part in parts[1:]], axis=2))

    def values(self, points: np.ndarray, size: tuple[float, float]) -> np.ndarray:
        """The functions S (q, i) of `evaluate` alone."""
        x, y, z = np.asarray(points, dtype=float).T
        m, n, k = _factors(self)
        return self._sums(_along(x, size[0])[0][m] * _along(y, size[1])[0][n] * _through(z)[0][k]).T

    def _sums(self, products: np.ndarray) -> np.ndarray:
        """Functions (i, q) of the products of `_factors`."""
        if not self.blended:
            return products
        own, more = products[: len(self.kinds)], products[len(self.kinds) :]
        own[list(self.positions)] += more[::2] - more[1::2]
        return own


@dataclass(frozen=True)
class Wider:
    """A member of the family with functions of its own after those of its base."""

    base: Plate

    @property
    def thickness(self) -> int | None:
        """As in the base."""
        return self.base.thickness

    @property
    def shear(self) -> int | None:
        """As in the base."""
        return self.base.shear

    @property
    def layer(self) -> int | None:
        """As in the base."""
        return self.base.layer

    @property
    def kinks(self) -> tuple[Kink, ...]:
        """Factors in z beside those of the base, which have a kink each."""
        raise NotImplementedError

    def number_of(self, kink: Kink) -> int:
        """Number of one of the kinks in `z_factors`."""
        return len(self.base.somewhere) + self.kinks.index(kink)

    @property
    def levels(self) -> list[float]:
        """Where the functions have a kink along z."""
        return sorted({kink.floor for kink in self.kinks})

    @property
    def somewhere(self) -> tuple[float, ...]:
        """As in `Plate`."""
        return (*self.base.somewhere, *(kink.floor + kink.face for kink in self.kinks))

    def z_factors(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As in `Plate`."""
        own = [self.base.z_factors(z), *(np.array([kink(z)]).swapaxes(0, 1) for kink in self.kinks)]
        return tuple(np.concatenate(parts) for parts in zip(*own, strict=True))


def numbered(kinks: Iterable[Kink]) -> tuple[Kink, ...]:
    """Each of them once, in order."""
    return tuple(sorted(set(kinks)))


LINEAR, BUBBLE = 4, 6  # where they begin in `_along`


@lru_cache(maxsize=8)
def _factors(shape: Plate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each function's factors along x and y, numbers in `_along`, and z, numbers in `_through` (i,).

    After them, where the mid-surface is blended, the other two products of each position's function (8,).
    """
    found, more = [], []
    for c, d in CORNERS:
        H, L = (2 * c, 2 * d), (LINEAR + c, LINEAR + d)
        if shape.blended:
            found += [(H[0], L[1], 0), (H[0] + 1, L[1], 0), (L[0], H[1] + 1, 0)]
            more += [(L[0], H[1], 0), (*L, 0)]
        else:
            both = [H, (H[0] + 1, H[1]), (H[0], H[1] + 1), (H[0] + 1, H[1] + 1)]
            found += [(*pair, 0) for pair in both[: len(shape.node_kinds) - 1]]
        found.append((*L, 1))
    if shape.edges:
        found += [(BUBBLE, LINEAR + d, 1) if axis == 0 else (LINEAR + c, BUBBLE, 1) for axis, (c, d) in EDGES]
    return tuple(np.array(found + more).T)


def _along(x: np.ndarray, a: float) -> tuple[np.ndarray, np.ndarray]:
    """Functions on [0, a] and their slopes (7, q): cubic Hermite polynomials H1..H4, value and slope at 0 and at a,
    linear interpolation L1, L2, and the parabola 4 s (1 - s)."""
    s = x / a
    t, s2, one = 1 - s, s * s, np.ones_like(s)
    H3, H4 = s2 * (3 - 2 * s), a * s2 * -t
    values = [1 - H3, a * s * t * t, H3, H4, t, s, 4 * s * t]
    slope = 6 * s * t / a
    slopes = [-slope, t * (1 - 3 * s), slope, s * (3 * s - 2), -one / a, one / a, 4 * (1 - 2 * s) / a]
    return np.array(values), np.array(slopes)


def _through(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """1 and z, and their slopes (2, q)."""
    one = np.ones_like(z)
    return np.array([one, z]), np.array([0 * one, one])


CONFORMING = Plate("conforming", twist=False, edges=False)
"""Conforming element of Mikkola and Shabana (2003), the element of the paper: 16 vectors, 48 coordinates.

Exact: rigid motion, constant strain, at nu = 0 constant curvature along x or y. Not exact: w = xy (192/175
times the Kirchhoff energy of a twist at nu = 0), bending with a linear moment (a linear director has a
constant curvature). For nu > 0 its thickness strain, constant in z, makes it too stiff in bending however
fine the mesh. 7 x 7 x 3 points integrate it exactly on flat reference shapes.
"""

ACM = Plate("acm", twist=False, edges=False, blended=True)
"""Element with the mid-surface of Adini, Clough and Melosh, as Chrono's ChElementShellANCF_3443: 48 coordinates.

Called non-conforming for its slopes, which jump across edges; with a director of its own a plate needs a
continuous position only, and that it has. Exact: rigid motion, constant strain, at nu = 0 constant curvature
and, unlike the conforming element, constant twist. Not exact: bending with a linear moment, anything bent at
nu > 0 (both as in the conforming element). 7 x 7 x 3 points integrate it exactly on flat reference shapes.
"""

ENRICHED = Plate("enriched", twist=True, edges=True, thickness=3, shear=2, layer=2, least_points=(4, 4, 3))
"""Element without shear, twist, thickness and volume locking: 24 vectors, 72 coordinates.

In a large mesh an element brings 7 vectors (21 coordinates) where the conforming one brings 4 (12).
Exact beyond the conforming element: for small displacements every cubic w with the director -grad w, and
so constant twist and bending with a linear moment, at any Poisson's ratio (the enhanced thickness strain is
that of plane stress in bending); transverse shear with the stiffness 5/6 G h of faces without traction.
7 x 7 x 3 points integrate it exactly on flat reference shapes, its mass 4 x 4 x 2; with three points along
x and y it would have four modes without energy, with two along z transverse shear would cost none.
On a free edge its elements hold the layer in which the twist fades out, however coarse they are.
Limits: the director is straight through the thickness, so warping beside a groove is left out. Where a
plate is sheared by tractions on its faces, which no plate theory admits, its stiffness is 5/6 of the solid's.
"""

FAMILY = {member.name: member for member in (CONFORMING, ACM, ENRICHED)}
