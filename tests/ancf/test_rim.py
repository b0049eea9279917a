"""Edges on a rigid rim: closed forms, and the bordered factors against dense ones."""

import numpy as np
import pytest

from ancf.assembly import Pattern
from ancf.border import BorderedSolver, bordered
from ancf.integrate import SCHEMES, initial_state, step
from ancf.linear_solver import SingularMatrix
from ancf.rim import _rate, _rotation
from ancf.run import solve
from ancf.unpack import build, initial_velocity
from tests import rim_scenes


@pytest.mark.parametrize("case", rim_scenes.CASES, ids=lambda case: case.__name__)
def test_a_rim(case):
    case(solve, "ancf")


def _banded(n, seed, symmetric):
    """A positive definite matrix with a band of 3, and its Pattern's values of both triangles."""
    rng = np.random.default_rng(seed)
    K = np.triu(np.tril(rng.standard_normal((n, n)), 3), -3)
    K = (K + K.T if symmetric else K) + 10 * np.eye(n)
    columns = [np.arange(c, min(c + 4, n)) for c in range(n)]
    indptr = np.concatenate([[0], np.cumsum([len(own) for own in columns])])
    rows, column = np.concatenate(columns), np.repeat(np.arange(n), np.diff(indptr))
    return K, Pattern(indptr, rows), K[rows, column], K[column, rows]


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_border_solves_what_the_tied_matrix_does(symmetric):
    """Against P^T K P, P of zeros and ones, solved densely; groups lie inside the band, beside each other and apart."""
    n, groups = 14, [np.array([2, 3, 9]), np.array([4, 13])]
    K, pattern, lower, upper = _banded(n, 1, symmetric)
    alone = np.setdiff1d(np.arange(n), np.concatenate(groups))
    P = np.zeros((n, len(alone) + 2))
    P[alone, np.arange(len(alone))] = 1
    for k, group in enumerate(groups):
        P[group, len(alone) + k] = 1
    b = np.random.default_rng(2).standard_normal(n)
    expected = P @ np.linalg.solve(P.T @ K @ P, P.T @ b)
    found = BorderedSolver(pattern, groups).factorise(lower, None if symmetric else upper)(b)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_group_that_nothing_holds_is_singular():
    """Two springs to a tied pair that is free: the pair's own equation is what is left by round-off."""
    K = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    pattern = Pattern(np.array([0, 2, 3, 4]), np.array([0, 1, 1, 2]))
    with pytest.raises(SingularMatrix, match="nothing holds"):
        BorderedSolver(pattern, [np.array([0, 1])]).factorise(np.array([1.0, -1.0, 1.0, 1.0]))
    assert K[:2, :2].sum() == 0


def test_a_spin_is_a_rotation_and_a_history_has_the_slope_before_its_corners():
    np.testing.assert_allclose(_rotation(np.array([0.0, 0.0, 2.0]), np.pi / 4) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    turn = _rotation(np.array([0.3, -0.5, 0.2]), 1.7)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
    history = ((0.0, 0.0), (1.0, 2.0), (3.0, 1.0))
    assert [_rate(history, t) for t in (0.0, 1.0, 2.0, 3.0, 4.0)] == [2.0, 2.0, -0.5, -0.5, 0.0]
    assert _rate(((0.0, 1.0),), 0.5) == 0.0


@pytest.mark.parametrize("scheme", ["trapezoidal", "generalized-alpha"])
def test_what_spins_has_the_velocity_and_acceleration_of_its_spin(scheme):
    """Differences of its places have not: the trapezoidal rule's own acceleration would swing more and more."""
    scene = rim_scenes.spinning_ring("ancf")
    model = build(scene, scene.ladder("ancf")[0])
    acting, solver, rim = model.system, bordered(model.system), model.system.rim
    state = initial_state(acting, solver, model.mesh.vectors.ravel().copy(), initial_velocity(scene, model))
    for _ in range(10):
        state = step(acting, solver, SCHEMES[scheme], state, 0.02).state
    stated = rim.motion(state.t)
    for found, expected in ((state.q, stated.q), (state.v, stated.v), (state.a, stated.a)):
        own = (found - expected)[rim.held]
        assert np.abs(own).max() < 1e-6 * np.abs(expected).max()
