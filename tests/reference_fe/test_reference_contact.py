"""Contact in the reference: one facet by hand, the face that touches, and what a step conserves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from reference_fe.contact import Contact, Law, Obstacle, drum, face, plane, sphere
from reference_fe.contact_kernel import _pressure, _ramp
from reference_fe.geometry import Band, Curve, Plate
from reference_fe.mesh import Spacing, make

BLOCK = Plate(1.0, 1.0, 0.5)
GROUND = plane([0.0, 0.0, -0.25], [0.0, 0.0, 1.0])
BODIES = {
    "plane": plane([0.0, 0.0, -0.27], [0.1, -0.2, 1.0]),
    "sphere": sphere([0.4, 0.5, -1.2], 1.0),
    "drum": drum([0.4, 0.5, -1.2], [1.0, 0.3, 0.1], 1.0),
}
EVERY_BODY = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)


def touching(build, body, law, plate=BLOCK, size=0.5, kind="pressure"):
    """A free block and an obstacle under it: system and contact."""
    solid = build.solid(plate, size)
    system = build.system(solid)
    contact = Contact((Obstacle(body, law, face(solid, system.pattern, -1, kind)),), reach=1e-9)
    return replace(system, contact=contact)


def moved(system, size=0.02, seed=0, sink=0.0):
    """Random displacements (n, 3) of a size (m), lowered by `sink`."""
    shape = (system.pattern.number.size, 3)
    return size * np.random.default_rng(seed).standard_normal(shape) - [0.0, 0.0, sink]


def resultant(system, u, law_path):
    force, _ = law_path.force(u)
    return force.sum(axis=0)


def test_one_facet_pressed_flat_by_hand(build):
    """Sunk by 0.01 m everywhere, 1 m2 at 1e6 N/m3 carries 1e4 N, about the middle of the face."""
    system = touching(build, GROUND, Law(1e6))
    u = np.zeros((system.pattern.number.size, 3)) - [0.0, 0.0, 0.01]
    way = system.contact.at_rest(system.contact.begin(np.zeros_like(u)))
    force, grip = way.force(u)
    assert np.allclose(force.sum(axis=0), [0.0, 0.0, 1e4], rtol=1e-12, atol=1e-8)
    places = build.solid(BLOCK, 0.5).mesh.doflocs.T
    assert np.allclose(np.cross(places - 0.5, force).sum(axis=0)[:2], 0.0, atol=1e-8)
    assert np.isclose(way.settle(u).stored, 0.5 * 1e6 * 0.01**2, rtol=1e-12)
    assert grip.sum() > 0 and grip[places[:, 2] > -0.2].max() == 0


def test_a_tilted_face_presses_as_its_wedge_by_hand(build):
    """Sunk linearly from 0 to 0.02 m: half of 2e4 N, at two thirds of the width."""
    system = touching(build, GROUND, Law(1e6))
    places = build.solid(BLOCK, 0.5).mesh.doflocs.T
    u = np.outer(places[:, 0], [0.0, 0.0, -0.02])
    force, _ = system.contact.at_rest(system.contact.begin(np.zeros_like(u))).force(u)
    assert np.isclose(force[:, 2].sum(), 1e4, rtol=1e-12)
    assert np.isclose(places[:, 0] @ force[:, 2] / 1e4, 2 / 3, rtol=1e-12)


def test_nodes_are_the_points_of_law_points(build):
    system = touching(build, GROUND, Law(500.0), kind="points")
    u = np.zeros((system.pattern.number.size, 3)) - [0.0, 0.0, 0.01]
    force, _ = system.contact.at_rest(system.contact.begin(np.zeros_like(u))).force(u)
    below = np.isclose(build.solid(BLOCK, 0.5).mesh.doflocs[2], -0.25)
    assert np.allclose(force, np.where(below[:, None], [0.0, 0.0, 5.0], 0.0), atol=1e-12)


def test_the_true_face_has_the_groove_s_floor_and_not_its_walls(build):
    """A groove 0.06 deep lifts its floor by as much; walls have no normal along z and carry nothing."""
    solid = build.solid(build.grooved, 0.2)
    bottom = face(solid, build.system(solid).pattern, -1)
    heights = bottom.place[..., 2]
    assert np.isclose(bottom.weight.sum(), 0.8, rtol=1e-12)
    assert np.isclose(bottom.weight[heights > -0.02].sum(), 0.2, rtol=1e-12)
    assert set(np.round(np.unique(heights), 9)) == {-0.05, 0.01}
    top = face(solid, build.system(solid).pattern, 1)
    assert np.allclose(top.place[..., 2], 0.05) and np.isclose(top.weight.sum(), 0.8, rtol=1e-12)


def test_a_curved_floor_belongs_to_the_face_with_its_own_area(build):
    """A parabolic groove of width b and depth t has the arc b/2 sqrt(1 + q²) + b/(2 q) asinh q, q = 4 t / b."""
    points = np.array([[0.3, 0.0], [0.4, 0.1], [0.5, 0.0]])  # depth 0.05 in the middle
    curve = Curve(2, points, np.ones(3), np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]))
    solid = make(Plate(0.4, 0.8, 0.1, grooves=(Band(-1, 0, (0.3, 0.5), (0.0, 0.4), curve),)), Spacing(0.1))
    bottom = face(solid, build.system(solid).pattern, -1)
    q = 4 * 0.05 / 0.2
    arc = 0.1 * (np.sqrt(1 + q**2) + np.arcsinh(q) / q)
    assert np.isclose(bottom.weight.sum(), 0.4 * (0.6 + arc), rtol=1e-4)  # six curved edges on a full turn


def test_a_curved_mid_surface_is_pressed_on_its_own_area(build):
    """The inner face of a quarter cylinder of radius 1, thickness 0.2: radius 0.9."""
    solid = build.curved(0.2)
    bottom = face(solid, build.system(solid).pattern, -1)
    assert np.isclose(bottom.weight.sum(), 0.4 * 0.9 * np.pi / 2, rtol=1e-5)
    assert np.allclose(np.hypot(bottom.place[..., 1], bottom.place[..., 2]), 0.9, atol=1e-4)
    assert np.allclose(bottom.box[..., 2], -0.1, atol=1e-12)


@pytest.mark.parametrize("law", [(1e6, 0.0), (1e6, 3e3), (1e6, 1e5)], ids=["spring", "damped", "overdamped"])
@pytest.mark.parametrize("start", [0.0, 1 / 9], ids=["whole step", "generalized-alpha"])
def test_the_mean_pressure_is_the_law_s_along_the_way(law, start):
    """Against the law summed over 20,000 points of the way, for ways in, out, through and beside."""
    k, c = law
    path, numbers = (1e3, start, 0.0), (k, c, 0.0, k, c)
    for d0, d1 in [
        (-1e-3, 2e-3),
        (2e-3, -1e-3),
        (1e-3, 2e-3),
        (2e-3, 1.9e-3),
        (2e-3, 0.5e-3),
        (1e-3, 1e-3),
        (-2e-3, 0),
    ]:
        s = start + (1 - start) * (np.arange(20_000) + 0.5) / 20_000
        d, rate = d0 + s * (d1 - d0), 1e3 * (d1 - d0)
        mean = np.where(d > 0, np.maximum(0.0, k * d + c * rate), 0.0).mean()
        pressure, slope, spring = _pressure(numbers, path, d0, d1)
        assert np.isclose(pressure, mean, rtol=2e-4, atol=1e-3 * k * 1e-3)
        assert np.isclose(spring, k * np.maximum(0.0, d).mean(), rtol=2e-4, atol=1e-3 * k * 1e-3)
        more, less = (_pressure(numbers, path, d0, d1 + e)[0] for e in (1e-9, -1e-9))
        if d0 != d1 and d1 != 0:  # where the law has a kink, the slope is one of both sides
            assert np.isclose(slope, (more - less) / 2e-9, rtol=1e-5)


def test_a_mean_over_nothing_is_the_value():
    assert _ramp(0.5, 0.5) == (0.5, 0.5, 0.5, 1.0) and _ramp(-1.0, -1.0)[0] == 0.0 and _ramp(0.0, 0.0)[0] == 0.0


@EVERY_BODY
@pytest.mark.parametrize(
    "law", [Law(1e6), Law(1e6, 2e3), Law(1e6, 2e3, 1e9, 4e5, 1e3)], ids=["spring", "damped", "sticking"]
)
def test_the_tangent_is_the_differenced_force(build, body, law):
    """Where everything sticks, but for the small part that the normal's turn within a step makes unsymmetric."""
    system = touching(build, body, law)
    before, after = moved(system, 0.01), moved(system, 0.01, 1, sink=0.02)
    way = system.contact.during(system.contact.begin(before), 1e-2, 0.0)
    values = np.zeros(system.pattern.indices.size)
    way.add_tangent(system.pattern, after, values)
    size = 3 * system.pattern.free.size
    upper = csr_matrix((values, system.pattern.indices, system.pattern.indptr), shape=(size, size))
    tangent = (upper + triu(upper, 1).T).toarray()
    step = 1e-7 * np.eye(size).reshape(size, -1, 3)
    differences = np.array([(way.force(after - e)[0] - way.force(after + e)[0]).ravel() / 2e-7 for e in step])
    symmetric = 0.5 * (differences + differences.T)
    error = np.abs(tangent - symmetric).max() / np.abs(tangent).max()
    assert error < (0.02 if body[0] != 0 and law.friction else 1e-6)
