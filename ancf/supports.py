"""Held components of the nodal vectors."""

from __future__ import annotations

import numpy as np

from ancf.mesh import Mesh

ALONG = {"x0": "r_y", "x1": "r_y", "y0": "r_x", "y1": "r_x"}


def clamp(mesh: Mesh, edge: str, gradients: str) -> np.ndarray:
    """Held components (3 v,) of a clamped edge x0, x1, y0 or y1.

    gradients "all": all twelve coordinates of each node on the edge, the paper's clamp. "tangential":
    what a held face implies, r, r_z and the gradient along the edge; the one normal to it is free.
    """
    axis = "xy".index(edge[0])
    lines = (mesh.x_lines, mesh.y_lines)[axis]
    at = lines[0] if edge[1] == "0" else lines[-1]
    held = mesh.parameters[:, axis] == at
    if gradients == "tangential":
        held = held & np.isin(mesh.kinds, ["r", "r_z", ALONG[edge]])
    return np.repeat(held, 3)
