"""Held components of the nodal vectors."""

from __future__ import annotations

import numpy as np

from ancf.mesh import Mesh

ALONG = {"x0": "r_y", "x1": "r_y", "y0": "r_x", "y1": "r_x"}


def clamp(mesh: Mesh, edge: str, gradients: str) -> np.ndarray:
    """Held components (3 v,) of a clamped edge x0, x1, y0 or y1.

    gradients "all": every vector of the nodes and edges on it, the paper's clamp. "tangential": what a
    held face implies, r, r_z, d_e and the gradient along the edge; what is a derivative normal to it,
    the other gradient and r_xy, is free.
    """
    axis = "xy".index(edge[0])
    lines = (mesh.x_lines, mesh.y_lines)[axis]
    at = lines[0] if edge[1] == "0" else lines[-1]
    held = mesh.parameters[:, axis] == at
    if gradients == "tangential":
        held = held & np.isin(mesh.kinds, ["r", "r_z", "d_e", "d_l", ALONG[edge]])
    return np.repeat(held, 3)
