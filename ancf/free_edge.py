"""The layer at a free edge, in which the twist of a plate fades out, inside the elements that lie on it.

The twisting moment vanishes on a free edge. In Reissner's plate it does so over the length 1 / lambda =
h / sqrt(10), by a turn of the director about the normal of the edge that dies out as exp(-lambda d) with the
distance d; a strip of width b loses 0.63 h/b of its twisting stiffness to its two edges. An element
that is coarse beside the layer cannot follow it, is too stiff by as much, and converges with order one until
its size is that of the layer. So an element on a free edge has, besides its nodal vectors, the displacement

    u = (z - z_mean) sum_k beta_k b_k(s) e(d)  along the edge,   b_k = P_(k+2) - P_k,
    e = sinh(lambda (a - d)) / sinh(lambda a),   a: size of the element across the edge,

which vanishes on its other sides: no neighbour sees it, and with it the element is still one of displacements.
Its strains are those of the undeformed shape, turned along with the element, and enter as enhanced strains
(`ancf.enhanced`), with a second set for the warping P_3'(zeta) of the layer. The curvature of the mid-surface
along the edge is neglected over the thickness of the layer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander

from ancf.mesh import Mesh
from ancf.quadrature import Rule
from ancf.subdomain import PROTRUSION, TOP, Band

DECAY = np.sqrt(10.0)  # lambda h of Reissner's plate
REACH = 2.0  # thicknesses from the edge that are integrated on their own: e falls to 0.002
LARGEST = 0.9  # of an element's side that may be


def strips(mesh: Mesh, thickness: float, edges: Sequence[str]) -> list[Band]:
    """Bands of no height along free edges: they only divide the elements there where the layer ends."""
    found = []
    for edge in edges:
        axis = "xy".index(edge[0])
        lines = (mesh.x_lines, mesh.y_lines)[axis]
        outer, inner = (lines[0], lines[1]) if edge[1] == "0" else (lines[-1], lines[-2])
        own = [e for e in range(len(mesh.cells)) if edge in mesh.edges_of(e)]
        side = mesh.edge_lengths[own][:, [1, 3] if axis == 0 else [0, 2]].min()
        found.append(strip(axis, outer, inner, side, thickness))
    return [band for band in found if band is not None]


def strip(axis: int, outer: float, inner: float, side: float, thickness: float) -> Band | None:
    """Band of no height between the line `outer` across an axis and where the layer on it ends; None in elements
    that are hardly wider. side (m): from `outer` to the line `inner`."""
    part = REACH * thickness / side
    if part >= LARGEST:
        return None
    return Band(TOP, PROTRUSION, 1 - axis, tuple(sorted((outer, outer + part * (inner - outer)))), 0.0)


def layer_strains(
    rule: Rule, cell, edge: str, inverse: np.ndarray, degree: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Strain components E_13, E_12, E_11 (q, k) of the layer's modes and their turn b_k e (q, k).

    1 is the parameter along the edge, 2 the one across it, 3 is z; inverse (q, p, c): J_o^-1. k: b_0 to b_degree.
    """
    across = "xy".index(edge[0])
    (low, high), (first, last) = cell[across], cell[1 - across]
    scale = 1 / np.linalg.norm(inverse[:, across], axis=1).mean()  # m of distance from the edge per parameter
    a, sign = (high - low) * scale, 1.0 if edge[1] == "0" else -1.0
    d = sign * (rule.points[:, across] - (low if edge[1] == "0" else high)) * scale
    z = rule.points[:, 2] - rule.weights @ rule.points[:, 2] / rule.weights.sum()
    decay = DECAY * (high - low) * (last - first) / rule.weights.sum()
    e, e_d = fading(decay, d, a)
    s = 2 * (rule.points[:, 1 - across] - first) / (last - first) - 1
    b, b_s = _bubbles(s, degree)
    turn = b * e[:, None]
    E_12 = (z * e_d)[:, None] * b * sign * scale / 2
    E_11 = (z * e)[:, None] * b_s * 2 / (last - first)
    return turn / 2, E_12, E_11, turn


def fading(decay: float, d: np.ndarray, a: float) -> tuple[np.ndarray, np.ndarray]:
    """e = sinh(lambda (a - d)) / sinh(lambda a) and its derivative by d, without overflow."""
    near, far, whole = np.exp(-decay * d), np.exp(-decay * (2 * a - d)), -np.expm1(-2 * decay * a)
    return (near - far) / whole, -decay * (near + far) / whole


def _bubbles(s: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """b_k = P_(k+2) - P_k (q, k), zero at s = -1 and 1, and their derivatives by s, for k = 0 to `degree`."""
    P, P_s = legvander(s, degree + 2), legval(s, legder(np.eye(degree + 3))).T
    return P[:, 2:] - P[:, :-2], P_s[:, 2:] - P_s[:, :-2]
