"""Differences of made-up results whose distance is known."""

from dataclasses import replace

import fake_solver
import numpy as np
import pytest

from compare.difference import DifferenceRefused, between, common_times, from_value
from compare.exact import Value
from compare.scene import load

SCENE = load("cantilever").override({"sensitivity": None})
ANCF, REFERENCE = SCENE.ancf.levels[0], SCENE.reference.levels[0]


def result(level=ANCF, times=(0.0, 0.5, 1.0), z=(0.0, -0.1, -0.4), **changes):
    made = fake_solver.solve(SCENE, level)
    displacement = np.zeros((len(times), 1, 3))
    displacement[:, 0, 2] = z
    return replace(made, times=np.array(times), displacement=displacement, **changes)


def test_heights_and_history_of_two_results():
    found = between(result(), result(REFERENCE, z=(0.0, -0.2, -0.5)))
    assert (found.height, found.height_against) == (-0.4, -0.5)
    assert found.absolute == pytest.approx(0.1)
    assert found.percent == pytest.approx(-20.0)
    np.testing.assert_allclose(found.error, [0, 0.1, 0.1], atol=1e-15)
    assert found.largest == pytest.approx(0.1)
    assert found.rms == pytest.approx(np.sqrt(0.02 / 3))
    assert found.rms_percent == pytest.approx(100 * np.sqrt(0.02 / 0.29))
    assert (found.kind, found.probe) == ("cross-code", "P")


def test_a_result_does_not_differ_from_itself():
    found = between(result(), result())
    assert (found.absolute, found.percent, found.largest, found.rms) == (0, 0, 0, 0)


def test_only_common_times_count():
    fine = result(times=np.arange(11) / 10, z=-0.4 * np.arange(11) / 10)
    found = between(fine, result(REFERENCE, times=(0, 0.3 + 1e-13, 1.0), z=(0, -0.12, -0.4)))
    np.testing.assert_allclose(found.times, [0, 0.3, 1.0])
    assert found.largest < 1e-13


def test_common_times_of_steps_with_rounding():
    a, b = np.cumsum(np.full(100, 0.01)), np.linspace(0, 1, 51)
    mine, theirs = common_times(a, b)
    np.testing.assert_allclose(a[mine], b[theirs], atol=1e-12)
    assert len(mine) == 50
    assert len(common_times(a, np.array([]))[0]) == 0


def test_against_a_known_value():
    value = Value("height", -0.5, "m", "published", "a paper", "Table 1, 2x2")
    found = from_value(result(), value)
    assert found.absolute == pytest.approx(0.1)
    assert (found.kind, found.against) == ("published", "a paper, Table 1, 2x2")
    assert found.error is None


def other_scene(key, value):
    return replace(result(), scene=SCENE.override({key: value}).physics())


REFUSED = {
    "other load": (lambda: other_scene("loads.0.force", [0, 0, -40.0]), "loads.0.force"),
    "other depth": (lambda: other_scene("grooves.1.depth", 0.02), "grooves.1.depth"),
    "other stiffness": (lambda: other_scene("material.youngs_modulus", 2.1e6), "material.youngs_modulus"),
    "fewer grooves": (lambda: other_scene("grooves", []), "grooves"),
    "failed": (lambda: result(status="newton_diverged"), "failed: newton_diverged"),
    "other probe": (lambda: replace(result(), probes=("Q",)), "no probe P"),
    "other place": (lambda: replace(result(), probe_position=np.array([[1.0, 0.9, 0.0]])), "starts at"),
    "no common time": (lambda: result(times=(0.0, 0.3, 0.7)), "no common time"),
}


@pytest.mark.parametrize(("other", "reason"), REFUSED.values(), ids=REFUSED)
def test_unlike_answers_are_refused_with_the_reason(other, reason):
    with pytest.raises(DifferenceRefused, match=reason):
        between(result(), other())


def test_name_and_reading_of_the_clamp_are_not_part_of_the_question():
    assert between(result(), other_scene("supports.0.gradients", "tangential")).absolute == 0
    renamed = replace(result(), scene=SCENE.override({}, "renamed").physics())
    assert between(result(), renamed).absolute == 0


def test_a_failed_result_has_no_error_against_a_value():
    with pytest.raises(DifferenceRefused, match="failed"):
        from_value(result(status="not_finite"), Value("height", -0.5, "m", "exact", "a formula"))
