"""Statics: closed forms, and failures by name."""

import numpy as np
import pytest

from ancf.functional import mean_over_edge, value_at
from ancf.linear_solver import LinearSolver, SingularMatrix
from ancf.loads import spread
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.newton import (
    DIVERGED,
    INVERTED,
    NOT_FINITE,
    OK,
    SINGULAR,
    Balance,
    Factor,
    Problem,
    correct,
    equilibrium,
)
from ancf.shape import FAMILY
from ancf.supports import clamp
from ancf.system import body, system

E, THICKNESS = 2.0e6, 0.05
RAMP = ((0.0, 0.0), (1.0, 1.0))


def follow(acting, step=0.25, until=1.0):
    solver = LinearSolver(acting.assembly.pattern)
    return equilibrium(acting, solver, acting.body.mesh.vectors.ravel().copy(), 0.0, until, step)


def pulled(make_body, force, bands=()):
    plate = make_body(bands=bands, nu=0.0)
    load = spread(mean_over_edge(plate.mesh, bands, THICKNESS, "x1"), force, RAMP)
    return system(plate, clamp(plate.mesh, "x0", "tangential"), [load], THICKNESS)


def test_tension_of_a_strip_is_exact(make_body):
    """nu = 0: homogeneous stretch s with E A s (s^2 - 1)/2 = F. Here s = 1.2, without any discretisation error."""
    s = 1.2
    force = E * 0.6 * THICKNESS * s * (s**2 - 1) / 2
    acting = pulled(make_body, (force, 0, 0))
    path = follow(acting)
    assert path.status == OK
    np.testing.assert_allclose(path.q.reshape(-1, 3), acting.body.mesh.vectors * [s, 1, 1], atol=1e-9)


def test_small_load_is_the_linear_solution(make_body):
    """At 1e-4 N the displacement is that of K u = F to about its own size, 1e-6."""
    acting = pulled(make_body, (0, 0, -1e-4))
    rest = acting.body.mesh.vectors.ravel()
    solve = LinearSolver(acting.assembly.pattern).factorise(acting.tangent(rest))
    u = np.zeros(rest.size)
    u[acting.assembly.free] = solve(acting.force_external(1.0))
    path = follow(acting, step=1.0)
    assert path.status == OK
    np.testing.assert_allclose(path.q - rest, u, atol=1e-5 * np.abs(u).max())


def test_a_load_below_round_off_of_the_internal_force_has_its_displacement(make_body):
    """Round-off of the residual bounds no displacement: a tenth of it still moves the tip, to 1e-16 m."""
    floor = pulled(make_body, (0, 0, 0)).force_floor(make_body().mesh.vectors.ravel())
    ends = []
    for force in (1e-4, 0.1 * floor):
        acting = pulled(make_body, (0, 0, -force))
        path = follow(acting, step=1.0)
        assert path.status == OK
        tip = value_at(acting.body.mesh, 1.2, 0.6, 0.0) @ (path.q - acting.body.mesh.vectors.ravel()).reshape(-1, 3)
        ends.append(tip[2] / force)
    assert ends[1] == pytest.approx(ends[0], abs=2e-16 / (0.1 * floor) + 1e-3 * abs(ends[0]))


def test_result_does_not_depend_on_the_load_steps(make_body):
    """Both paths end within Newton's tolerance of the same equilibrium."""
    acting = pulled(make_body, (0, 0, -20.0))
    ends = [follow(acting, step).q for step in (1.0, 0.1)]
    np.testing.assert_allclose(*ends, atol=1e-8)


def test_work_equals_strain_energy_on_a_fine_path(make_body):
    """The trapezoidal sum of the dead load's work errs like the square of the load step."""
    acting = pulled(make_body, (0, 0, -20.0))
    path = follow(acting, 0.01)
    strain = acting.energies(path.q, 0 * path.q)[1]
    assert path.work == pytest.approx(strain, rel=1e-4)


def test_column_beyond_its_buckling_load_is_still_solved(make_body):
    """Past Euler's load the straight column's tangent is indefinite: LU replaces Cholesky and Newton holds.

    Straight compression s = 0.9: E A s (1 - s^2)/2 is ten times the load at which the column buckles.
    """
    s = 0.9
    force = -E * 0.6 * THICKNESS * s * (1 - s**2) / 2
    acting = pulled(make_body, (force, 0, 0))
    path = follow(acting, 0.1)
    assert path.status == OK
    np.testing.assert_allclose(path.q.reshape(-1, 3), acting.body.mesh.vectors * [s, 1, 1], atol=1e-8)
    K = acting.assembly.pattern.full(acting.tangent(path.q)).toarray()
    assert np.linalg.eigvalsh(K).min() < 0


def test_unsupported_plate_has_a_singular_tangent(make_body):
    plate = make_body()
    load = spread(value_at(plate.mesh, 1.2, 0.6, 0.0), (0, 0, 1.0), RAMP)
    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), [load], THICKNESS)
    assert follow(acting).status == SINGULAR


def test_load_that_is_not_finite_is_named(make_body):
    assert follow(pulled(make_body, (np.nan, 0, 0))).status == NOT_FINITE


def test_crushing_load_is_a_named_failure(make_body):
    """St. Venant-Kirchhoff in compression carries at most E A / (3 sqrt 3); twice that only inside out.

    Newton finds that mirrored equilibrium (s = -1.2), so the orientation has to be looked at.
    """
    path = follow(pulled(make_body, (-2 * E * 0.6 * THICKNESS / (3 * np.sqrt(3)), 0, 0)))
    assert path.status in (INVERTED, DIVERGED, SINGULAR)
    assert path.t < 1.0


def test_singular_and_broken_matrices_are_refused(make_body):
    acting = pulled(make_body, (1.0, 0, 0))
    solver = LinearSolver(acting.assembly.pattern)
    K = acting.tangent(acting.body.mesh.vectors.ravel())
    with pytest.raises(SingularMatrix):
        solver.factorise(np.zeros_like(K))
    with pytest.raises(SingularMatrix):
        solver.factorise(K * np.nan)


@pytest.mark.parametrize("widest", [0, 1000], ids=["sparse", "banded"])
def test_a_plate_that_nothing_holds_is_refused_by_every_way(make_body, monkeypatch, widest):
    monkeypatch.setattr("ancf.linear_solver.WIDEST_BAND", widest)
    plate = make_body()
    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), THICKNESS)
    with pytest.raises(SingularMatrix):
        LinearSolver(acting.assembly.pattern).factorise(acting.tangent(plate.mesh.vectors.ravel()))


@pytest.mark.parametrize("way", ["definite", "indefinite", "sparse"])
@pytest.mark.parametrize("size", [1e-5, 1e3])
def test_the_size_of_a_plate_does_not_matter(element, monkeypatch, way, size):
    """Lengths by s and the same moduli: an r_xy has s^4 times the stiffness beside that of an r, and solutions of the
    same forces per s^2 are s times as large. Indefinite: beyond the lowest eigenvalue, as in the test below."""
    monkeypatch.setattr("ancf.linear_solver.WIDEST_BAND", 0 if way == "sparse" else 1000)
    tips = []
    for s in (1.0, size):
        lines = s * np.linspace(0, 1, 4), s * np.linspace(0, 0.6, 3)
        mesh = grid(*lines, None, FAMILY[element])
        plate = body(mesh, (), s * THICKNESS, from_engineering(E, 0.3), 2000.0 / s**2, (7, 7, 3))
        load = spread(mean_over_edge(mesh, (), s * THICKNESS, "x1"), (0, 0, -5.0 * s**2), RAMP)
        acting = system(plate, clamp(mesh, "x0", "tangential"), [load], s * THICKNESS)
        data = acting.tangent(mesh.vectors.ravel()) - (1e4 * acting.mass_values if way == "indefinite" else 0)
        u = np.zeros(mesh.vectors.size)
        u[acting.assembly.free] = LinearSolver(acting.assembly.pattern).factorise(data)(acting.force_external(1.0))
        tips.append(value_at(mesh, s, 0.6 * s, 0.0) @ u.reshape(-1, 3) / s)
    np.testing.assert_allclose(*tips, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("way", ["_cholesky", "_banded_lu", "_sparse"])
@pytest.mark.parametrize("definite", [True, False])
def test_every_way_solves_what_numpy_solves(make_body, way, definite):
    """Indefinite: K - 2 M times the lowest eigenvalue and more; Cholesky must refuse it."""
    acting = pulled(make_body, (1.0, 0, 0))
    solver = LinearSolver(acting.assembly.pattern)
    data = acting.tangent(acting.body.mesh.vectors.ravel()) - (0 if definite else 1e4) * acting.mass_values
    solve = getattr(solver, way)(data)
    if way == "_cholesky" and not definite:
        assert solve is None
        return
    b = np.random.default_rng(0).standard_normal(acting.unknowns)
    K = acting.assembly.pattern.full(data).toarray()
    np.testing.assert_allclose(K @ solve(b), b, atol=1e-7)


@pytest.mark.parametrize("nx, ny", [(9, 3), (3, 9)])
def test_band_is_as_narrow_as_the_shorter_side(make_body, element, nx, ny):
    """Nodes are numbered along the shorter side, each followed by its edges: an element reaches over a line
    of vectors, the node and edges where it begins and the node where it ends."""
    plate = make_body(lines=(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1)))
    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), THICKNESS)
    nodes = min(nx, ny) + 1
    line, first, last = (7 * nodes - 1, 7, 5) if element == "enriched" else (4 * nodes, 4, 4)
    assert LinearSolver(acting.assembly.pattern).bandwidth == 3 * (line + first + last) - 1


def test_a_step_that_leaves_nothing_at_all_is_the_last(make_body):
    """rest - q with the tangent 1, from q = 0: it is zero to the last digit, also where factors are reused."""
    acting = pulled(make_body, (0, 0, 0))
    free, pattern, rest = acting.assembly.free, acting.assembly.pattern, acting.body.mesh.vectors.ravel()
    one = np.zeros(len(pattern.indices))
    one[pattern.indptr[:-1]] = 1.0  # the diagonal begins a column
    problem = Problem(lambda q, more: Balance((rest - q)[free], 1e-9), lambda q, more: one)
    start = rest.copy()
    start[free] = 0.0
    found = correct(acting, LinearSolver(pattern), start, problem, reuse=True)
    assert (found.status, found.iterations) == (OK, 1)
    assert np.array_equal(found.q, rest)


def test_a_factor_learns_what_a_step_did():
    """BFGS truths: the last step's change of the residual leads back to that step, and the corrected inverse stays
    symmetric and positive. The round-off is that of an 8 x 8 inverse of condition 100."""
    rng = np.random.default_rng(0)
    root = rng.standard_normal((8, 8))
    stiffness = root @ root.T + np.eye(8)
    factor = Factor(lambda residual: residual / 20.0)
    for step in rng.standard_normal((4, 8)):
        factor.learn(step, stiffness @ step)
        np.testing.assert_allclose(factor(stiffness @ step), step, rtol=1e-10, atol=1e-12)
    inverse = np.array([factor(unit) for unit in np.eye(8)])
    np.testing.assert_allclose(inverse, inverse.T, atol=1e-12 * np.abs(inverse).max())
    assert np.linalg.eigvalsh(inverse).min() > 0


def test_a_factor_learns_nothing_from_a_step_without_curvature():
    step = np.random.default_rng(0).standard_normal(8)
    factor = Factor(lambda residual: residual)
    factor.learn(step, -step)
    np.testing.assert_array_equal(factor(step), step)
