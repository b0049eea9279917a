"""Steps chosen by an error estimate: the estimate, what it buys, stops, and the named failures."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import plate_scene
import pytest
from scipy.sparse import csr_matrix, identity, kron, triu
from scipy.sparse.linalg import eigsh

from compare.scene import ReferenceLevel, parse
from reference_fe import dynamics, pace
from reference_fe.dynamics import TRAPEZOIDAL, generalized_alpha
from reference_fe.geometry import Plate
from reference_fe.loads import Load, face_share
from reference_fe.mesh import make
from reference_fe.newton import NewtonFailure
from reference_fe.pace import Pace, Trial, march
from reference_fe.run import estimate, solve
from reference_fe.unpack import discretise, mid_surface, plate_of, spacing_of

SCHEMES = pytest.mark.parametrize(
    "scheme", [TRAPEZOIDAL, generalized_alpha(0.8)], ids=["trapezoidal", "generalized-alpha"]
)
PLATE = Plate(1.0, 0.25, 0.1)


def mode(build):
    """A clamped soft plate, the frequency (rad/s) of its lowest mode and that mode's shape, 1e-5 m high."""
    solid = build.solid(PLATE, 0.4)
    system = build.system(solid, solid.box.doflocs[0] < 1e-9, young=2e6, density=2000.0)
    where = system.pattern
    size = 3 * where.free.size
    upper = csr_matrix((system.tangent(np.zeros((size // 3, 3))), where.indices, where.indptr), shape=(size, size))
    squares, modes = eigsh(upper + triu(upper, 1).T, 1, kron(system.mass, identity(3)), sigma=0)
    shape = modes[:, 0].reshape(-1, 3)
    return system, math.sqrt(squares[0]), 1e-5 * shape / np.linalg.norm(shape, axis=1).max()


def loaded(build, history, force):
    """The soft clamped plate with an end force (N) times a history."""
    solid = build.solid(PLATE, 0.4)
    load = Load(np.outer(face_share(solid, 0, 1.0), [0.0, 0.0, force]), np.array(history))
    return build.system(solid, solid.box.doflocs[0] < 1e-9, (load,), young=2e6, density=2000.0)


def adapted(system, scheme, begun, until, allowed, largest, stops=()):
    """Final state, the accepted step lengths (s) and the pace of a march within an allowed error (m)."""
    attempt, made = dynamics.within(system, scheme, allowed, system.memory()), []

    def noted(state, time):
        trial = attempt(state, time)
        if trial.accepted:
            made.append(time - state.time)
        return trial

    chosen = Pace(largest, stops, wanted=dynamics.first_step(scheme, begun, allowed))
    state, count = march(chosen, begun, until, noted)
    assert count == len(made)
    return state, made, chosen


def at_rest(system):
    return dynamics.begin(system, np.zeros((system.pattern.free.size, 3)))


def test_the_estimate_is_the_error_of_one_step(build):
    """One step of a mode's exact swing: the third-order term that Newmark's update lacks is the whole error."""
    system, omega, shape = mode(build)
    begun = dynamics.begin(system, omega * shape)
    for phase, tolerance in ((0.2, 0.02), (0.1, 0.005)):
        after = dynamics.step(system, TRAPEZOIDAL, begun, phase / omega, system.memory())
        error = np.linalg.norm(after.u - math.sin(phase) * shape, axis=1).max()
        assert math.isclose(dynamics.local_error(TRAPEZOIDAL, begun, after), error, rel_tol=tolerance)


def test_the_estimate_of_generalized_alpha_is_the_error_of_one_step(build):
    """Its accelerations are those of t + (alpha_m - alpha_f) h; begun with those, one step errs as estimated."""
    system, omega, shape = mode(build)
    scheme, phase = generalized_alpha(0.8), 0.1
    shift = (scheme.alpha_m - scheme.alpha_f) * phase
    rest = dynamics.begin(system, omega * shape)
    begun = replace(rest, a=-(omega**2) * math.sin(shift) * shape)
    after = dynamics.step(system, scheme, begun, phase / omega, system.memory())
    error = np.linalg.norm(after.u - math.sin(phase) * shape, axis=1).max()
    assert math.isclose(dynamics.local_error(scheme, begun, after), error, rel_tol=0.05)


@SCHEMES
def test_the_error_falls_as_the_two_thirds_power_of_the_allowed_one(build, scheme):
    """Local errors grow as h³ and global ones as h²: a tolerance 8 times smaller halves steps and quarters errors."""
    system, omega, shape = mode(build)
    begun, end, errors, counts = dynamics.begin(system, omega * shape), 3.0 / omega, [], []
    for allowed in (1e-8, 1.25e-9, 1.5625e-10):
        state, made, _ = adapted(system, scheme, begun, end, allowed, end)
        errors.append(np.linalg.norm(state.u - math.sin(omega * end) * shape, axis=1).max())
        counts.append(len(made))
    assert all(1.4 < b / a < 2.6 for a, b in pairwise(counts))
    assert all(2.5 < a / b < 6.0 for a, b in pairwise(errors))


def test_a_sudden_load_takes_small_steps_first_and_keeps_the_energy(build):
    """The vibration of the loaded nodes is resolved until the scheme has damped it."""
    system = loaded(build, [[0.0, 1.0]], 20.0)
    state, made, _ = adapted(system, generalized_alpha(0.5), at_rest(system), 1.0, 1e-4, 0.1)
    assert made[0] < 1.01 * min(made) and made[-1] > 3.9 * made[0]
    assert math.isclose(math.fsum(made), 1.0, rel_tol=1e-12) and state.time == 1.0
    assert -0.01 < (state.kinetic + state.strain) / state.external - 1 <= 1e-6


@pytest.mark.slow
def test_a_short_event_costs_a_third_of_the_uniform_steps_of_the_same_error(build):
    """A slow load, then a blow of 20 ms near the end. The truth is a run of 3200 steps, wrong by a tenth of these."""
    history = [[0.0, 0.0], [1.6, 0.1], [1.61, 1.0], [1.62, 0.1]]
    system, scheme = loaded(build, history, 200.0), generalized_alpha()
    begun, corners = at_rest(system), tuple(time for time, _ in history)
    state, made, chosen = adapted(system, scheme, begun, 2.0, 1e-3, 0.1, corners)
    truth, uniform = (dynamics.advance(system, scheme, begun, 2.0, 2.0 / n, system.memory())[0] for n in (3200, 200))
    assert 3 * len(made) < 200 and np.abs(state.u - truth.u).max() < np.abs(uniform.u - truth.u).max()
    assert chosen.longest > 8 * chosen.shortest
    assert all(np.abs(np.cumsum(made) - corner).min() < 1e-12 for corner in corners[1:])


class Point:
    """A state that knows only its time."""

    def __init__(self, time):
        self.time = time


def test_stops_are_met_exactly_by_lengths_that_are_halves_of_each_other():
    met = []

    def attempt(state, time):
        length = time - state.time
        if 0.4 < state.time < 0.5 and length > 0.02:
            return Trial(state, False, 2)
        met.append((state.time, time))
        return Trial(Point(time), True, -1)

    chosen, state = Pace(0.1, stops=(0.45,)), Point(0.0)
    for end in (0.3, 0.6, 0.9):
        state, _ = march(chosen, state, end, attempt)
        assert state.time == end
    assert [b for _, b in met[:-1]] == [a for a, _ in met[1:]] and 0.45 in {b for _, b in met}
    for a, b in met:
        largest = 0.075 if 0.29 < a < 0.59 else 0.1  # two equal stretches on either side of the stop
        halvings = math.log2(largest / (b - a))
        assert math.isclose(halvings, round(halvings), abs_tol=1e-6) and halvings > -1e-6
    assert met[-1][1] - met[-1][0] == pytest.approx(0.1)
    assert chosen.rejected and chosen.shortest < 0.03


def test_a_step_that_never_suffices_is_a_named_failure():
    tried = []

    def attempt(state, time):
        tried.append(time - state.time)
        return Trial(state, False, 3)

    with pytest.raises(NewtonFailure) as failure:
        march(Pace(0.1), Point(0.0), 1.0, attempt)
    assert failure.value.status == "step_too_small"
    assert tried[-1] == pytest.approx(0.1 / 2**pace.HALVINGS) and len(tried) == 7


def test_a_step_without_equilibrium_keeps_its_own_name():
    failure = NewtonFailure("newton_diverged", "no")
    with pytest.raises(NewtonFailure) as raised:
        march(Pace(0.1), Point(0.0), 1.0, lambda state, time: Trial(state, False, 1, failure))
    assert raised.value is failure


BLOW = {
    **plate_scene.PLAIN,
    "loads": [{"kind": "edge", "edge": "x1", "force": [0.0, 0.0, -20.0], "history": [[0.0, 0.0], [0.25, 1.0]]}],
    "analysis": {"kind": "dynamic", "until": 0.4, "every": 0.1},
    "reference": {"levels": [{"size": 0.4, "time_step": 0.05}]},
}
STATIC = {"analysis": {"kind": "static", "until": 1.0, "every": 1.0}}
PLAIN, ADAPTIVE = (ReferenceLevel(size=0.4, time_step=0.05, error_per_step=error) for error in (None, 1e-5))


def test_without_the_key_the_steps_are_the_equal_ones_to_the_last_bit(monkeypatch):
    """solve against a bare loop of equal steps; nothing is estimated."""
    scene = parse(BLOW, "test")
    monkeypatch.setattr(dynamics, "local_error", None)
    result = solve(scene, PLAIN)
    frame, surface = mid_surface(scene)
    plate = plate_of(scene, frame, surface)
    model = discretise(scene, frame, make(plate, spacing_of(plate, PLAIN.size), surface))
    state, found = dynamics.begin(model.system, model.velocity), []
    for start in 0.4 * np.linspace(0, 1, 5)[:-1]:
        end = 0.4 * np.linspace(0, 1, 5)[round(start / 0.1) + 1]
        for k in range(2):
            until = start + (end - start) * (k + 1) / 2
            state = dynamics.step(model.system, TRAPEZOIDAL, state, until, model.memory)
        found.append(model.probes[0] @ model.system.expand(state.u))
    assert np.array_equal(result.displacement[1:, 0], found)
    assert result.steps == 8 and "rejected_steps" not in result.facts


def test_with_the_key_output_times_are_exact_and_steps_are_told():
    fine = ReferenceLevel(size=0.4, time_step=0.001)
    scene = parse(BLOW, "test")
    result, plain, truth = (solve(scene, level) for level in (ADAPTIVE, PLAIN, fine))
    assert result.status == "ok" and np.array_equal(result.times, plain.times)
    assert result.facts["smallest_step"] < result.facts["largest_step"] <= 0.05 and result.facts["rejected_steps"] > 0
    errors = [np.abs(one.displacement - truth.displacement).max() for one in (result, plain)]
    assert errors[0] < 1e-3 and errors[0] < errors[1] / 5


def test_an_error_that_no_step_can_meet_is_a_named_status():
    result = solve(parse(BLOW, "test"), PLAIN.model_copy(update={"error_per_step": 1e-30}))
    assert result.status == "step_too_small" and result.times.size == 1


def test_equal_steps_halve_only_what_fails():
    """No step over 0.3 is longer than 0.07: the step to 0.4 is made in two, all others in one."""
    met, failure = [], NewtonFailure("newton_diverged", "no")

    def step(state, time):
        if state.time < 0.35 < time and time - state.time > 0.07:
            raise failure
        met.append(time)
        return Point(time)

    state, made = pace.equal_steps(Point(0.0), 1.0, 0.1, step)
    assert state.time == 1.0 and made == len(met) == 11
    np.testing.assert_allclose(met, [0.1, 0.2, 0.3, 0.35, *np.arange(4, 11) / 10], rtol=1e-12)


def test_a_load_that_one_step_cannot_carry_is_carried_in_parts():
    """The corner force of 500 N in one load step against ten: the same equilibrium."""
    loads = [{"kind": "point", "at": [1.0, 1.0], "force": [0.0, 0.0, -500.0], "history": [[0.0, 0.0], [1.0, 1.0]]}]
    scene = parse({**BLOW, **STATIC, "loads": loads}, "test")
    one, ten = (solve(scene, ReferenceLevel(size=0.4, time_step=step)) for step in (1.0, 0.1))
    assert one.status == "ok" and one.steps > 1
    assert np.allclose(one.displacement, ten.displacement, rtol=0, atol=1e-8)


def test_the_estimate_says_how_steps_are_chosen():
    scene = parse(BLOW, "test")
    said = [" ".join(estimate(scene, level)["modelled"]) for level in (PLAIN, ADAPTIVE)]
    assert "steps of 0.05 s at most, each adding no more than 1e-05 m" in said[1] and "at most" not in said[0]
