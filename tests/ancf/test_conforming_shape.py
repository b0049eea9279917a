"""Truths of the shape functions."""

import numpy as np
import pytest

from ancf.shape import CONFORMING, CORNERS

SIZE = (0.7, 0.4)
RNG = np.random.default_rng(1)
POINTS = RNG.uniform(size=(40, 3)) * (*SIZE, 0.1) - (0, 0, 0.05)


def test_position_functions_sum_to_one_and_their_derivatives_to_zero():
    S, S_p = CONFORMING.evaluate(POINTS, SIZE)
    positions = list(CONFORMING.positions)
    np.testing.assert_allclose(S[:, positions].sum(axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(S_p[:, positions].sum(axis=1), 0, atol=1e-13)


@pytest.mark.parametrize("p", [0, 1, 2])
def test_derivatives_equal_differences(p):
    """Central differences of cubics are exact to h^2 / 6 times a third derivative of about 12/a^3."""
    h = 1e-5
    step = h * np.eye(3)[p]
    difference = CONFORMING.evaluate(POINTS + step, SIZE).S - CONFORMING.evaluate(POINTS - step, SIZE).S
    np.testing.assert_allclose(CONFORMING.evaluate(POINTS, SIZE).S_p[:, :, p], difference / (2 * h), atol=1e-8)


@pytest.mark.parametrize("corner", range(4))
def test_each_nodal_vector_is_what_its_name_says(corner):
    """At a corner the field takes the corner's r, and its derivatives the corner's r_x, r_y, r_z."""
    at = np.array([[CORNERS[corner][0] * SIZE[0], CORNERS[corner][1] * SIZE[1], 0.0]])
    S, S_p = CONFORMING.evaluate(at, SIZE)
    own = np.zeros((16, 4))
    own[4 * corner + np.arange(4), np.arange(4)] = 1
    np.testing.assert_allclose(np.column_stack([S[0], S_p[0]]), own, atol=1e-14)


def test_field_is_conforming_across_an_edge():
    """Two elements that share an edge agree there in position and slope for any nodal vectors of it."""
    y = np.linspace(0, SIZE[1], 7)
    left = CONFORMING.evaluate(np.column_stack([0 * y + SIZE[0], y, 0 * y + 0.02]), SIZE)
    right = CONFORMING.evaluate(np.column_stack([0 * y, y, 0 * y + 0.02]), (1.3, SIZE[1]))
    shared_left, shared_right = np.r_[4:12], np.r_[0:4, 12:16]
    others_left, others_right = np.r_[0:4, 12:16], np.r_[4:12]
    np.testing.assert_allclose(left.S[:, shared_left], right.S[:, shared_right], atol=1e-15)
    np.testing.assert_allclose(left.S[:, others_left], 0, atol=1e-15)
    np.testing.assert_allclose(right.S[:, others_right], 0, atol=1e-15)
    mid_surface = np.r_[4:7, 8:11]
    np.testing.assert_allclose(left.S_p[:, mid_surface, 0], right.S_p[:, np.r_[0:3, 12:15], 0], atol=1e-13)


@pytest.mark.parametrize("power", [(i, j) for i in range(4) for j in range(4) if i + j <= 3 and (i < 2 or j < 2)])
def test_mid_surface_reproduces_polynomials_without_the_twist_term(power):
    """Cubics whose mixed derivative vanishes at the corners' interpolation: x^i and y^j alone are reproduced.

    xy is not: the element has no nodal r_xy. It interpolates xy with an error that this test demands.
    """
    i, j = power
    x, y = POINTS[:, 0], POINTS[:, 1]
    nodal = []
    for c, d in CORNERS:
        a, b = c * SIZE[0], d * SIZE[1]
        nodal += [a**i * b**j, i * a ** max(i - 1, 0) * b**j, j * a**i * b ** max(j - 1, 0), 0.0]
    flat = POINTS * (1, 1, 0)
    error = np.abs(CONFORMING.evaluate(flat, SIZE).S @ np.array(nodal) - x**i * y**j).max()
    assert error < 1e-15 if 0 in (i, j) else error > 1e-4
