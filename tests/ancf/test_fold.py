"""Integrals on one side of an element's mirrors: fewer points, the same tensors, whichever way the plate lies."""

from dataclasses import replace

import numpy as np
import pytest

from ancf.element import integrand
from ancf.fold import fold
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.shape import ENRICHED
from ancf.sharing import possible, sharing, sides
from ancf.split_form import SplitFormElements
from ancf.subdomain import element_rule
from ancf.system import body, dividing

H, POINTS = 0.05, (5, 5, 3)
ROUND_OFF = 1e-12  # of the largest entry, as for split tensors


def plate(nx, ny):
    return grid(np.linspace(0.0, 1.0, nx + 1), np.linspace(0.0, 1.0, ny + 1), shape=ENRICHED)


def forms(mesh, free):
    """Integrand and mirrors of each distinct element of a plate with these free edges."""
    divided = dividing(mesh, [], H, free)
    shared = sharing(mesh, divided, free, possible(mesh, POINTS))
    for e, mirrors in zip(shared.first, shared.mirrors, strict=True):
        (shape, vectors), cell = mesh.element(e), mesh.cells[e]
        rule = element_rule(cell, divided, H, POINTS)
        yield integrand(shape, rule, cell, mesh.vectors[vectors], sides(mesh, e, free)), mirrors


def test_an_element_inside_needs_the_points_of_an_octant():
    """Of 5 x 5 x 3 points 3 x 3 x 2, those in the middle at half weight. A layer along a free edge makes two subdomains
    and takes one mirror; in a corner there are four, and the thickness alone has one."""
    found = {mirrors: (parts, fold(parts, mirrors)) for parts, mirrors in forms(plate(3, 3), ("x1", "y0", "y1"))}
    counts = {mirrors: (len(whole.volume), len(few.volume)) for mirrors, (whole, (few, _)) in found.items()}
    assert counts[True, True, True] == (75, 18)
    assert sorted(counts.values()) == [(75, 18), (150, 60), (300, 200)]
    for whole, (few, parities) in found.values():
        assert few.volume.sum() == pytest.approx(whole.volume.sum(), rel=1e-14)
        assert len(parities) == whole.M.shape[-1]
        assert few.volume @ few.at[:, 2] ** 2 == pytest.approx(whole.volume @ whole.at[:, 2] ** 2, rel=1e-13)


def test_layers_on_opposite_free_edges_are_neither_even_nor_odd():
    """The mirror takes one to the other: the integrand stays whole."""
    kept = [(*fold(parts, mirrors), parts) for parts, mirrors in forms(plate(2, 1), ("y0", "y1"))]
    assert any(few is parts and parities is None for few, parities, parts in kept)


@pytest.mark.parametrize("free", [("x1", "y0", "y1"), ("y0", "y1")])
@pytest.mark.parametrize("mesh", [(3, 3), (4, 2), (3, 1)])
def test_a_plate_turned_in_space_has_its_force_turned(mesh, free):
    """There the mirrors are not those of the axes, and nothing is folded."""
    mesh, (turn, _) = plate(*mesh), np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))
    lying, turned = (
        body(each, [], H, from_engineering(2e6, 0.3), 2000.0, POINTS, free=free)
        for each in (mesh, replace(mesh, vectors=mesh.vectors @ turn.T))
    )
    assert isinstance(lying.elements, SplitFormElements) and isinstance(turned.elements, SplitFormElements)
    vectors = mesh.vectors + 0.02 * np.random.default_rng(2).standard_normal(mesh.vectors.shape)
    ours = lying.elements.force(vectors[lying.connectivity]) @ turn.T
    theirs = turned.elements.force((vectors @ turn.T)[turned.connectivity])
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=ROUND_OFF * np.abs(ours).max())
