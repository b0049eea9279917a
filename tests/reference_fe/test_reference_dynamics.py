"""Orders, energy and momentum of the time integrators."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import csr_matrix, identity, kron, triu
from scipy.sparse.linalg import eigsh

from reference_fe import dynamics
from reference_fe.dynamics import TRAPEZOIDAL, generalized_alpha
from reference_fe.geometry import Plate
from reference_fe.loads import Load, face_share
from reference_fe.newton import NewtonFailure

SCHEMES = pytest.mark.parametrize(
    "scheme", [TRAPEZOIDAL, generalized_alpha(0.8)], ids=["trapezoidal", "generalized-alpha"]
)
PLATE = Plate(1.0, 0.25, 0.1)


def swinging(build, force: float = 40.0):
    """A soft clamped plate under a growing end force."""
    solid = build.solid(PLATE, 0.4)
    load = Load(np.outer(face_share(solid, 0, 1.0), [0.0, 0.0, force]), np.array([[0.0, 0.0], [1.0, 1.0]]))
    return build.system(solid, solid.box.doflocs[0] < 1e-9, (load,), young=2e6, density=2000.0)


@SCHEMES
def test_second_order_against_the_exact_swing_of_a_mode(build, scheme):
    """Released with the shape of its lowest mode as velocity, a plate swings as sin(omega t) / omega."""
    solid = build.solid(PLATE, 0.4)
    system = build.system(solid, solid.box.doflocs[0] < 1e-9, young=2e6, density=2000.0)
    where = system.pattern
    size = 3 * where.free.size
    upper = csr_matrix((system.tangent(np.zeros((size // 3, 3))), where.indices, where.indptr), shape=(size, size))
    squares, modes = eigsh(upper + triu(upper, 1).T, 1, kron(system.mass, identity(3)), sigma=0)
    omega, mode = math.sqrt(squares[0]), modes[:, 0].reshape(-1, 3)
    shape = 1e-5 * mode / np.abs(mode).max()  # small enough for the linear theory: strains of 1e-6
    end, errors = 0.3 * 2 * math.pi / omega, []
    for steps in (8, 16, 32):
        state, made = dynamics.advance(
            system, scheme, dynamics.begin(system, omega * shape), end, end / steps, system.memory()
        )
        assert made == steps
        errors.append(np.abs(state.u - math.sin(omega * end) * shape).max())
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert np.allclose(orders, scheme.order, atol=0.15)


def flying(build):
    """A free plate, thrown and spinning, without loads."""
    solid = build.solid(PLATE, 0.4)
    system = build.system(solid, young=2e6, density=2000.0)
    points = solid.mesh.doflocs.T
    velocity = np.array([0.0, 1.0, 2.0]) + np.cross([1.0, 2.0, 0.5], points - [0.5, 0.125, 0.0])
    return system, velocity


def test_free_flight_keeps_momentum_and_nearly_energy(build):
    """The trapezoidal rule conserves linear momentum; its energy is bounded, not conserved."""
    system, velocity = flying(build)
    mass = system.mass.sum()
    begun = dynamics.begin(system, velocity)
    drifts = []
    for step in (0.02, 0.01):
        state, _ = dynamics.advance(system, TRAPEZOIDAL, begun, 0.5, step, system.memory())
        assert np.allclose((system.mass @ state.v).sum(axis=0) / mass, [0.0, 1.0, 2.0], atol=1e-9)
        assert np.allclose((system.mass @ state.u).sum(axis=0) / mass, [0.0, 0.5, 1.0], atol=1e-9)
        drifts.append(abs(state.kinetic + state.strain - begun.kinetic) / begun.kinetic)
    assert drifts[0] < 2e-4 and drifts[1] < drifts[0] / 2


def test_work_of_the_load_becomes_energy(build):
    system = swinging(build)
    state = dynamics.begin(system, np.zeros((system.pattern.free.size, 3)))
    state, _ = dynamics.advance(system, TRAPEZOIDAL, state, 0.5, 0.01, system.memory())
    assert math.isclose(state.kinetic + state.strain, state.external, rel_tol=2e-3)
    assert state.external > 0


def test_initial_acceleration_satisfies_the_balance(build):
    solid = build.solid(PLATE, 0.4)
    share = face_share(solid, 0, 1.0)
    load = Load(np.outer(share, [0.0, 0.0, 5.0]), np.array([[0.0, 1.0]]))
    system = build.system(solid, loads=(load,))
    state = dynamics.begin(system, np.zeros((share.size, 3)))
    assert np.allclose(system.mass @ state.a, load.force, atol=1e-12)


def test_reused_factors_and_fresh_ones_give_one_answer(build, monkeypatch):
    """Quasi-Newton on old factors against Newton with a new tangent at every iteration: 1e-8 of the answer."""
    system = swinging(build)
    rest = np.zeros((system.pattern.free.size, 3))
    answers, memories = [], []
    for patience, tolerance in ((10, 1e-10), (-1, 1e-12)):
        monkeypatch.setattr("reference_fe.newton.PATIENCE", patience)
        monkeypatch.setattr("reference_fe.newton.TOLERANCE", tolerance)
        memories.append(system.memory())
        state, _ = dynamics.advance(system, TRAPEZOIDAL, dynamics.begin(system, rest), 0.5, 0.02, memories[-1])
        answers.append(state.u)
    assert np.abs(answers[0] - answers[1]).max() < 1e-8 * np.abs(answers[1]).max()
    assert memories[0].factorisations < memories[1].factorisations / 3


def test_a_failed_step_is_halved(build, monkeypatch):
    system = swinging(build)
    whole, tried = dynamics.step, []

    def fails_if_long(system, scheme, state, until, memory):
        tried.append(until - state.time)
        if until - state.time > 0.06:
            raise NewtonFailure("newton_diverged", "too long")
        return whole(system, scheme, state, until, memory)

    monkeypatch.setattr(dynamics, "step", fails_if_long)
    begun = dynamics.begin(system, np.zeros((system.pattern.free.size, 3)))
    state, made = dynamics.advance(system, TRAPEZOIDAL, begun, 0.2, 0.2, system.memory())
    assert made == 4 and math.isclose(state.time, 0.2) and len(tried) == 7


def test_a_step_without_equilibrium_is_a_named_failure(build):
    """A crushing end force of 1e9 N: no step size within the halvings finds an equilibrium."""
    solid = build.solid(PLATE, 0.4)
    load = Load(np.outer(face_share(solid, 0, 1.0), [-1e9, 0.0, 0.0]), np.array([[0.0, 1.0]]))
    system = build.system(solid, solid.box.doflocs[0] < 1e-9, (load,))
    begun = dynamics.begin(system, np.zeros((system.pattern.free.size, 3)))
    with pytest.raises(NewtonFailure) as failure:
        dynamics.advance(system, TRAPEZOIDAL, begun, 1.0, 0.5, system.memory())
    assert failure.value.status in ("newton_diverged", "not_finite", "inverted")


def test_not_finite_is_a_named_failure(build):
    system = swinging(build)
    broken = replace(system, loads=lambda time: np.full((system.pattern.number.size, 3), np.nan))
    begun = dynamics.begin(system, np.zeros((system.pattern.free.size, 3)))
    with pytest.raises(NewtonFailure) as failure:
        dynamics.step(broken, TRAPEZOIDAL, begun, 0.1, system.memory())
    assert failure.value.status == "not_finite"
