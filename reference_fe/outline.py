"""The surface of the solid as triangles and lines, for pictures only."""

from __future__ import annotations

import numpy as np

from reference_fe.mesh import Solid


def surface_triangles(solid: Solid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (k,) on the surface, triangles (m, 3) and element edges (l, 2) as indices into these nodes.

    Each curved facet becomes four flat triangles through its mid-edge nodes, each edge two lines.
    """
    mesh = solid.mesh
    facets = mesh.boundary_facets()
    corner = mesh.facets[:, facets]
    edges = np.sort(mesh.edges, axis=0)
    keys = edges[0].astype(np.int64) * mesh.nvertices + edges[1]
    order = np.argsort(keys)

    def middle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        key = np.minimum(a, b).astype(np.int64) * mesh.nvertices + np.maximum(a, b)
        return mesh.nvertices + order[np.searchsorted(keys[order], key)]

    a, b, c = corner
    ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
    triangles = np.stack([(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]).transpose(0, 2, 1).reshape(-1, 3)
    lines = np.stack([(a, ab), (ab, b), (b, bc), (bc, c), (c, ca), (ca, a)]).transpose(0, 2, 1).reshape(-1, 2)
    nodes, triangles = np.unique(triangles, return_inverse=True)
    lines = np.unique(np.sort(np.searchsorted(nodes, lines), axis=1), axis=0)
    return nodes, triangles.reshape(-1, 3), lines
