"""Elements that are images of each other: what they share, and that it is theirs."""

from dataclasses import replace

import numpy as np
import pytest

import ancf.system
from ancf.image import images
from ancf.mesh import grid
from ancf.nurbs import Surface
from ancf.shape import FAMILY
from ancf.sharing import sharing
from ancf.subdomain import BOTTOM, GROOVE, TOP, Band
from ancf.system import system

EDGES = ("x0", "x1", "y0", "y1")
EVEN = np.linspace(0.0, 1.0, 6)
LINES = (EVEN, EVEN)
BOTH_WAYS = (
    Band(BOTTOM, GROOVE, 0, (0.22, 0.29), 0.03),
    Band(BOTTOM, GROOVE, 0, (0.71, 0.78), 0.03),
    Band(TOP, GROOVE, 1, (0.32, 0.38), 0.015),
)


def test_functions_of_an_image_are_those_of_the_element(element):
    """S_i of the image at the image of a point, against the element's own in another order, with signs."""
    shape, (a, b) = FAMILY[element], (0.3, 0.2)
    points = np.random.default_rng(0).uniform((0, 0, -0.02), (a, b, 0.02), (7, 3))
    own = shape.evaluate(points, (a, b)).S
    seen = set()
    for image in images(shape, square=True):
        moved = np.where([*image.flips, False], (a, b, 0.0) - points, points)
        sides = (b, a) if image.swaps else (a, b)
        moved = moved[:, [1, 0, 2]] if image.swaps else moved
        np.testing.assert_allclose(shape.evaluate(moved, sides).S, own[:, image.order] * image.signs, atol=1e-15)
        seen.add((tuple(image.order), tuple(image.signs)))
    first = images(shape, square=True)[0]
    assert len(seen) == 8 and not (first.swaps or any(first.flips))
    assert len(images(shape, square=False)) == 4


def alone(monkeypatch, make, **options):
    """A body whose elements share nothing with their images."""
    with monkeypatch.context() as patch:
        patch.setattr(ancf.system, "possible", lambda mesh, points: ())
        return make(**options)


def values(plate, q):
    """Tangent, force with a term beside it, mass on the pattern, and energies of a free plate."""
    acting = system(plate, np.zeros(q.size, dtype=bool), (), 0.05)
    beside = 0.02 * np.random.default_rng(1).standard_normal(q.size)
    force = acting.force_internal(q, [(0.3, beside)])
    return acting.tangent(q), force, acting.mass_values, np.array(acting.energies(q, beside))


@pytest.mark.parametrize("pointwise", [False, True])
@pytest.mark.parametrize("points", [(5, 5, 3), (5, 6, 3)])
@pytest.mark.parametrize("kind", ["plain", "curved"])
def test_sharing_with_images_changes_nothing(make_body, deformed, monkeypatch, kind, points, pointwise):
    """Grooves both ways and layers on free edges: 1e-12 of the largest entry, the same sums in another order."""
    pair = (Band(BOTTOM, GROOVE, 0, (0.2, 0.45), 0.02), Band(BOTTOM, GROOVE, 0, (0.55, 0.8), 0.02))
    bands = BOTH_WAYS if kind == "plain" else pair
    lines = LINES if kind == "plain" else (np.linspace(0, 0.5, 4), np.linspace(0, 1, 5))
    options = {"kind": kind, "lines": lines, "bands": bands, "free": EDGES, "points": points, "pointwise": pointwise}
    shared, own = make_body(**options), alone(monkeypatch, make_body, **options)
    assert shared.shapes <= 0.67 * own.shapes
    assert shared.volume == pytest.approx(own.volume, rel=1e-13)
    q = deformed(shared).ravel()
    for found, expected in zip(values(shared, q), values(own, q), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_what_only_looks_like_an_image_is_none(make_body):
    """A groove on the other face, of another depth or nearer to the line has a form of its own."""
    groove = Band(BOTTOM, GROOVE, 0, (0.22, 0.29), 0.03)
    mirrored = replace(groove, edges=(0.71, 0.78))
    shapes = make_body(lines=LINES, bands=(groove, mirrored)).shapes
    for other in (
        replace(mirrored, face=TOP),
        replace(mirrored, section=0.02),
        replace(mirrored, edges=(0.71, 0.79)),
    ):
        assert make_body(lines=LINES, bands=(groove, other)).shapes > shapes


def test_a_small_plate_has_as_many_forms_as_a_large_one():
    """A patch with a bent edge, no two elements of which are equal: its positions and gradients are as small as it is,
    its normals are not."""
    for size in (1.0, 1e-6):
        points = size * np.array([[(x + 0.1 * y * y, y, 0.0) for y in (0, 0.5, 1)] for x in (0, 0.1, 0.4, 1)])
        patch = Surface((3, 2), ([0] * 4 + [1] * 4, [0] * 3 + [1] * 3), points)
        lines = np.linspace(0, 1, 9)
        assert len(sharing(grid(lines, lines, patch), ()).first) == 64
