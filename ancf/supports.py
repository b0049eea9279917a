"""Held components of the nodal vectors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ancf.mesh import Mesh

ALONG = {"x0": "r_y", "x1": "r_y", "y0": "r_x", "y1": "r_x"}
OUT = {"x0": "r_x", "x1": "r_x", "y0": "r_y", "y1": "r_y"}
MIDDLE = ("r", "r_w")
DIRECTOR = ("r_z", "d_e", "d_l", "d_w", "l_w")
ROUND_OFF = 1e-9  # of a gradient


def clamp(mesh: Mesh, edge: str, gradients: str) -> np.ndarray:
    """Held components (3 v,) of a clamped edge x0, x1, y0 or y1.

    gradients "all": every vector of the nodes and edges on it, the paper's clamp. "tangential": what a
    held face implies, r, the director, layers and the gradient along the edge; what is a derivative normal to it,
    the other gradient and r_xy, is free.
    """
    held = _on_edge(mesh, edge)
    if gradients == "tangential":
        held = held & np.isin(mesh.kinds, [*MIDDLE, *DIRECTOR, ALONG[edge]])
    return np.repeat(held, 3)


def hold_edge(mesh: Mesh, edge: str, components: Sequence[int], face: bool) -> np.ndarray:
    """Held components (3 v,) where some components of the displacement vanish along an edge.

    Along the mid-surface's edge they are those of r and of the gradient along the edge; on its whole face
    also those of DIRECTOR.
    """
    kinds = [*MIDDLE, ALONG[edge], *(DIRECTOR if face else ())]
    return _components(_on_edge(mesh, edge) & np.isin(mesh.kinds, kinds), components)


def hold_corner(mesh: Mesh, corner: tuple[int, int], components: Sequence[int], face: bool) -> np.ndarray:
    """Held components (3 v,) where components of the displacement vanish at a corner (0 or 1 along x and y)."""
    at = [lines[-end] for lines, end in zip((mesh.x_lines, mesh.y_lines), corner, strict=True)]
    held = (mesh.parameters == at).all(axis=1) & np.isin(mesh.kinds, ["r", *(DIRECTOR if face else ())])
    return _components(held, components)


def hold_whole(mesh: Mesh, components: Sequence[int]) -> np.ndarray:
    """Held components (3 v,) where some components of the displacement vanish everywhere."""
    return _components(np.ones(len(mesh.vectors), dtype=bool), components)


def symmetry(mesh: Mesh, edge: str, normal: int) -> np.ndarray:
    """Held components (3 v,) of an edge whose face stays in a plane with the normal X, Y or Z (0, 1, 2).

    What the face implies along the normal, as in `hold_edge`. Where the gradient out of the edge begins along
    the normal on the whole edge, a mirrored plate continues it smoothly only if it stays along the normal:
    its other two components and those of r_xy, its derivative along the edge, are held too. Elsewhere they
    follow from equilibrium.
    """
    held = hold_edge(mesh, edge, [normal], face=True)
    across = [a for a in range(3) if a != normal]
    out = _on_edge(mesh, edge) & (mesh.kinds == OUT[edge])
    gradient = mesh.vectors[out]
    if np.abs(gradient[:, across]).max() <= ROUND_OFF * np.abs(gradient).max():
        held |= _components(_on_edge(mesh, edge) & np.isin(mesh.kinds, [OUT[edge], "r_xy"]), across)
    return held


def free_edges(mesh: Mesh, held: np.ndarray) -> tuple[str, ...]:
    """Edges of the plate on which no component (3 v,) of the director is held between their ends."""
    held = held.reshape(-1, 3).any(axis=1)
    edges = [edge for edge in ALONG if not (mesh.closed and edge[0] == "x")]
    return tuple(edge for edge in edges if not np.any(held & _on_edge(mesh, edge) & (mesh.kinds == "d_e")))


def _on_edge(mesh: Mesh, edge: str) -> np.ndarray:
    """Nodal vectors (v,) of the nodes and element edges on an edge of the plate."""
    axis = "xy".index(edge[0])
    lines = (mesh.x_lines, mesh.y_lines)[axis]
    return mesh.parameters[:, axis] == (lines[0] if edge[1] == "0" else lines[-1])


def _components(vectors: np.ndarray, components: Sequence[int]) -> np.ndarray:
    """Components (3 v,) of the marked nodal vectors (v,)."""
    held = np.zeros((len(vectors), 3), dtype=bool)
    held[np.ix_(vectors, components)] = True
    return held.ravel()
