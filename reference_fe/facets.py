"""Faces of curved tetrahedra: bases on them, and the same facets in the box and in space."""

from __future__ import annotations

import numpy as np
from skfem import ElementTetP2, FacetBasis, MappingIsoparametric, MeshTet2

from reference_fe.geometry import MeshError
from reference_fe.mesh import Solid

STEPS = 30
CLOSE = 1e-12  # of the unit tetrahedron


class Mapping(MappingIsoparametric):
    """scikit-fem's mapping with another inverse: Newton's method from the centroid, not kept within the unit cube.

    Kept there, it runs along the cube's sides for ever in tetrahedra that a shell bends, sound as they are.
    """

    def invF(self, x, tind=None):
        """Local coordinates (3, f, q) of the points x in the tetrahedra tind. Raises MeshError "mesh_inverted"."""
        X = np.full(x.shape, 0.25)
        for _ in range(STEPS):
            change = np.einsum("ijkl,jkl->ikl", self.invDF(X, tind), x - self.F(X, tind))
            X += change
            if np.abs(change).max() < CLOSE:
                return X
        raise MeshError("mesh_inverted", "a point on a face of a curved tetrahedron has no place in it")


def facet_basis(mesh: MeshTet2, facets: np.ndarray, degree: int) -> FacetBasis:
    """Basis of quadratic functions on facets of a mesh, integrated to a degree."""
    element = ElementTetP2()
    return FacetBasis(mesh, element, mapping=Mapping(mesh, element, mesh.bndelem), facets=facets, intorder=degree)


def owners(solid: Solid, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra (m,) of boundary facets (m,) of the box, and which of their four facets each is (m,).

    Both hold in space as well; glued at a seam, box and space number nodes and facets differently.
    """
    elements = solid.box.f2t[0, facets]
    return elements, np.argmax(solid.box.t2f[:, elements] == facets, axis=0)


def in_space(solid: Solid, facets: np.ndarray) -> np.ndarray:
    """Numbers, in the mesh in space, of boundary facets of the box."""
    elements, local = owners(solid, facets)
    return solid.mesh.t2f[local, elements]


def places_on(solid: Solid, basis: FacetBasis) -> np.ndarray:
    """Box coordinates (3, f, q) of the points of a basis on the mesh in space."""
    local = basis.mapping.invF(np.asarray(basis.global_coordinates()), basis.tind)
    return solid.box.mapping().F(local, basis.tind)
