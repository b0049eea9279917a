"""OCC's mid-surface: the map of the box and its volume element, on a doubly curved patch."""

from __future__ import annotations

import numpy as np
import pytest

from reference_fe.geometry import MeshError
from reference_fe.surface import Frame, Surface, carry, volume_element


def dome() -> Surface:
    """A rational biquadratic dome with unequal weights; parameters x in [2, 4], y in [0, 1]."""
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 0.5, 1.5], indexing="ij")
    points = np.stack([x, y, np.array([[0, 0.1, 0], [0.2, 1.0, 0.3], [0, 0.2, 0.1]])], axis=-1)
    weights = np.array([[1, 0.8, 1], [0.7, 1.3, 0.9], [1, 1.1, 1]])
    knots = (np.array([2.0, 2, 2, 4, 4, 4]), np.array([0.0, 0, 0, 1, 1, 1]))
    return Surface((2, 2), knots, points, weights, Frame((2.0, 0.0), (1.1, 1.7)))


def box_points(count: int = 50) -> np.ndarray:
    inside = np.random.default_rng(0).uniform(0.05, 0.95, (3, count))
    return inside * [[2.2], [1.7], [0.2]] - [[0.0], [0.0], [0.1]]


def test_position_is_the_rational_bernstein_sum():
    surface, box = dome(), box_points()
    box[2] = 0
    s, t = (surface.parameters(box) - [2.0, 0.0]).T / [[2.0], [1.0]]
    basis = [np.array([(1 - u) ** 2, 2 * u * (1 - u), u * u]) for u in (s, t)]
    weight = np.einsum("ik,jk,ij->ijk", *basis, surface.weights)
    exact = np.einsum("ijk,ijc->ck", weight, surface.points) / weight.sum(axis=(0, 1))
    assert np.abs(carry(surface, box) - exact).max() < 1e-13


def test_thickness_runs_along_unit_normals():
    surface, box = dome(), box_points()
    foot = carry(surface, box * [[1], [1], [0]])
    step = np.eye(3)[:, :, None] * 1e-6
    S_x, S_y = ((carry(surface, box * [[1], [1], [0]] + step[i]) - foot) / 1e-6 for i in (0, 1))
    rise = carry(surface, box) - foot
    normal = np.cross(S_x.T, S_y.T).T
    assert np.allclose(rise, box[2] * normal / np.linalg.norm(normal, axis=0), atol=1e-6)


def test_volume_element_is_the_determinant_of_the_map():
    surface, box = dome(), box_points()
    step = np.eye(3)[:, :, None] * 1e-5
    gradient = np.array([(carry(surface, box + step[i]) - carry(surface, box - step[i])) / 2e-5 for i in range(3)])
    assert np.allclose(volume_element(surface, box), np.linalg.det(gradient.transpose(2, 0, 1)), rtol=1e-8)


def test_creases_are_knots_without_a_common_tangent():
    knots = (np.array([0.0, 0, 0, 1, 2, 2, 3, 3, 3]), np.array([0.0, 0, 1, 1]))
    points = np.zeros((6, 2, 3))
    surface = Surface((2, 1), knots, points, np.ones((6, 2)), Frame((0.0, 0.0), (10.0, 1.0)))
    assert np.array_equal(surface.creases(0), [20.0]) and surface.creases(1).size == 0


def test_a_surface_that_folds_to_a_line_is_a_named_failure():
    flat = dome()
    line = Surface(flat.degree, flat.knots, flat.points * [1.0, 0.0, 0.0], flat.weights, flat.frame)
    with pytest.raises(MeshError) as failure:
        carry(line, box_points())
    assert failure.value.status in ("surface_degenerate", "geometry_failed")
