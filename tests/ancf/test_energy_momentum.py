"""The energy-momentum scheme keeps what it promises at any step, and Newton's method finds steps that turn far."""

import numpy as np
import pytest

from ancf import newton
from ancf.functional import value_at
from ancf.integrate import SCHEMES, advance, initial_state
from ancf.linear_solver import LinearSolver
from ancf.loads import gravity, spread
from ancf.newton import OK
from ancf.supports import clamp
from ancf.system import system

LINES = (np.linspace(0, 1, 3), np.linspace(0, 1, 2))
ENERGY_MOMENTUM = SCHEMES["energy-momentum"]
ROUND_OFF = 1e-12  # relative: 20 steps, each ends Newton's method at 1e-14 to 1e-13 of the energy


def test_mean_stress_is_that_of_the_points(make_body, deformed):
    """Force and tangent with terms beside Q against the point loop, enhanced strain included; and the mean of two."""
    plate, twin = make_body("curved, grooved"), make_body("curved, grooved", pointwise=True)
    sums = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), 0.05).assembly
    q0, q1, x = (sums.gather(deformed(plate, seed).ravel()) for seed in (0, 1, 2))
    middle, more = (q0 + q1) / 2, ((1.0, (q1 - q0) / 2), (-0.5, x))
    force = plate.elements.force(middle, more)
    np.testing.assert_allclose(force, twin.elements.force(middle, more), atol=1e-12 * np.abs(force).max())
    one, other = (sums.matrix(body.elements.tangent(middle, more)) for body in (plate, twin))
    np.testing.assert_allclose(one, other, atol=1e-12 * np.abs(one).max())


@pytest.mark.parametrize("pointwise", [False, True])
def test_mean_stress_does_the_work_of_the_strain_energy(make_body, deformed, pointwise):
    """U1 - U0 = (P_mean Q_mean) : (Q1 - Q0) between any two shapes, here turned and strained by several per cent."""
    plate = make_body("grooved", pointwise=pointwise)
    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), 0.05)
    q0, q1 = (deformed(plate, seed).ravel() for seed in (0, 1))
    work = acting.force_internal((q0 + q1) / 2, ((1.0, (q1 - q0) / 2),)) @ (q1 - q0)
    U0, U1 = (acting.energies(q, 0 * q)[1] for q in (q0, q1))
    assert work == pytest.approx(U1 - U0, abs=1e-12 * (U0 + U1))


def flight(make_body, bands=()):
    """A free plate that spins at 4 rad/s about a slanted axis, drifts, and twists."""
    plate = make_body(lines=LINES, bands=bands)
    acting = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), 0.05)
    vectors, kinds = plate.mesh.vectors, plate.mesh.kinds[:, None]
    v = np.cross([1.0, 3.0, 2.4], vectors) + (kinds == "r") * [0.3, -0.2, 1.0]
    x, y, _ = vectors.T
    v[:, 2] += (kinds[:, 0] == "r") * x * y + (kinds[:, 0] == "r_x") * y + (kinds[:, 0] == "r_y") * x
    return acting, v.ravel()


def march(acting, scheme, v, dt, steps, q=None):
    solver = LinearSolver(acting.assembly.pattern)
    state = initial_state(acting, solver, acting.body.mesh.vectors.ravel().copy() if q is None else q, v)
    return advance(acting, solver, scheme, state, steps * dt, dt, None)


def invariants(acting, q, v):
    """Energy (J), linear momentum (N s) and angular momentum about the origin (N m s)."""
    v3 = v.reshape(-1, 3)
    spin = np.cross(q.reshape(-1, 3), acting.body.mass @ v3).sum(axis=0)
    return sum(acting.energies(q, v)), acting.body.mass_row @ v3, spin


@pytest.mark.parametrize("dt", [0.01, 0.1])
def test_free_flight_keeps_energy_and_both_momenta(make_body, dt):
    """Also where a step turns the plate by 0.4 rad, at which the trapezoidal rule does not keep energy."""
    acting, v = flight(make_body)
    motion = march(acting, ENERGY_MOMENTUM, v, dt, 20)
    assert motion.status == OK and motion.steps == 20
    before = invariants(acting, acting.body.mesh.vectors.ravel(), v)
    after = invariants(acting, motion.state.q, motion.state.v)
    for old, new in zip(before, after, strict=True):
        np.testing.assert_allclose(new, old, rtol=0, atol=ROUND_OFF * np.abs(old).max())


def test_trapezoidal_rule_does_not_keep_energy_at_that_step(make_body):
    acting, v = flight(make_body)
    start = sum(acting.energies(acting.body.mesh.vectors.ravel(), v))
    motion = march(acting, SCHEMES["trapezoidal"], v, 0.1, 10)
    assert motion.status != OK or abs(sum(acting.energies(motion.state.q, motion.state.v)) - start) > 0.01 * start


def test_work_of_loads_becomes_energy_exactly(make_body):
    """A tip force that grows and falls, and weight: W = T + U of a grooved cantilever after any number of steps."""
    plate = make_body("grooved")
    history = ((0.0, 0.0), (0.13, 1.0), (0.3, 0.2))
    tip = spread(value_at(plate.mesh, 1.2, 0.6, 0.0), (0, 5.0, -30.0), history)
    weight = gravity(plate.mass_row, (0, 0, -1.0), ((0.0, 1.0),))
    acting = system(plate, clamp(plate.mesh, "x0", "all"), [tip, weight], 0.05)
    end = march(acting, ENERGY_MOMENTUM, np.zeros(plate.mesh.vectors.size), 0.05, 10).state
    assert sum(acting.energies(end.q, end.v)) == pytest.approx(end.work, rel=ROUND_OFF)


def test_steps_that_turn_far_are_found_from_afar_alone(make_body, monkeypatch):
    """Without `approach` a step of 0.4 rad has to be cut."""
    acting, v = flight(make_body)
    assert march(acting, ENERGY_MOMENTUM, v, 0.1, 3).steps == 3
    monkeypatch.setattr(newton, "CLOSE", np.inf)  # one step of Newton's method counts as near
    cut = march(acting, ENERGY_MOMENTUM, v, 0.1, 3)
    assert cut.status != OK or cut.steps > 3
