"""Which elements of a mesh share one form: those that differ by a rigid motion, and their images (see `ancf.image`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ancf.feature import Feature, has_images, relevant
from ancf.image import ALONG_X, ALONG_Y, Image, images
from ancf.mesh import Mesh
from ancf.parity import FLAT, NONE, Mirrors
from ancf.quadratic_form import from_first_node
from ancf.subdomain import imaged

DIGITS = 11  # in which two Gram matrices agree, for a plate of size 1 with gradients of length 1


@dataclass(frozen=True, eq=False)
class Sharing:
    """Form (e,) of each element, the first element (g,) of each form, and the image of the element that this form is.

    image_of (e,): number in `images`, 0 for an element that has the form as it is. mirrors (g,): those in which each
    form is its own image.
    """

    form_of: np.ndarray
    first: np.ndarray
    image_of: np.ndarray
    images: tuple[Image, ...]
    mirrors: tuple[Mirrors, ...]

    def vectors(self, mesh: Mesh, e: int) -> np.ndarray:
        """Nodal vectors (i,) of an element in the order of its form."""
        own, image = mesh.element(e).vectors, self.image_of[e]
        return own[self.images[image].order] if image else own

    def signs(self, e: int, count: int) -> np.ndarray:
        """What the element's `count` vectors are multiplied by to become those of its form (i,)."""
        image = self.image_of[e]
        return self.images[image].signs if image else np.ones(count)


def sides(mesh: Mesh, element: int, free: Sequence[str]) -> tuple[str, ...]:
    """The free edges of the plate that an element lies on."""
    return tuple(edge for edge in mesh.edges_of(element) if edge in free)


def sharing(mesh: Mesh, bands: Sequence[Feature], free: Sequence[str] = (), own: tuple[Image, ...] = ()) -> Sharing:
    """Find equal shapes, each element as it is or as one of the images `own`, the first of which changes nothing.

    bands: all that divides elements. free: the free edges of the plate, for elements that have a layer there. Two
    shapes are equal when what they see of the bands agrees, the free edges that they have a layer on, and the Gram
    matrices of their reference vectors: an isotropic material does not see how they then differ. Elements with
    functions of their own, and those that see bands without images, have none.
    """
    vectors, positions = mesh.element_vectors, mesh.shape.positions
    units = _units(mesh)[:, None]
    Q = from_first_node(vectors, positions) / units
    grams = Q @ Q.swapaxes(1, 2)
    number: dict[tuple, int] = {}
    form_of, image_of = np.empty(len(vectors), dtype=int), np.zeros(len(vectors), dtype=int)

    def shape_key(e: int, seen: Sequence[Feature], image: Image | None) -> tuple:
        gram, edges = grams[e], sides(mesh, e, free)
        if image is not None:
            turned = from_first_node(vectors[e][None, image.order] * image.signs[:, None], positions)[0] / units
            gram, edges = turned @ turned.T, tuple(sorted(map(image.edge, edges)))
        rounded = np.round(gram, DIGITS) + 0.0
        return imaged(mesh.cells[e], seen, image), edges, rounded.tobytes(), mesh.element(e).shape

    sizes, met = _sizes(vectors, positions), set()
    for e, cell in enumerate(mesh.cells):
        seen = relevant(cell, bands)
        key = shape_key(e, seen, None)
        found = number.get(key)
        has_own = found is None and sizes[e] in met and e not in mesh.special and all(map(has_images, seen))
        for k, image in enumerate(own[1:], 1) if has_own else ():
            found = number.get(shape_key(e, seen, image))
            if found is not None:
                image_of[e] = k
                break
        met.add(sizes[e])
        form_of[e] = number.setdefault(key, len(number)) if found is None else found
    first = np.unique(form_of, return_index=True)[1]
    upright = [kind in FLAT for kind in mesh.shape.kinds]

    def mirrors(e: int) -> Mirrors:
        seen = relevant(mesh.cells[e], bands)
        if not own or e in mesh.special or not all(map(has_images, seen)):
            return NONE
        along = (shape_key(e, seen, own[k]) == shape_key(e, seen, None) for k in (ALONG_X, ALONG_Y))
        is_level = not any(band.section for band in seen)
        return *along, is_level and not np.round(grams[e][upright][:, np.invert(upright)], DIGITS).any()

    return Sharing(form_of, first, image_of, own, tuple(map(mirrors, first.tolist())))


def _units(mesh: Mesh) -> np.ndarray:
    """What the vectors (i,) of an element are measured in: positions in sizes of the plate, gradients in their largest
    length, twists accordingly, and directors, which have no dimension, in 1."""
    size = np.ptp(mesh.vectors[mesh.kinds == "r"], axis=0).max()
    along, across = (np.linalg.norm(mesh.vectors[mesh.kinds == kind], axis=1).max() for kind in ("r_x", "r_y"))
    unit = {"r": size, "r_x": along, "r_y": across, "r_xy": along * across / size}
    return np.array([unit.get(kind, 1.0) for kind in mesh.shape.kinds])


def _sizes(vectors: np.ndarray, positions: tuple[int, ...]) -> list[float]:
    """A number for each element (e,) that its images share, and elements of other shapes hardly."""
    Q = vectors.copy()
    Q[:, positions] -= Q[:, positions].mean(axis=1, keepdims=True)
    size = np.linalg.norm(Q.swapaxes(1, 2) @ Q, axis=(1, 2))
    return np.round(size / size.max(), DIGITS - 2).tolist()


def possible(mesh: Mesh, points: tuple[int, int, int]) -> tuple[Image, ...]:
    """The images that elements integrated at so many points may have."""
    return images(mesh.shape, square=points[0] == points[1])
