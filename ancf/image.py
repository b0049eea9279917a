"""Elements that are images of each other: mirrored along a side, turned over the diagonal, or both.

An image takes the parameters (s, t) of an element to those of another: it first flips an axis, s to 1 - s, and then
swaps the two. The nodal vectors of the image are those of the element in another order; a slope along a flipped axis
has its sign changed. The energy of an isotropic material depends on their Gram matrix alone, which does not see the
reflection of space that goes with it: an element and its images share one form (see `ancf.quadratic_form`).
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from ancf.shape import CORNERS, EDGES, Plate

Interval = tuple[float, float]
ALONG_Y, ALONG_X = 1, 2  # which of `images` mirror along one axis
SWAPPED = {"r_x": "r_y", "r_y": "r_x"}


class Image(NamedTuple):
    """What makes the image of an element: the axes that it flips, and whether it swaps them afterwards.

    order, signs (i,): nodal vector i of the image is signs[i] times the element's own vector order[i].
    """

    flips: tuple[bool, bool]
    swaps: bool
    order: np.ndarray
    signs: np.ndarray

    def ranges(self, ranges: tuple[Interval, Interval]) -> tuple[Interval, Interval]:
        """Ranges in units of the element along both axes, in the image."""
        flipped = [(1.0 - b, 1.0 - a) if flip else (a, b) for (a, b), flip in zip(ranges, self.flips, strict=True)]
        return tuple(flipped[::-1] if self.swaps else flipped)

    def edge(self, edge: str) -> str:
        """Name of an edge x0, x1, y0 or y1 in the image."""
        axis, end = "xy".index(edge[0]), int(edge[1])
        return f"{'yx'[axis] if self.swaps else edge[0]}{1 - end if self.flips[axis] else end}"


@lru_cache(maxsize=16)
def images(shape: Plate, square: bool) -> tuple[Image, ...]:
    """All images of an element, the first of which is the element itself; square: those that swap axes too."""
    swaps = (False, True) if square else (False,)
    return tuple(_image(shape, flips, swap) for swap in swaps for flips in product((False, True), repeat=2))


def _image(shape: Plate, flips: tuple[bool, bool], swaps: bool) -> Image:
    places = _places(shape)
    number = {(place, kind): i for i, (place, kind) in enumerate(zip(places, shape.kinds, strict=True))}
    order, signs = [], []
    for place, kind in zip(places, shape.kinds, strict=True):
        source = place[::-1] if swaps else place
        source = tuple(1.0 - s if flip else s for s, flip in zip(source, flips, strict=True))
        own = SWAPPED.get(kind, kind) if swaps else kind
        order.append(number[source, own])
        signs.append(float(np.prod([-1.0 for axis, flip in zip("xy", flips, strict=True) if flip and axis in own[2:]])))
    return Image(flips, swaps, np.array(order), np.array(signs))


def _places(shape: Plate) -> list[tuple[float, float]]:
    """(s, t) of each nodal vector: its corner, or the middle of its edge."""
    middles = [(c + 0.5 * (axis == 0), d + 0.5 * (axis == 1)) for axis, (c, d) in EDGES]
    corners = [(float(c), float(d)) for c, d in CORNERS for _ in shape.node_kinds]
    return corners + [place for place in middles for _ in shape.edge_kinds]
