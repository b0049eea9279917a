"""Every rule keeps its promise for every degree up to it, and gauss promises no less than it can."""

import numpy as np
import pytest

from ancf.quadrature import gauss, join, onto_cell, tensor

ROUND_OFF = 1e-14


def integral(interval, power):
    """Closed form of the integral of x^power."""
    low, high = interval
    return (high ** (power + 1) - low ** (power + 1)) / (power + 1)


@pytest.mark.parametrize("count", range(1, 13))
def test_gauss_is_exact_to_its_degree_and_not_beyond(count):
    rule = gauss(count)
    found = [rule.weights @ rule.points[:, 0] ** power for power in range(rule.degree + 2)]
    exact = [integral((-1, 1), power) for power in range(rule.degree + 2)]
    assert np.abs(np.subtract(found, exact))[:-1].max() < 4 * ROUND_OFF
    assert abs(found[-1] - exact[-1]) > 1e-8  # degree 2 count is beyond the rule


@pytest.mark.parametrize("counts", [(1,), (3, 2), (3, 4, 2), (7, 7, 3)])
def test_product_on_a_cell_is_exact_to_its_degree(counts):
    cell = [(-0.3, 0.5), (0.2, 1.1), (-0.025, 0.005)][: len(counts)]
    rule = onto_cell(tensor(*(gauss(count) for count in counts)), cell)
    for powers in np.ndindex(*(rule.degree + 1 for _ in counts)):
        exact = np.prod([integral(side, power) for side, power in zip(cell, powers, strict=True)])
        found = rule.weights @ np.prod(rule.points**powers, axis=1)
        assert abs(found - exact) < ROUND_OFF


def test_first_coordinate_varies_slowest():
    points = tensor(gauss(2), gauss(3)).points
    assert np.all(np.diff(points[:3, 0]) == 0) and np.all(np.diff(points[:3, 1]) > 0)


def test_join_integrates_the_union_and_promises_the_least():
    parts = onto_cell(gauss(3), [(0, 1)]), onto_cell(gauss(2), [(1, 3)])
    rule = join(*parts)
    assert rule.degree == 3
    for power in range(rule.degree + 1):
        assert abs(rule.weights @ rule.points[:, 0] ** power - integral((0, 3), power)) < 10 * ROUND_OFF


@pytest.mark.parametrize("cell", [[(1, 0)], [(0, 0)], [(0, 1), (0, 1)]])
def test_a_cell_that_does_not_fit_is_refused(cell):
    with pytest.raises(ValueError, match="cell"):
        onto_cell(gauss(2), cell)


def test_gauss_without_points_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        gauss(0)
