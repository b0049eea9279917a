"""Paths through limit points: closed forms on both sides of them, independence of the step, failures by name."""

import numpy as np
import pytest

from ancf import path
from ancf.functional import mean_over_edge, value_at
from ancf.linear_solver import LinearSolver
from ancf.loads import spread
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.newton import OK, SINGULAR
from ancf.nurbs import Surface
from ancf.path import TOO_LONG, follow
from ancf.run import solve
from ancf.shape import FAMILY
from ancf.supports import clamp
from ancf.system import body, system
from compare.scene import load as load_scene

E, THICKNESS, WIDTH = 2.0e6, 0.05, 0.2
RAMP = ((0.0, 0.0), (1.0, 1.0))


def points(acting, step, until=1.0):
    solver = LinearSolver(acting.assembly.pattern)
    return list(follow(acting, solver, acting.body.mesh.vectors.ravel().copy(), until, step))


def force(s, area):
    """Force of a St. Venant-Kirchhoff bar of nu = 0 stretched to s: E A s (s^2 - 1)/2; least at s = 1/sqrt(3)."""
    return E * area * s * (s**2 - 1) / 2


def half_truss(element, rise=0.05):
    """Half of von Mises's truss: a strip of base 1 m hinged at its foot, its top guided to move in z, pushed down
    by 1.5 times the greatest load it can carry; and that load as a function of the top's way down."""

    def load(w):
        length = np.hypot(1.0, rise - w)
        return -force(length / np.hypot(1.0, rise), THICKNESS * WIDTH) * (rise - w) / length

    corners = np.array([[[0, 0, 0], [0, WIDTH, 0]], [[1, 0, rise], [1, WIDTH, rise]]], dtype=float)
    surface = Surface((1, 1), ([0, 0, 1, 1], [0, 0, 1, 1]), corners, None)
    mesh = grid([0, 0.5, 1], [0, 1], surface, FAMILY[element])
    plate = body(mesh, (), THICKNESS, from_engineering(E, 0.0), 0.0, (7, 7, 3))
    held, edge_line = np.zeros((len(mesh.vectors), 3), dtype=bool), np.isin(mesh.kinds, ["r", "r_y"])
    x, y = mesh.parameters.T
    held[np.ix_(edge_line & (x == 0), [0, 2])] = True
    held[edge_line & (x == 1), 0] = held[edge_line & (y == 0), 1] = True
    most = 1.5 * load(np.linspace(0, rise, 100001)).max()
    row = mean_over_edge(mesh, (), THICKNESS, "x1")
    acting = system(plate, held.ravel(), [spread(row, (0, 0, -most), RAMP)], THICKNESS)
    return acting, row, most, load


def test_truss_snaps_through_on_its_closed_form(element):
    """Every point of the path lies on P(w): up to the limit point, down to its mirror image and up again to 1.5 P.

    The strip only turns and shortens, which the elements hold exactly; below its Euler load it stays straight.
    """
    acting, row, most, load = half_truss(element)
    found = points(acting, 0.1)
    t = np.array([point.t for point in found])
    w = -np.array([row @ (point.q.reshape(-1, 3) - acting.body.mesh.vectors) for point in found])[:, 2]
    assert {point.status for point in found} == {OK} and t[-1] == 1.0
    np.testing.assert_allclose(most * t, load(w), atol=1e-9 * most)
    assert t.max() == 1.0 and t.min() < -0.6 and w[-1] > 0.1


def test_end_and_limit_do_not_depend_on_the_step(element):
    """Three steps end at one equilibrium; the parabola through the highest points errs like the step's square."""
    ends, limits = [], []
    for step in (0.4, 0.2, 0.1):
        acting = half_truss(element)[0]
        found = points(acting, step)
        ends.append(found[-1].q)
        t, s = (np.array([getattr(point, name) for point in found]) for name in ("t", "length"))
        top = next(i for i in range(1, len(t)) if t[i] > t[i + 1])
        c, b, a = np.polynomial.polynomial.polyfit(s[top - 1 : top + 2] - s[top], t[top - 1 : top + 2], 2)
        limits.append(1.5 * (c - b**2 / (4 * a)))
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-9)
    np.testing.assert_allclose(limits, 1.0, atol=1e-2)
    assert abs(limits[2] - 1) < abs(limits[0] - 1) / 4


def test_crushed_bar_is_followed_beyond_its_greatest_force(make_body):
    """Load steps end at E A/(3 sqrt 3), where s = 1/sqrt(3); the path goes on down the other side, to s < 0.3.

    The parameter comes down to nothing at s = 0, where the bar is crushed flat: a named failure.
    """
    plate = make_body(lines=([0.0, 1.2], [0.0, 0.6]), nu=0.0)
    area = 0.6 * THICKNESS
    most = E * area / (3 * np.sqrt(3))
    row = mean_over_edge(plate.mesh, (), THICKNESS, "x1")
    acting = system(plate, clamp(plate.mesh, "x0", "tangential"), [spread(row, (-2 * most, 0, 0), RAMP)], THICKNESS)
    found = points(acting, 0.1)
    kept = [point for point in found if point.status == OK]
    s = np.array([row @ point.q.reshape(-1, 3) for point in kept])[:, 0] / 1.2
    np.testing.assert_allclose(-2 * most * np.array([point.t for point in kept]), force(s, area), atol=1e-9 * most)
    assert s.min() < 0.3 and found[-1].status != OK


def test_failures_of_a_path_are_named(make_body, monkeypatch):
    plate = make_body()
    load = spread(value_at(plate.mesh, 1.2, 0.6, 0.0), (0, 0, 1.0), RAMP)
    loose = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), [load], THICKNESS)
    assert [point.status for point in points(loose, 0.5)] == [SINGULAR]
    clamped = system(plate, clamp(plate.mesh, "x0", "all"), [load], THICKNESS)
    monkeypatch.setattr(path, "LONGEST", 0.3)
    assert [point.status for point in points(clamped, 0.25)] == [OK, TOO_LONG]


def test_a_scene_is_followed_by_arc_length():
    """Load parameter 1/1.3 at the limit point to 1 % on eight elements, less than half of it behind, 1 at the end."""
    scene = load_scene("shallow_arch")
    result = solve(scene, scene.ancf.levels[0])
    t = result.load_parameter
    assert result.status == "ok" and t[0] == 0 and t[-1] == 1 and len(t) == result.steps == len(result.times)
    assert np.all(np.diff(result.times) > 0) and result.times[1] == pytest.approx(t[1], rel=0.2)
    top = int(np.argmax(np.diff(t) < 0))
    assert t[top] == pytest.approx(1 / 1.3, rel=0.01) and t[top:].min() < 0.4
    np.testing.assert_allclose(result.energies["external"][-1], result.energies["strain"][-1], rtol=0.02)


def test_load_steps_alone_give_no_load_parameter():
    scene = load_scene("shallow_arch").override(
        {"analysis.follow": "load", "loads.0.force": [0.0, 0.0, -1e-4], "ancf.time_step": 1.0}
    )
    assert solve(scene, scene.ancf.levels[0]).load_parameter is None
