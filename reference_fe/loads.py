"""Loads. Dead forces as nodal shares: weights (n,) that sum to 1 and say how much of a force each node carries.

The same weights average a field, so a patch load and a patch probe of one region are one vector.
A moment pulls at an edge's slope along z, another weighted sum of the nodes, and turns with it.
All places are given in the coordinates of the box (m), see geometry.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from skfem import Basis, ElementTetP2, FacetBasis, LinearForm

from reference_fe.facets import facet_basis
from reference_fe.geometry import Interval, MeshError
from reference_fe.mesh import Solid

ROUND_OFF = 1e-12
SIMPSON = (1 / 6, 4 / 6, 1 / 6)  # integrals of the quadratic shape functions over an edge of length 1


@dataclass(frozen=True)
class Load:
    """Nodal forces (n, 3) in N, times a piecewise linear history (k, 2) of (time, factor), constant outside."""

    force: np.ndarray
    history: np.ndarray


@dataclass(frozen=True)
class Moment:
    """A moment (3,) in N m on an edge that turns with it; slope (n,) are weights that sum the nodes to its director.

    It does the work |moment| x angle as the director's part d across the axis turns about it: with
    t = moment x d the force on the director is t / d², and its derivative -(t dᵀ + d tᵀ) / d⁴.
    """

    slope: np.ndarray
    reference: np.ndarray
    moment: np.ndarray
    history: np.ndarray

    def at(self, u: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Nodal forces (n, 3) at the displacement u (n, 3), and the derivative (3, 3) of the director's force."""
        size = np.interp(time, self.history[:, 0], self.history[:, 1])
        axis = self.moment / np.linalg.norm(self.moment)
        director = self.reference + self.slope @ u
        d = director - axis * (axis @ director)
        t, square = np.cross(self.moment, d), d @ d
        derivative = -size * (np.outer(t, d) + np.outer(d, t)) / square**2
        return np.outer(self.slope, size * t / square), derivative


def load_at(loads: tuple[Load, ...], shape: tuple[int, int]) -> Callable[[float], np.ndarray]:
    """Sum of the loads as a function of time (s) -> (n, 3) in N."""

    def force(time: float) -> np.ndarray:
        total = np.zeros(shape)
        for load in loads:
            total += np.interp(time, load.history[:, 0], load.history[:, 1]) * load.force
        return total

    return force


def line_share(solid: Solid, at: tuple[float, float]) -> np.ndarray:
    """Uniform along the line through the thickness at (x, y), which must have been imprinted."""
    points = solid.places
    on = np.flatnonzero(np.hypot(points[0] - at[0], points[1] - at[1]) < 1e-7 * solid.extent)
    on = on[np.argsort(points[2, on])]
    middle = on >= solid.mesh.nvertices
    if on.size < 3 or not np.array_equal(middle, np.arange(on.size) % 2 == 1):
        raise MeshError("load_misses", f"no line of edges runs through the thickness at {at}")
    share = np.zeros(points.shape[1])
    for below, edge, above in zip(on[:-2:2], on[1:-1:2], on[2::2], strict=True):
        share[[below, edge, above]] += (points[2, above] - points[2, below]) * np.array(SIMPSON)
    return share / share.sum()


def face_share(solid: Solid, axis: int, value: float) -> np.ndarray:
    """Uniform over the face of an edge: the boundary where the box coordinate `axis` is `value`."""
    share = LinearForm(lambda v, w: v).assemble(_face(solid, axis, value))
    return share / share.sum()


def slope_share(solid: Solid, axis: int, value: float) -> np.ndarray:
    """Weights (n,) of the mean slope along z over the face of an edge: that of the best straight line.

    The box coordinate z is a quadratic field on the mesh, also where the mesh is curved.
    """
    basis = _face(solid, axis, value)
    z = basis.interpolate(solid.places[2])
    area, first, second = (float(np.sum(np.asarray(z) ** power * basis.dx)) for power in range(3))
    centre = first / area
    share = LinearForm(lambda v, w: (w["z"] - centre) * v).assemble(basis, z=z)
    share[np.abs(share) < ROUND_OFF * np.abs(share).max()] = 0.0  # nodes beside the face
    return share / (second - centre * first)


def pressure_force(solid: Solid, side: int, height: float) -> np.ndarray:
    """Nodal forces (n, 3) of a unit pressure on the face z = side x height of the box, side = -1 or 1."""
    basis = _face(solid, 2, side * height)
    return np.column_stack([LinearForm(lambda v, w, a=a: -w.n[a] * v).assemble(basis) for a in range(3)])


def _face(solid: Solid, axis: int, value: float) -> FacetBasis:
    """Basis on the boundary where a box coordinate has a value."""
    facets = solid.mesh.boundary_facets()
    corners = solid.places[axis][solid.mesh.facets[:, facets]]
    facets = facets[(np.abs(corners - value) < 1e-7 * solid.extent).all(axis=0)]
    return facet_basis(solid.mesh, facets, 6)


def region_share(solid: Solid, region: tuple[Interval, Interval]) -> np.ndarray:
    """Uniform over the kept volume whose (x, y) lies in the region, which must have been imprinted."""
    centre = solid.box.p[:2, solid.box.t].mean(axis=1)
    inside = np.ones(centre.shape[1], dtype=bool)
    for coordinate, (least, greatest) in zip(centre, region, strict=True):
        inside &= (coordinate > least) & (coordinate < greatest)
    if not inside.any():
        raise MeshError("load_misses", f"no material lies in the region {region}")
    basis = Basis(solid.mesh, ElementTetP2(), elements=np.flatnonzero(inside), intorder=4 if solid.flat else 8)
    share = LinearForm(lambda v, w: v).assemble(basis)
    return share / share.sum()
