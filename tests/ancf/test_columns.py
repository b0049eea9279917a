"""Columns of points: functions as products with a factor in z, and tangents summed column by column."""

import numpy as np
import pytest

from ancf.columns import columns, slots
from ancf.element import PointElements, integrand
from ancf.hyperelastic import HyperelasticElements, form
from ancf.layer import Layered, Through
from ancf.material import MooneyRivlin
from ancf.mesh import grid
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, TOP, element_rule
from ancf.wall import Lip, Wall, Walled, with_walls

from .conftest import THICKNESS
from .test_walls import PLATES

RUBBER = MooneyRivlin(0.8e6, 0.2e6, 29.6e6)
SIZE = (1.0, 0.8)
LIP, OTHER = Through(BOTTOM, -0.01, 1, 5.0), Through(TOP, 0.015, 0, 3.0)
ABOVE, BELOW, BESIDE = Lip(LIP, 1, 0.7), Lip(LIP, -1, 0.0), Lip(OTHER, -1, 0.4)

DIRECTORS = {name: [i for i, kind in enumerate(base.kinds) if kind == "r_z"][1:3] for name, base in FAMILY.items()}


def shapes():
    yield from FAMILY.values()
    for base in FAMILY.values():
        yield Walled(base, (Wall(1, 0.3, 0, ABOVE), Wall(1, 0.3, 1, ABOVE), Wall(0, 0.6, 0)))
        yield Walled(base, (Wall(1, 0.3, 0, BELOW), Wall(0, 1.1, 1, BESIDE, inside=False)))
        yield Layered(base, tuple((i, own) for i in DIRECTORS[base.name] for own in (LIP, OTHER)))


def uneven(seed=0):
    """Points in columns of two to five, measured from the element's corner."""
    rng = np.random.default_rng(seed)
    counts = [3, 5, 2, 4, 3]
    z = np.concatenate([np.sort(rng.uniform(-0.5, 0.5, count)) * THICKNESS for count in counts])
    return np.column_stack([np.repeat(rng.random((5, 2)) * SIZE, counts, axis=0), z])


@pytest.mark.parametrize("shape", list(shapes()), ids=lambda shape: type(shape).__name__ + getattr(shape, "name", ""))
def test_gradients_are_products(shape):
    """N_x Z, N_y Z and N Z' are the parametric gradients of every function at every point; of the mid-surface's without
    a part along z."""
    points = uneven()
    found = columns(shape, points, SIZE, np.tile(np.eye(3), (len(points), 1, 1)))
    _, gradients = shape.evaluate(points[found.order], SIZE)
    column = np.concatenate([np.arange(count) for count in found.levels])
    expected = np.zeros_like(gradients)
    for i, number in enumerate(found.in_z.tolist()):
        zeta = found.zeta[slots(number)]
        for P, own in enumerate(zeta):
            expected[:, i, P] = found.N[P, i, column] * own
    np.testing.assert_allclose(expected, gradients, atol=1e-13 * np.abs(gradients).max())
    np.testing.assert_array_equal(np.sort(found.order), np.arange(len(points)))
    assert found.levels.tolist() == [5, 5, 4, 2, 1]


@pytest.mark.parametrize("kind", [kind for kind in PLATES if "grooved" in kind])
@pytest.mark.parametrize("element", ["conforming", "enriched"], indirect=True)
def test_tangents_of_kinked_elements_are_those_of_points(element, kind):
    """The plain sum over points on flat and curved plates, for columns of different heights, walls and lips."""
    lines, bands, surface = PLATES[kind]
    mesh = with_walls(grid(*lines, surface, FAMILY[element]), bands, THICKNESS)
    rng, kinked = np.random.default_rng(2), 0
    for e, cell in enumerate(mesh.cells):
        shape, own = mesh.element(e)
        rule = element_rule(cell, bands, THICKNESS, (4, 4, 3), levels=mesh.levels(e))
        part = integrand(shape, rule, cell, mesh.vectors[own], (), False)
        Q = (mesh.vectors[own] + 0.002 * rng.standard_normal((len(own), 3)))[None]
        fast = HyperelasticElements(RUBBER, (form(part),), np.zeros(1, dtype=int), relax=False)
        (one,), (other,) = fast.tangent(Q), PointElements((part,), RUBBER).tangent(Q)
        np.testing.assert_allclose(one, other, atol=1e-12 * np.abs(other).max())
        kinked += shape is not mesh.shape
    assert kinked
