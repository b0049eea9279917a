"""det F at a material point: how much volume there is now of what there was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ancf.element import Integrand, integrand
from ancf.mesh import Mesh
from ancf.quadrature import NO_PROMISE, Rule

if TYPE_CHECKING:
    from ancf.hyperelastic import HyperelasticElements


@dataclass(frozen=True, eq=False)
class VolumeRatio:
    """A point of one element with the nodal vectors (i,) there, and G (i, 3) of `ancf.element` at it.

    relaxed: the element alone, its rule with the point as a further one of weight zero, where its thickness strain is
    free at each point: then that strain counts, as it does in the stress, whose transverse shears have their factor.
    It gives the size alone, as the root of det C; the sign, and elsewhere all, is that of det F of the position field.
    """

    vectors: np.ndarray
    G: np.ndarray
    relaxed: HyperelasticElements | None

    def at(self, q: np.ndarray) -> float:
        """det F at the components q (3 v,)."""
        Q = q.reshape(-1, 3)[self.vectors]
        of_field = float(np.linalg.det(Q.T @ self.G))
        if self.relaxed is None:
            return of_field
        return float(np.copysign(self.relaxed.volume_ratios(Q)[-1], of_field))


def volume_ratio(mesh: Mesh, elements: object, at: tuple[float, float, float], rule: Rule) -> VolumeRatio:
    """That at the reference coordinates `at`; elements: of the body; rule: of the element that holds the point.

    Raises ValueError beside the plate.
    """
    e = mesh.locate(*at[:2])
    (shape, vectors), cell = mesh.element(e), mesh.cells[e]
    alone = Rule(np.array([at], dtype=float), np.zeros(1), NO_PROMISE)
    point, whole = (integrand(shape, r, cell, mesh.vectors[vectors], enhanced=False) for r in (alone, rule))
    law = getattr(elements, "groups", (elements,))[0]  # all groups have the same
    relaxed = _alone(law, whole, point) if getattr(law, "relax", False) else None
    return VolumeRatio(vectors, point.G[0], relaxed)


def _alone(elements: HyperelasticElements, whole: Integrand, point: Integrand) -> HyperelasticElements:
    """The element alone, whose law is that of `elements`: its points and one more behind them."""
    from ancf.hyperelastic import Form, HyperelasticElements, form  # and numba, for rubber alone

    parts = form(whole), form(point)
    G, b = (np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in ("G", "b"))
    one = Form(G, np.concatenate([part.volume for part in parts]), b)
    return HyperelasticElements(elements.material, (one,), np.zeros(1, dtype=int), True, elements.shear)
