"""det F at a material point: how much volume there is now of what there was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ancf.element import Integrand, integrand
from ancf.hyperelastic import Form, HyperelasticElements, SplitElements, form
from ancf.mesh import Mesh
from ancf.quadrature import NO_PROMISE, Rule


@dataclass(frozen=True, eq=False)
class VolumeRatio:
    """A point of one element with the nodal vectors (i,) there, and G (i, 3) of `ancf.element` at it.

    relaxed: the element alone, its rule with the point as a further one of weight zero, where its thickness strain is
    free at each point: then that strain counts, as it does in the stress. Elsewhere it is det F of the position field.
    """

    vectors: np.ndarray
    G: np.ndarray
    relaxed: HyperelasticElements | None

    def at(self, q: np.ndarray) -> float:
        """det F at the components q (3 v,)."""
        Q = q.reshape(-1, 3)[self.vectors]
        if self.relaxed is not None:
            return float(self.relaxed.volume_ratios(Q)[-1])
        return float(np.linalg.det(Q.T @ self.G))


def volume_ratio(mesh: Mesh, elements: object, at: tuple[float, float, float], rule: Rule) -> VolumeRatio:
    """That at the reference coordinates `at`; elements: of the body; rule: of the element that holds the point.

    Raises ValueError beside the plate.
    """
    e = mesh.locate(*at[:2])
    (shape, vectors), cell = mesh.element(e), mesh.cells[e]
    alone = Rule(np.array([at], dtype=float), np.zeros(1), NO_PROMISE)
    point, whole = (integrand(shape, r, cell, mesh.vectors[vectors], enhanced=False) for r in (alone, rule))
    law = elements.isochoric if isinstance(elements, SplitElements) else elements
    if not (isinstance(law, HyperelasticElements) and law.relax):
        return VolumeRatio(vectors, point.G[0], None)
    one = HyperelasticElements(law.material, (_with(whole, point),), np.zeros(1, dtype=int), True, law.shear)
    return VolumeRatio(vectors, point.G[0], one)


def _with(whole: Integrand, point: Integrand) -> Form:
    """Form of an element's points and one more behind them."""
    parts = form(whole), form(point)
    G, b = (np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in ("G", "b"))
    return Form(G, np.concatenate([part.volume for part in parts]), b)
