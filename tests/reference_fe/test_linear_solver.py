"""Both direct solvers against a dense solution, on one indefinite matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from reference_fe.linear_solver import Pardiso, SingularTangent, SuperLU, direct_solver


@pytest.fixture(params=[Pardiso, SuperLU])
def solver_class(request):
    if request.param is Pardiso:
        pytest.importorskip("pypardiso")
    return request.param


@pytest.fixture(scope="module")
def upper(build):
    """Upper triangle of a plate's stiffness minus a multiple of its mass, an indefinite matrix."""
    solid = build.solid(build.grooved, 0.3)
    system = build.system(solid)
    size = 3 * system.pattern.free.size
    values = system.tangent(np.zeros((system.pattern.free.size, 3)), 1.0, -1e5)
    return csr_matrix((values, system.pattern.indices, system.pattern.indptr), shape=(size, size))


def full(upper):
    return (upper + triu(upper, 1).T).toarray()


def test_solution_equals_the_dense_one(solver_class, upper):
    dense, right = full(upper), np.random.default_rng(0).standard_normal(upper.shape[0])
    assert (np.linalg.eigvalsh(dense) < 0).sum() > 10
    solver = solver_class(upper.indptr, upper.indices)
    solver.factorise(upper.data)
    exact = np.linalg.solve(dense, right)
    assert np.abs(solver.solve(right) - exact).max() < 1e-9 * np.abs(exact).max()  # condition number about 1e5


def test_new_values_reuse_the_analysis(solver_class, upper):
    right = np.random.default_rng(0).standard_normal(upper.shape[0])
    solver = solver_class(upper.indptr, upper.indices)
    first = [solver.factorise(upper.data), solver.solve(right)][1]
    values = upper.data.copy()
    values[upper.indptr[:-1]] += 1e4
    second = [solver.factorise(values), solver.solve(right)][1]
    values[:] = np.nan  # the caller may reuse its array: the factor must not depend on it
    dense = full(upper) + 1e4 * np.eye(right.size)
    assert np.abs(second - np.linalg.solve(dense, right)).max() < 1e-9 * np.abs(second).max()
    assert np.array_equal(solver.solve(right), second) and not np.allclose(first, second)


def test_a_singular_matrix_is_refused(solver_class, build):
    solid = build.solid(build.grooved, 0.3)
    system = build.system(solid)
    solver = solver_class(system.pattern.indptr, system.pattern.indices)
    with pytest.raises(SingularTangent):
        solver.factorise(system.tangent(np.zeros((system.pattern.free.size, 3))))
        solver.solve(np.random.default_rng(0).standard_normal(3 * system.pattern.free.size))


def test_values_that_are_not_finite_are_refused(solver_class, upper):
    solver = solver_class(upper.indptr, upper.indices)
    with pytest.raises(SingularTangent, match="not finite"):
        solver.factorise(np.full(upper.nnz, np.nan))


def test_without_pypardiso_superlu_takes_over(upper, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pypardiso.pardiso_wrapper", None)
    assert isinstance(direct_solver(upper.indptr, upper.indices), SuperLU)


def test_no_search_for_the_library(monkeypatch):
    """pypardiso walks through all installed files where nobody tells it where MKL is."""
    wrapper = pytest.importorskip("pypardiso.pardiso_wrapper")
    monkeypatch.delenv("PYPARDISO_MKL_RT", raising=False)
    monkeypatch.setattr(wrapper.glob, "glob", lambda *_, **__: pytest.fail("searched"))
    solver = Pardiso(np.array([0, 1]), np.array([0]))
    solver.factorise(np.array([2.0]))
    assert solver.solve(np.array([1.0])) == pytest.approx([0.5])
