"""Truths of the shape functions, for every member of the family."""

import numpy as np
import pytest

from ancf.shape import CORNERS, EDGES, FAMILY

SIZE = (0.7, 0.4)
RNG = np.random.default_rng(1)
POINTS = RNG.uniform(size=(40, 3)) * (*SIZE, 0.1) - (0, 0, 0.05)


@pytest.fixture(params=list(FAMILY))
def shape(request):
    return FAMILY[request.param]


def on_corner(shape, corner):
    """Functions of a corner."""
    return corner * len(shape.node_kinds) + np.arange(len(shape.node_kinds))


def on_edge(shape, edge):
    """Functions that are not zero on the edge: those of its ends and its own."""
    axis, start = EDGES[edge]
    end = tuple(c + (p == axis) for p, c in enumerate(start))
    own = 4 * len(shape.node_kinds) + edge * len(shape.edge_kinds) + np.arange(len(shape.edge_kinds))
    return np.concatenate([on_corner(shape, CORNERS.index(start)), on_corner(shape, CORNERS.index(end)), own])


def test_position_functions_sum_to_one_and_their_derivatives_to_zero(shape):
    S, S_p = shape.evaluate(POINTS, SIZE)
    positions = list(shape.positions)
    np.testing.assert_allclose(S[:, positions].sum(axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(S_p[:, positions].sum(axis=1), 0, atol=1e-13)


@pytest.mark.parametrize("p", [0, 1, 2])
def test_derivatives_equal_differences(shape, p):
    """Central differences of cubics are exact to h^2 / 6 times a third derivative of about 12/a^3."""
    h = 1e-5
    step = h * np.eye(3)[p]
    difference = shape.evaluate(POINTS + step, SIZE).S - shape.evaluate(POINTS - step, SIZE).S
    np.testing.assert_allclose(shape.evaluate(POINTS, SIZE).S_p[:, :, p], difference / (2 * h), atol=1e-8)


def test_values_alone_are_those_with_derivatives(shape):
    np.testing.assert_array_equal(shape.values(POINTS, SIZE), shape.evaluate(POINTS, SIZE).S)


@pytest.mark.parametrize("corner", range(4))
def test_each_nodal_vector_is_what_its_name_says(shape, corner):
    """At a corner the field takes the corner's r, and its derivatives the corner's r_x, r_y, r_xy, r_z."""
    at = np.array([[CORNERS[corner][0] * SIZE[0], CORNERS[corner][1] * SIZE[1], 0.0]])
    S, S_p = shape.evaluate(at, SIZE)
    h = 1e-5
    step = np.array([[0.0, h, 0.0]])
    by_xy = (shape.evaluate(at + step, SIZE).S_p[:, :, 0] - shape.evaluate(at - step, SIZE).S_p[:, :, 0]) / (2 * h)
    found = {"r": S[0], "r_x": S_p[0, :, 0], "r_y": S_p[0, :, 1], "r_z": S_p[0, :, 2], "r_xy": by_xy[0]}
    for place, kind in zip(on_corner(shape, corner), shape.node_kinds, strict=True):
        own = np.zeros(len(shape.kinds))
        own[place] = 1
        np.testing.assert_allclose(found[kind], own, atol=1e-8 if kind == "r_xy" else 1e-14)


def test_edge_vector_is_the_excess_of_the_director_at_the_middle():
    """At the middle of an edge r_z is the mean of its ends plus the edge's own vector."""
    shape = FAMILY["enriched"]
    for edge, (axis, start) in enumerate(EDGES):
        at = np.array([[*start, 0.0]], dtype=float)
        at[0, axis] = 0.5
        expected = np.zeros(len(shape.kinds))
        functions = on_edge(shape, edge)
        expected[functions[[4, 9]]], expected[functions[10]] = 0.5, 1.0
        np.testing.assert_allclose(shape.evaluate(at * (*SIZE, 1), SIZE).S_p[0, :, 2], expected, atol=1e-15)


@pytest.mark.parametrize("axis", [0, 1])
def test_field_is_conforming_across_an_edge(shape, axis):
    """Two elements that share an edge agree there in position and mid-surface slope for any nodal vectors of it.

    A blended mid-surface agrees in position alone; the test demands the jump of its slope.
    """
    s = np.linspace(0, SIZE[1 - axis], 7)
    along, sizes = np.zeros((7, 3)), np.array([SIZE, SIZE])
    along[:, 1 - axis], along[:, 2] = s, 0.02
    beyond = along.copy()
    beyond[:, axis] = SIZE[axis]
    sizes[1, axis] = 1.3
    one, other = shape.evaluate(beyond, tuple(sizes[0])), shape.evaluate(along, tuple(sizes[1]))
    last, first = (on_edge(shape, edge) for edge in ((1, 3) if axis == 0 else (2, 0)))
    np.testing.assert_allclose(one.S[:, last], other.S[:, first], atol=1e-15)
    np.testing.assert_allclose(np.delete(one.S, last, axis=1), 0, atol=1e-15)
    np.testing.assert_allclose(np.delete(other.S, first, axis=1), 0, atol=1e-15)
    mid = np.array([shape.kinds[i] in ("r", "r_x", "r_y", "r_xy") for i in last])
    jump = np.abs(one.S_p[:, last[mid], axis] - other.S_p[:, first[mid], axis]).max()
    assert jump > 0.1 if shape.blended else jump < 1e-13


@pytest.mark.parametrize("power", [(i, j) for i in range(4) for j in range(4)])
def test_mid_surface_reproduces_polynomials(shape, power):
    """Bicubic with r_xy at the nodes; without it x^i and y^j alone; blended also x^i y and x y^j.

    Any other is interpolated with an error that this test demands.
    """
    i, j = power
    x, y = POINTS[:, 0], POINTS[:, 1]
    nodal = []
    for c, d in CORNERS:
        f, f_x = (c * SIZE[0]) ** i, i * (c * SIZE[0]) ** max(i - 1, 0)
        g, g_y = (d * SIZE[1]) ** j, j * (d * SIZE[1]) ** max(j - 1, 0)
        values = {"r": f * g, "r_x": f_x * g, "r_y": f * g_y, "r_xy": f_x * g_y, "r_z": 0.0}
        nodal += [values[kind] for kind in shape.node_kinds]
    nodal += [0.0] * 4 * len(shape.edge_kinds)
    error = np.abs(shape.evaluate(POINTS * (1, 1, 0), SIZE).S @ np.array(nodal) - x**i * y**j).max()
    exact = shape.twist or min(i, j) == 0 or (shape.blended and min(i, j) == 1)
    assert error < 1e-15 if exact else error > 1e-5


@pytest.mark.parametrize("power", [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2)])
def test_director_reproduces_what_it_promises(power):
    """With edge vectors: the eight functions that are quadratic on edges, x^2 y and x y^2 included."""
    shape, (i, j) = FAMILY["enriched"], power

    def value(s, t):
        return (s * SIZE[0]) ** i * (t * SIZE[1]) ** j

    nodal = np.zeros(len(shape.kinds))
    nodal[np.array(shape.kinds) == "r_z"] = [value(*corner) for corner in CORNERS]
    for edge, (axis, start) in enumerate(EDGES):
        end = [c + (p == axis) for p, c in enumerate(start)]
        middle = [(c + d) / 2 for c, d in zip(start, end, strict=True)]
        nodal[20 + edge] = value(*middle) - (value(*start) + value(*end)) / 2
    x, y, z = POINTS.T
    np.testing.assert_allclose(shape.evaluate(POINTS, SIZE).S @ nodal, z * x**i * y**j, atol=1e-16)
