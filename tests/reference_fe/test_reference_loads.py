"""Nodal shares carry a load's resultant and moment; probes evaluate the quadratic field."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_fe.geometry import Band, Curve, MeshError, Plate
from reference_fe.loads import Load, face_share, line_share, load_at, region_share
from reference_fe.mesh import Spacing, make
from reference_fe.probes import point_weights


@pytest.fixture(scope="module")
def solid(build):
    regions, lines = (((0.7, 1.0), (0.5, 0.8)),), ((1.0, 0.8), (0.6, 0.4))
    return make(replace(build.grooved, regions=regions, lines=lines), Spacing(0.3))


def test_line_share_is_uniform_through_the_kept_thickness(solid):
    z = solid.box.doflocs[2]
    for at, (low, high) in {(1.0, 0.8): (-0.05, 0.05), (0.6, 0.4): (0.01, 0.05)}.items():
        share = line_share(solid, at)
        assert np.allclose(solid.box.doflocs[:2] @ share, at)
        moments = [share.sum(), share @ z, share @ z**2]
        exact = [1, (low + high) / 2, (high**3 - low**3) / 3 / (high - low)]
        assert np.allclose(moments, exact, rtol=1e-12, atol=1e-15)


def test_face_share_is_uniform_over_the_edge(solid):
    share = face_share(solid, 0, 1.0)
    y, z = solid.box.doflocs[1:]
    area, groove = 0.8 * 0.1, 0.2 * 0.06
    kept = area - groove
    exact = [1.0, (area * 0.4 - groove * 0.4) / kept, -groove * -0.02 / kept]
    assert np.allclose([share.sum(), share @ y, share @ z], exact, rtol=1e-12, atol=1e-15)


def test_region_share_averages_a_quadratic_field(solid):
    share = region_share(solid, ((0.7, 1.0), (0.5, 0.8)))
    x, y, z = solid.box.doflocs
    exact = [(1 - 0.7**3) / 0.9, (0.8**3 - 0.5**3) / 0.9, 0.1**2 / 12]
    assert np.allclose([share @ x**2, share @ y**2, share @ z**2], exact, rtol=1e-12)


def test_histories_are_piecewise_linear_and_constant_outside():
    force = np.array([[0.0, 0.0, -2.0]])
    total = load_at((Load(force, np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 0.0]])),), force.shape)
    assert [total(t)[0, 2] for t in (-1.0, 0.0, 0.25, 1.0, 2.0, 5.0)] == [0, 0, -0.5, -2, -1, 0]


def test_point_probe_evaluates_a_quadratic_field_exactly(solid):
    x, y, z = solid.box.doflocs
    field = 1 + 2 * x - y + x * y - 3 * z * z + y * z
    for px, py, pz in [(0.31, 0.17, 0.02), (1.0, 0.8, 0.0), (0.0, 0.0, -0.05), (0.5, 0.4, 0.03)]:
        value = point_weights(solid, (px, py, pz)) @ field
        assert math.isclose(value, 1 + 2 * px - py + px * py - 3 * pz * pz + py * pz, rel_tol=1e-12)


def test_point_probe_finds_its_place_in_curved_tetrahedra():
    """Beside a quarter-circle wall of radius 0.05 m; the elements reproduce the coordinates themselves."""
    w = 2**-0.5
    points = [[0.3, 0], [0.3, 0.05], [0.35, 0.05], [0.4, 0.05], [0.45, 0.05], [0.5, 0.05], [0.5, 0]]
    section = Curve(2, np.array(points), np.array([1, w, 1, 1, 1, w, 1]), KNOTS)
    plate = Plate(1.0, 0.8, 0.1, grooves=(Band(-1, 0, (0.3, 0.5), (0.0, 1.0), section),))
    solid = make(plate, Spacing(0.3))
    for angle in np.linspace(0.1, 1.4, 5):
        y, z = 0.35 - 0.053 * math.cos(angle), -0.05 + 0.053 * math.sin(angle)
        weights = point_weights(solid, (0.41, y, z))
        assert np.allclose(solid.box.doflocs @ weights, [0.41, y, z], atol=1e-12)


KNOTS = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 3])


@pytest.mark.parametrize("at", [(0.5, 0.4, -0.03), (1.1, 0.4, 0.0)], ids=["in the groove", "beside the plate"])
def test_a_probe_off_the_solid_is_a_named_failure(solid, at):
    with pytest.raises(MeshError) as failure:
        point_weights(solid, at)
    assert failure.value.status == "probe_outside"


def test_point_probe_on_a_cylinder_sits_on_its_normal(build):
    solid = build.curved(0.2)
    around = solid.box.p[1].max()
    position = solid.mesh.doflocs @ point_weights(solid, (0.2, around / 2, 0.07))
    assert np.allclose(position, [0.2, 0.0, 1.07], atol=1e-3)  # inside a quadratic element of 0.2 m


def test_a_load_that_misses_the_solid_is_a_named_failure(solid):
    for miss in (lambda: line_share(solid, (0.55, 0.55)), lambda: region_share(solid, ((1.2, 1.3), (0.0, 0.1)))):
        with pytest.raises(MeshError) as failure:
            miss()
        assert failure.value.status == "load_misses"
