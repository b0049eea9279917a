"""Layer functions: what a straight director leaves out beside the edges of grooves and protrusions.

Within about one thickness of such an edge the section warps: the layer beyond the groove's floor ends there, and
what is above bends over its end. A layer vector belongs to a vector of the director, r_z of a node or d_e of an
edge, shares its function N(x, y) and multiplies

    N(x, y) T(z),     T = min(0, z - z_floor)     (max for the top face),

so that the layer beyond the floor shears and stretches on its own. The functions are continuous, as the director
is; where an element has no material beyond the floor, it has no such function. The reference vectors are zero, on
flat and curved plates alike.

A mesh carries only those that are asked for; `ancf.refine` finds which are worth their cost. Elements without
stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ancf.mesh import Mesh, Special
from ancf.shape import Plate, ShapeValues
from ancf.subdomain import GROOVE, Feature, Outlined, division, face_rule, thickness_range

DIRECTOR = ("r_z", "d_e")
KIND = "d_l"
LEAST = 1e-6  # of the thickness: a layer thinner than this is none


class Through(NamedTuple):
    """T(z) = z - floor beyond the floor on the face (BOTTOM or TOP), zero elsewhere."""

    face: int
    floor: float

    def __call__(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Value and derivative (q,)."""
        beyond = self.face * (z - self.floor) > 0
        return beyond * (z - self.floor), beyond * 1.0


class LayerVector(NamedTuple):
    """A layer vector: the number v of the director's vector that it belongs to, and its T."""

    v: int
    through: Through


@dataclass(frozen=True)
class Layered:
    """A member of the family with layer functions after its own.

    own: for each, the function i of the base whose N(x, y) it shares, and its T.
    """

    base: Plate
    own: tuple[tuple[int, Through], ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each nodal vector of the element is (i,)."""
        return self.base.kinds + (KIND,) * len(self.own)

    @property
    def thickness(self) -> int | None:
        """As in the base."""
        return self.base.thickness

    @property
    def shear(self) -> int | None:
        """As in the base."""
        return self.base.shear

    @property
    def layer(self) -> int | None:
        """As in the base."""
        return self.base.layer

    @property
    def levels(self) -> list[float]:
        """Where the functions have a kink."""
        return sorted({through.floor for _, through in self.own})

    def evaluate(self, points: np.ndarray, size: tuple[float, float]) -> ShapeValues:
        """Values at points (q, 3), measured from the element's corner (0, 0), for sides `size` = (a, b)."""
        base = self.base.evaluate(points, size)
        plane = self.base.evaluate(points * (1, 1, 0) + (0, 0, 1), size)  # at z = 1 a director's function is N
        i, through = zip(*self.own, strict=True)
        T, T_z = np.array([function(points[:, 2]) for function in through]).transpose(1, 2, 0)
        N, (N_x, N_y) = plane.S[:, i], plane.S_p[:, i, :2].transpose(2, 0, 1)
        S_p = np.stack([N_x * T, N_y * T, N * T_z], axis=2)
        return ShapeValues(np.hstack([base.S, N * T]), np.concatenate([base.S_p, S_p], axis=1))


def layer_vectors(mesh: Mesh, bands: Sequence[Feature], thickness: float) -> list[LayerVector]:
    """Every layer vector the bands give reason for: each floor at each vector of the director."""
    throughs = list(dict.fromkeys(_through(band, thickness) for band in bands))
    return [LayerVector(int(v), through) for v in np.flatnonzero(np.isin(mesh.kinds, DIRECTOR)) for through in throughs]


def _through(band: Feature, thickness: float) -> Through:
    """A groove's layer begins at its deepest floor, a protrusion's at the plain face."""
    if band.sign != GROOVE:
        depth = 0.0
    elif isinstance(band, Outlined):
        depth = band.greatest
    else:
        depth = float(band.section.control_points[:, 1].max()) if band.is_curved else band.section
    return Through(band.face, band.face * (thickness / 2 - depth))


def with_layers(mesh: Mesh, wanted: Sequence[LayerVector], bands: Sequence[Feature], thickness: float) -> Mesh:
    """The mesh with the layer vectors that find material beyond their floor, each numbered after its director's."""
    by_vector: dict[int, list[Through]] = {}
    for v, through in wanted:
        by_vector.setdefault(v, []).append(through)
    places = [
        (e, i, LayerVector(int(v), through))
        for e, row in enumerate(mesh.connectivity)
        for i, v in enumerate(row)
        for through in by_vector.get(int(v), ())
        if _reaches(mesh.cells[e], bands, thickness, through)
    ]
    kept = sorted({vector for *_, vector in places})
    after = np.array([vector.v for vector in kept], dtype=int)
    return _numbered(mesh, kept, after, places)


def _reaches(cell, bands: Sequence[Feature], thickness: float, through: Through) -> bool:
    """Whether the cell has material beyond the floor."""
    if any(isinstance(band, Outlined) for band in bands):
        z = face_rule(cell, bands, thickness, (1, 1), through.face)[1]
    else:
        x, y = ((lines[1:] + lines[:-1]) / 2 for lines in division(cell, bands))
        z = thickness_range(bands, thickness, *np.meshgrid(x, y, indexing="ij"))[0 if through.face < 0 else 1]
    return bool(np.any(through.face * (z - through.floor) > LEAST * thickness))


def _numbered(mesh: Mesh, vectors: Sequence[LayerVector], after: np.ndarray, places) -> Mesh:
    base = len(mesh.vectors)
    order = np.argsort(np.concatenate([np.arange(base), after + 0.5]), kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    number_of = dict(zip(vectors, number[base:].tolist(), strict=True))
    own: dict[int, list] = {}
    for e, i, vector in places:
        own.setdefault(e, []).append((i, vector))
    connectivity = number[mesh.connectivity]
    special = {
        e: Special(
            Layered(mesh.shape, tuple((i, vector.through) for i, vector in some)),
            np.concatenate([connectivity[e], [number_of[vector] for _, vector in some]]),
        )
        for e, some in own.items()
    }
    return replace(
        mesh,
        vectors=np.concatenate([mesh.vectors, np.zeros((len(vectors), 3))])[order],
        connectivity=connectivity,
        kinds=np.concatenate([mesh.kinds, np.full(len(vectors), KIND, dtype=mesh.kinds.dtype)])[order],
        parameters=np.concatenate([mesh.parameters, mesh.parameters[after]])[order],
        special=special,
    )


def only(mesh: Mesh, worth: np.ndarray) -> Mesh:
    """The mesh without the layer vectors that are not worth it (v,)."""
    gone = (mesh.kinds == KIND) & ~worth
    place = np.cumsum(~gone) - 1
    special = {}
    for e, (shape, vectors) in mesh.special.items():
        kept = ~gone[vectors]
        own = tuple(f for f, stays in zip(shape.own, kept[len(shape.base.kinds) :], strict=True) if stays)
        if own:
            special[e] = Special(Layered(shape.base, own), place[vectors[kept]])
    fields = {name: getattr(mesh, name)[~gone] for name in ("vectors", "kinds", "parameters")}
    return replace(mesh, **fields, connectivity=place[mesh.connectivity], special=special)
