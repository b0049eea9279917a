"""Observed orders, conservation and balance of the time integrators."""

import numpy as np
import pytest
from scipy.linalg import eigh

from ancf.functional import value_at
from ancf.integrate import SCHEMES, advance, generalized_alpha, initial_state
from ancf.linear_solver import LinearSolver
from ancf.loads import spread
from ancf.newton import OK
from ancf.supports import clamp
from ancf.system import system

LINES = (np.linspace(0, 1, 3), np.linspace(0, 1, 2))


def move(acting, scheme, v, until, dt):
    solver = LinearSolver(acting.assembly.pattern)
    state = initial_state(acting, solver, acting.body.mesh.vectors.ravel().copy(), v)
    motion = advance(acting, solver, scheme, state, until, dt, None)
    assert motion.status == OK
    return motion.state


@pytest.mark.parametrize("name", list(SCHEMES))
def test_observed_order_on_a_linear_oscillator(make_body, name):
    """First mode of a clamped plate at an amplitude of 1e-6 m: q = phi sin(w t) A / w, in closed form.

    The strain's nonlinear part is 1e-6 of the linear one, far below the errors measured (1e-2 to 1e-4).
    """
    plate = make_body(lines=LINES)
    acting = system(plate, clamp(plate.mesh, "x0", "tangential"), (), 0.05)
    rest = plate.mesh.vectors.ravel()
    full = acting.assembly.pattern.full
    squares, modes = eigh(full(acting.tangent(rest)).toarray(), full(acting.mass_values).toarray())
    w, mode = np.sqrt(squares[0]), np.zeros(rest.size)
    mode[acting.assembly.free] = modes[:, 0] / np.abs(modes[:, 0]).max()
    until = 0.8 * 2 * np.pi / w
    exact = mode * np.sin(w * until) / w
    errors = []
    for steps in (20, 40, 80):
        q = move(acting, SCHEMES[name], 1e-6 * w * mode, until, until / steps).q
        errors.append(np.abs((q - rest) / (1e-6 * w) - exact).max() / np.abs(mode).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, SCHEMES[name].order, atol=0.12)


def spinning(make_body, bands=()):
    """A free plate that spins at 4 rad/s about a slanted axis and drifts."""
    plate = make_body(lines=LINES, bands=bands)
    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), 0.05)
    vectors, is_position = plate.mesh.vectors, (plate.mesh.kinds == "r")[:, None]
    v = np.cross([1.0, 3.0, 2.4], vectors) + is_position * [0.3, -0.2, 1.0]
    return acting, v


def test_free_flight_keeps_linear_momentum(make_body):
    """The internal forces on the positions of each element sum to zero: only Newton's tolerance is left."""
    acting, v = spinning(make_body)
    end = move(acting, SCHEMES["trapezoidal"], v.ravel(), 0.2, 0.01)
    row, v1 = acting.body.mass_row, end.v.reshape(-1, 3)
    np.testing.assert_allclose(row @ v1, row @ v, atol=1e-8 * np.abs(row @ v).max())


def test_free_flight_keeps_energy_and_spin_to_second_order(make_body):
    """The trapezoidal rule conserves neither exactly; halving the step quarters what is lost."""
    acting, v = spinning(make_body)
    start = sum(acting.energies(acting.body.mesh.vectors.ravel(), v.ravel()))
    spin = np.cross(acting.body.mesh.vectors, acting.body.mass @ v).sum(axis=0)
    lost, turned = [], []
    for dt in (0.01, 0.005, 0.0025):
        end = move(acting, SCHEMES["trapezoidal"], v.ravel(), 0.1, dt)
        lost.append(abs(sum(acting.energies(end.q, end.v)) - start))
        q1, v1 = end.q.reshape(-1, 3), end.v.reshape(-1, 3)
        turned.append(np.abs(np.cross(q1, acting.body.mass @ v1).sum(axis=0) - spin).max())
    assert lost[0] < 1e-2 * start
    assert lost[2] < lost[0] / 8
    assert turned[2] < turned[0] / 8


def test_generalized_alpha_loses_energy_and_gains_none(make_body):
    """Spectral radius 0.8 at high frequency: after 100 steps the fast modes of the spin-up are gone."""
    acting, v = spinning(make_body)
    start = sum(acting.energies(acting.body.mesh.vectors.ravel(), v.ravel()))
    kept = sum(acting.energies(*move(acting, generalized_alpha(0.8), v.ravel(), 0.5, 0.01)[1:3]))
    assert 0.9 * start < kept < start


def test_work_of_the_load_becomes_energy(make_body):
    """W = T + U up to the rule's second-order error: a quarter of it at half the step."""
    plate = make_body("grooved")
    row = value_at(plate.mesh, 1.2, 0.6, 0.0)
    acting = system(plate, clamp(plate.mesh, "x0", "all"), [spread(row, (0, 0, -30.0), ((0.0, 0.0), (0.5, 1.0)))], 0.05)
    misses = []
    for dt in (0.02, 0.01, 0.005):
        end = move(acting, SCHEMES["trapezoidal"], np.zeros(plate.mesh.vectors.size), 0.5, dt)
        misses.append(abs(end.work - sum(acting.energies(end.q, end.v))) / end.work)
    assert misses[1] < 1e-3
    assert misses[2] < misses[0] / 8


@pytest.mark.parametrize("radius", [0.0, 0.5, 1.0])
def test_coefficients_are_those_of_chung_and_hulbert(radius):
    """Second order needs gamma = 1/2 - alpha_m + alpha_f; stability beta >= 1/4 + (alpha_f - alpha_m)/2."""
    alpha_m, alpha_f, beta, gamma, _ = generalized_alpha(radius)
    assert gamma == pytest.approx(0.5 - alpha_m + alpha_f)
    assert beta >= 0.25 + (alpha_f - alpha_m) / 2 - 1e-15
    assert alpha_m <= alpha_f <= 0.5


@pytest.mark.parametrize("dt", [1e-2, 1e-4, 1e-6])
def test_newton_ends_at_round_off_for_any_step(make_body, dt):
    """Inertia (q - drift) / dt^2 loses digits at short steps; the tolerance knows by how much."""
    acting, v = spinning(make_body)
    end = move(acting, SCHEMES["trapezoidal"], v.ravel(), 5 * dt, dt)
    moved = end.q.reshape(-1, 3) - acting.body.mesh.vectors
    np.testing.assert_allclose(moved, 5 * dt * v, atol=50 * (5 * dt) ** 2 + 1e-12)


def test_old_factorisations_do_not_change_the_motion(make_body, monkeypatch):
    """Keeping a factorisation over steps saves time only: both runs end within Newton's tolerance."""
    acting, v = spinning(make_body)
    kept = move(acting, SCHEMES["trapezoidal"], v.ravel(), 0.1, 0.01)
    monkeypatch.setattr("ancf.newton.PATIENCE", 0.0)
    monkeypatch.setattr("ancf.newton.BAND_PER_ITERATION", np.inf)
    fresh = move(acting, SCHEMES["trapezoidal"], v.ravel(), 0.1, 0.01)
    np.testing.assert_allclose(kept.q, fresh.q, atol=1e-9)
