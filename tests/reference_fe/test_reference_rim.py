"""The solid on a rigid rim: closed forms, and the tied solver against a dense one."""

from types import SimpleNamespace

import numpy as np
import pytest

from reference_fe.dynamics import MEAN, TRAPEZOIDAL, generalized_alpha
from reference_fe.rim import Rim, TiedSolver, rotation
from reference_fe.run import solve
from tests import rim_scenes


@pytest.mark.parametrize("case", rim_scenes.CASES, ids=lambda case: case.__name__)
def test_a_rim(case):
    case(solve, "reference")


def test_the_tied_solver_solves_the_tied_matrix():
    n, groups = 12, [np.array([1, 2, 8]), np.array([4, 11])]
    rng = np.random.default_rng(3)
    K = rng.standard_normal((n, n))
    K = K + K.T + 20 * np.eye(n)
    rows, columns = np.triu_indices(n)
    where = SimpleNamespace(indptr=np.concatenate([[0], np.cumsum(np.arange(n, 0, -1))]), indices=columns)
    P = np.zeros((n, n - 3))
    alone = np.setdiff1d(np.arange(n), np.concatenate(groups))
    P[alone, np.arange(len(alone))] = 1
    for k, group in enumerate(groups):
        P[group, len(alone) + k] = 1
    b = rng.standard_normal(n)
    solver = TiedSolver(where, groups)
    solver.factorise(K[rows, columns])
    np.testing.assert_allclose(solver.solve(b), P @ np.linalg.solve(P.T @ K @ P, P.T @ b), atol=1e-12)
    solver.close()


def test_euler_parameters_make_a_rotation():
    np.testing.assert_allclose(rotation(np.array([0.0, np.pi / 2, 0.0])) @ [0, 0, 1], [1, 0, 0], atol=1e-15)
    turn = rotation(np.array([0.3, -0.5, 0.2]))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(rotation(np.zeros(3)), np.eye(3))


@pytest.mark.parametrize("scheme", [TRAPEZOIDAL, MEAN, generalized_alpha()], ids=["trapezoidal", "mean", "alpha"])
def test_what_spins_has_the_velocity_and_acceleration_of_its_spin(scheme):
    """Newmark's updates of many steps, with what they lack; the mean scheme's acceleration is that of its step."""
    points, none, h = np.array([[0.3, 0.1, -0.8], [1.0, 0.0, 0.2]]), np.zeros((2, 3), dtype=bool), 0.05
    motion = {"displacement": np.array([1.0, 0.0, -0.5]), "history": np.array([[0.0, 0.0], [9.0, 9.0]])}
    rim = Rim(np.arange(2), points, np.full(2, 0.5), (), ~none, none, 0.0, spin=np.array([0.0, 4.0, 0.0]), **motion)
    u, v, a = rim.stated(0.0)
    for k in range(40):
        before, after = rim.stated(k * h), rim.stated((k + 1) * h)
        drift, swing = rim.lack(before, after, h, scheme.beta, scheme.gamma)
        predicted = u + h * v + h**2 * (0.5 - scheme.beta) * a + drift
        new = (after[0] - predicted) / (scheme.beta * h**2)
        u, v, a = after[0], v + h * ((1 - scheme.gamma) * a + scheme.gamma * new) + swing, new
    np.testing.assert_allclose(v, after[1], atol=1e-9)
    np.testing.assert_allclose(a, (after[1] - before[1]) / h if scheme is MEAN else after[2], atol=1e-7)
