"""The seam of a ring: the two end faces of the box, which meet in space, meshed alike and made one."""

from __future__ import annotations

from types import ModuleType

import numpy as np
from scipy.spatial import cKDTree
from skfem import MeshTet2

from reference_fe.geometry import MeshError

NEAR = 1e-6  # of the box's length: what is nearer is the same place


def match_seam(gmsh: ModuleType, length: float) -> None:
    """Mesh the faces at x = length of gmsh's current model like those at x = 0. Raises MeshError "seam_open"."""
    near = NEAR * length
    (first, sides), (last, other_sides) = (_faces_at(gmsh, x, near) for x in (0.0, length))
    partners = _partners(sides, other_sides, near)
    shift = np.eye(4)
    shift[0, 3] = length
    try:
        gmsh.model.mesh.setPeriodic(2, last, [first[k] for k in partners], shift.ravel())
    except Exception as error:
        raise MeshError("seam_open", f"gmsh cannot match the faces at the seam: {error}") from error


def glue(mesh: MeshTet2, places: np.ndarray, length: float) -> MeshTet2:
    """The mesh with each node at x = length replaced by its partner at x = 0; places (3, n) are in the box.

    Raises MeshError "seam_open" where a node has no partner.
    """
    near = NEAR * length
    first, last = (np.flatnonzero(np.abs(places[0] - x) < near) for x in (0.0, length))
    same = np.arange(places.shape[1])
    same[last] = first[_partners(places[1:, first].T, places[1:, last].T, near)]
    kept, number = np.unique(same, return_inverse=True)
    nodes = number.ravel()[mesh.dofs.element_dofs]
    return MeshTet2(np.ascontiguousarray(mesh.doflocs[:, kept]), np.ascontiguousarray(nodes))


def _faces_at(gmsh: ModuleType, x: float, near: float) -> tuple[list[int], np.ndarray]:
    """Tags of the faces that lie at x, and their least and greatest y and z (k, 4)."""
    far = near / NEAR * 10
    found = gmsh.model.getEntitiesInBoundingBox(x - near, -far, -far, x + near, far, far, dim=2)
    tags = [tag for _, tag in found]
    boxes = np.array([gmsh.model.getBoundingBox(2, tag) for tag in tags]).reshape(-1, 6)
    return tags, boxes[:, [1, 2, 4, 5]]


def _partners(first: np.ndarray, last: np.ndarray, near: float) -> np.ndarray:
    """Row of `first` (k, d) that is in the same place as each of `last` (k, d), one to one."""
    if len(first) == len(last) and len(first):
        distance, partner = cKDTree(first).query(last)
        if distance.max() < near and len(np.unique(partner)) == len(partner):
            return partner
    raise MeshError("seam_open", f"{len(last)} places at the end of the ring do not match {len(first)} at its start")
