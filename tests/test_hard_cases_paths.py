"""The chapters on motion and on paths: their closed forms, and what they make of good and of failed outcomes."""

import math

import numpy as np
import pytest

from reports.hard_cases import motion, paths
from reports.hard_cases.chapter import Asked, Outcome
from reports.unit import Measured


def outcome(function, **arguments):
    """A unit measured in this process."""
    name = f"{function.__module__.removeprefix('reports.')}.{function.__name__}"
    return Outcome(Asked(name, arguments), Measured(name, arguments, "ok", function(**arguments)))


def cases(part, *outcomes):
    return {case.name: case for case in part.present(outcomes).cases}


def test_limit_load_of_the_arch_is_that_of_galerkins_method():
    """The same arch by Galerkin's method with fifteen cosines that meet the clamped ends: another road to the load."""
    a, t, b, R, E = 0.5, 0.0025, 0.1, 12.5, 2.0e6
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = a * x, a * weight
    n = np.arange(1, 16)[:, None]
    shape = 1 - (-1.0) ** n * np.cos(n * math.pi * x / a)
    slope = (-1.0) ** n * (n * math.pi / a) * np.sin(n * math.pi * x / a)
    curve = (-1.0) ** n * (n * math.pi / a) ** 2 * np.cos(n * math.pi * x / a)
    bending, stretching = E * b * t**3 / 12 * (curve * weight) @ curve.T, (slope * weight) @ slope.T
    pushed, arc = shape @ weight, (slope * weight) @ (-x / R)
    best = 0.0
    for N in np.linspace(8.0, 11.5, 1500) ** 2 * E * b * t**3 / 12:
        K = bending - N * stretching
        by_load, by_thrust = np.linalg.solve(K, np.stack([pushed, N * arc], axis=1)).T
        # w = q by_load - by_thrust in 2 a N / E A = arc . w - w . stretching . w / 2, quadratic in q
        c2 = -0.5 * by_load @ stretching @ by_load
        c1 = arc @ by_load + by_load @ stretching @ by_thrust
        c0 = -arc @ by_thrust - 0.5 * by_thrust @ stretching @ by_thrust - 2 * a * N / (E * b * t)
        root = c1**2 - 4 * c2 * c0
        if root >= 0:
            best = max(best, *((-c1 + sign * math.sqrt(root)) / (2 * c2) for sign in (1, -1)))
    assert paths.arch_limit() == pytest.approx(best * 2 * a, rel=1e-3)


def test_truss_and_bar_have_the_limit_loads_of_their_derivatives():
    s = 1 / math.sqrt(3)
    assert paths.bar_force(s) == pytest.approx(-2.0e6 * 0.6 * 0.05 / (3 * math.sqrt(3)))
    w = np.linspace(0, 0.05, 101)
    assert paths.truss_limit() >= paths.truss_load(w).max() and paths.truss_load(0.05) == 0
    assert paths.truss_limit() == pytest.approx(paths.truss_load(w).max(), rel=1e-3)


def test_a_path_on_its_closed_form_is_met_and_another_is_missed():
    found = outcome(paths.followed, case="truss", element="enriched", mesh=1, step=0.2)
    crushed = outcome(paths.crushed)
    named = cases(paths, found, crushed)
    assert [case.met for case in named.values()] == [True, True, True]
    assert next(reversed(named.values())).status != "ok"
    found.measured.values["limit"] *= 1.02
    found.measured.values["off"] = 1e-3
    assert [case.met for case in cases(paths, found, crushed).values()] == [False, False, True]


def test_energy_is_kept_by_the_one_scheme_and_its_loss_by_others_is_a_named_failure():
    kept = outcome(motion.flight, integrator="energy-momentum", time_step=0.05, steps=20)
    lost = outcome(motion.flight, integrator="generalized-alpha", time_step=0.05, steps=60)
    named = cases(motion, kept, lost)
    assert all(case.met for case in named.values()) and len(named) == 4
    assert named["flight by generalized-alpha (allowed to fail)"].status == "energy_lost"
    kept.measured.values["angular"].append(1e-6)
    assert [case.met for case in cases(motion, kept, lost).values()] == [True, True, False, True]
    assert motion.present([kept, lost]).figures[0].met is False


def test_a_swing_is_compared_with_the_finest_of_its_question():
    asked = {"force": 50.0, "nu": 0.0}
    found = [
        outcome(motion.swing, **asked, time_step=step, integrator=integrator)
        for step in (0.25, 0.05)
        for integrator in ("trapezoidal", "energy-momentum")
    ]
    named = cases(motion, outcome(motion.flight, integrator="energy-momentum", time_step=0.05, steps=2), *found)
    judged = [case for name, case in named.items() if "dt = 0.25" in name]
    assert [case.met for case in judged] == [True, True] and all(case.expected for case in judged)
    assert all(case.met is None for name, case in named.items() if "dt = 0.05" in name)
