"""Holds, planes of symmetry, pressure and turning moments against closed forms and against whole plates."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import fsolve

from ancf.functional import pressure_on_face, slope_through_edge
from ancf.linear_solver import LinearSolver
from ancf.loads import EdgeMoment
from ancf.newton import OK, equilibrium
from ancf.run import estimate, solve
from ancf.shape import FAMILY
from ancf.supports import clamp, hold_edge, symmetry
from ancf.system import system
from compare.scene import AncfLevel, parse

ROOT = np.sqrt(0.5)
RAMP = [[0.0, 0.0], [1.0, 1.0]]
ELEMENTS = list(FAMILY)


def scene(length, width, thickness, young, nu, supports, loads, at, surface=None):
    return parse(
        {
            "name": "plate",
            "title": "a plate",
            "surface": surface or {"kind": "rectangle", "length": length, "width": width},
            "thickness": thickness,
            "material": {"kind": "svk", "youngs_modulus": young, "poissons_ratio": nu},
            "supports": supports,
            "loads": [{"history": RAMP, **load} for load in loads],
            "probes": [{"name": f"P{i}", "at": place} for i, place in enumerate(at)],
            "analysis": {"kind": "static"},
            "ancf": {"levels": [{"mesh": [1, 1], "time_step": 1.0}]},
        },
        "test",
    )


def moved(question, mesh, element, step=1.0):
    """Displacements (p, 3) of the probes at the end."""
    result = solve(question, AncfLevel(mesh=mesh, element=element, time_step=step))
    assert result.status == OK, result.message
    return result.displacement[-1]


@pytest.mark.parametrize("element", ELEMENTS)
def test_half_a_plate_beside_its_plane_of_symmetry_is_the_whole(element):
    """Bent to a tenth of its length and stretched: both meshes have the same solution, up to Newton's tolerance."""
    moves = []
    for width, share in ((0.6, 1.0), (0.3, 0.5)):
        supports = [{"kind": "clamp", "edge": "x0"}, {"kind": "symmetry", "edge": "y1", "normal": "Y"}]
        force = {"kind": "edge", "edge": "x1", "force": [200.0 * share, 0.0, -20.0 * share]}
        press = {"kind": "pressure", "face": "top", "pressure": 3.0}
        kept = supports if width == 0.3 else supports[:1]
        at = [[1.0, 0.0, 0.0], [1.0, 0.3, 0.0], [0.5, 0.15, 0.01]]
        question = scene(1.0, width, 0.05, 2e6, 0.3, kept, [force, press], at)
        moves.append(moved(question, (3, 4 if width == 0.6 else 2), element))
    assert np.abs(moves[0][0, 2]) > 0.05
    np.testing.assert_allclose(moves[1], moves[0], atol=1e-8)


def test_symmetry_holds_the_outward_gradient_only_where_it_begins_along_the_normal(make_body):
    mesh = make_body().mesh
    held = symmetry(mesh, "y1", 1).reshape(-1, 3)
    edge = mesh.parameters[:, 1] == mesh.y_lines[-1]
    for kind, components in {"r": [1], "r_x": [1], "r_z": [1], "r_y": [0, 2], "d_e": [1], "r_xy": [0, 2]}.items():
        expected = np.isin(range(3), components)
        assert (held[edge & (mesh.kinds == kind)] == expected).all(), kind
    assert not held[~edge].any()
    mesh.vectors[edge & (mesh.kinds == "r_y")] += [0.3, 0.0, 0.0]  # lines that meet the edge at an angle
    assert not symmetry(mesh, "y1", 1).reshape(-1, 3)[edge & (mesh.kinds == "r_y")].any()


@pytest.mark.parametrize("element, factor, n, miss", [("conforming", 1.0, 8, 1.3e-2), ("enriched", 5 / 6, 16, 1e-6)])
def test_strip_on_two_hinges_sags_as_a_timoshenko_beam(element, factor, n, miss):
    """nu = 0, 5 p b L^4 / (384 E I) + p L^2 / (8 k G h): k = 1 of a straight director, 5/6 of a warped one.

    The conforming element's curvature is constant: it errs by 0.8 / n^2, n = 8 elements. The layers of the
    enriched one bend with a moment that is quadratic: 2.5e-5, 4.7e-6, 5.5e-7 too far with 4, 8, 16 elements.
    """
    length, h, young, p = 2.0, 0.1, 1e6, 1e-4
    hinge = {"kind": "hold", "components": ["Y", "Z"], "over": "middle"}
    supports = [{**hinge, "edge": "x0"}, {**hinge, "edge": "x1"}]
    supports.append({"kind": "hold", "corner": "x0y0", "components": ["X"], "over": "middle"})
    press = {"kind": "pressure", "face": "bottom", "pressure": p}
    question = scene(length, 0.3, h, young, 0.0, supports, [press], [[1.0, 0.15, 0.0]])
    exact = 5 * p * length**4 / (32 * young * h**3) + p * length**2 / (8 * factor * young / 2 * h)
    assert moved(question, (n, 1), element)[0, 2] == pytest.approx(exact, rel=miss)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_plate_held_throughout_along_z_stretches_in_plane_strain(element):
    """Small uniaxial tension with Y free: strain p (1 - nu^2) / E, across -p nu (1 + nu) / E."""
    young, nu, p = 1e6, 0.3, 1e-3
    supports = [{"kind": "symmetry", "edge": "x0", "normal": "X"}, {"kind": "symmetry", "edge": "y0", "normal": "Y"}]
    supports.append({"kind": "hold", "whole": True, "components": ["Z"]})
    load = {"kind": "edge", "edge": "x1", "force": [p * 0.6 * 0.1, 0.0, 0.0]}
    found = moved(scene(1.0, 0.6, 0.1, young, nu, supports, [load], [[1.0, 0.6, 0.05]]), (2, 1), element)
    exact = [p * (1 - nu**2) / young, -p * nu * (1 + nu) / young * 0.6, 0.0]
    np.testing.assert_allclose(found[0], exact, rtol=1e-6)


def test_a_face_held_over_its_height_does_not_turn(make_body):
    mesh = make_body().mesh
    middle, face = (hold_edge(mesh, "x0", [2], over).reshape(-1, 3) for over in (False, True))
    assert set(mesh.kinds[middle[:, 2]]) == {"r", "r_y"}
    assert set(mesh.kinds[face[:, 2]]) == {"r", "r_y", "r_z", "d_e"} & set(mesh.kinds)
    assert not middle[:, :2].any() and not face[:, :2].any()


@pytest.mark.parametrize("face", [-1, 1])
def test_pressure_on_a_cylinder_has_the_resultant_of_its_chord(make_body, face):
    """Quarter cylinder about X, radius 1, length 0.5: p times the projected area of the loaded face."""
    plate = make_body("curved")
    row = pressure_on_face(plate.mesh, 0.05, face)
    total = row[plate.mesh.kinds == "r"].sum(axis=0)
    chord = np.sqrt(2) * (1 + face * 0.025)
    np.testing.assert_allclose(total, [0, 0, -face * 0.5 * chord], atol=1e-3)  # cubic r over an arc of 30 degrees


def quarter_ring(radius, width):
    """A quarter ring about Y from Z = 0 to X = 0; around, then along Y, so that the normal points inward."""
    arc = radius * np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    points = [[[x, y, z] for y in (0.0, width)] for x, z in arc]
    knots = [[0, 0, 0, 1, 1, 1], [0, 0, width, width]]
    weights = [[1.0, 1.0], [ROOT, ROOT], [1.0, 1.0]]
    return {"kind": "nurbs", "degree": [2, 1], "knots": knots, "control_points": points, "weights": weights}


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("face", ["top", "bottom"])
def test_quarter_ring_between_planes_of_symmetry_swells_as_lame_says(element, face):
    """nu = 0, pressure on the inner face (the top) or the outer one: Lame's u (R) with inner and outer radii a, b.

    The director's one thickness strain leaves (h / R)^2 / 24 = 1e-4, 12 elements of 7.5 degrees the rest: the
    error is 3.6e-3, 1.4e-3, 5e-4 with 6, 12, 24 conforming ones, -2.3e-3, -6e-5 with 6, 12 enriched ones.
    """
    young, p, radius, h = 1e6, 1e-2, 1.0, 0.05
    a, b = radius - h / 2, radius + h / 2
    inner, outer = a**2 * (radius + b**2 / radius), -(b**2) * (radius + a**2 / radius)
    exact = p / young / (b**2 - a**2) * (inner if face == "top" else outer)
    supports = [{"kind": "symmetry", "edge": "x0", "normal": "Z"}, {"kind": "symmetry", "edge": "x1", "normal": "X"}]
    supports.append({"kind": "hold", "corner": "x0y0", "components": ["Y"]})
    press = {"kind": "pressure", "face": face, "pressure": p}
    ends = [[0.0, 0.1, 0.0], [1.0, 0.1, 0.0]]
    question = scene(0, 0, h, young, 0.0, supports, [press], ends, quarter_ring(radius, 0.2))
    found = moved(question, (12, 1), element)
    np.testing.assert_allclose([found[0, 0], found[1, 2]], exact, rtol=1.5e-3)


def rolled(moment, length, h, young):
    """End (X, Z) of a strip of unit width, nu = 0, that an end moment bends to an arc with a straight director.

    The fibre at z is stretched to s + k z g, with the director's stretch g; s, g and the curvature k make
    the energy per length, E / 2 times the integral of strain^2 plus E h / 2 ((g^2 - 1) / 2)^2, less M k stationary.
    """
    z, w = np.polynomial.legendre.leggauss(4)
    z, w = z * h / 2, w * h / 2

    def out_of_balance(state):
        s, g, k = state
        fibre = s + k * z * g
        pull = young / 2 * (fibre**3 - fibre) * w
        return pull.sum(), pull @ z * k + young * h / 2 * (g**3 - g), pull @ z * g - moment

    s, _, k = fsolve(out_of_balance, (1.0, 1.0, moment / (young * h**3 / 12)), xtol=1e-13)
    return s * np.sin(k * length) / k, s * (1 - np.cos(k * length)) / k


@pytest.mark.parametrize("element, mesh, miss", [("conforming", (64, 2), 3e-3), ("enriched", (32, 2), 1e-5)])
def test_end_moment_rolls_a_strip_to_a_circle(element, mesh, miss):
    """Sze, Liu, Lo 2004, section 3.2: L / h = 120 and M = 2 pi E I / L. Radial stress shortens the director, which
    turns the end 4.6e-4 further than E I says. The conforming element errs by 2e-2 and 2e-3 of L with 32 and 64
    elements. A second element across couples nodes that no element does.
    """
    moment = 2 * np.pi * 100 / 12.0
    x, z = rolled(moment, 12.0, 0.1, 1.2e6)
    load, ends = {"kind": "moment", "edge": "x1", "moment": [0.0, -moment, 0.0]}, [[12.0, 0.0, 0.0], [12.0, 1.0, 0.0]]
    question = scene(12.0, 1.0, 0.1, 1.2e6, 0.0, [{"kind": "clamp", "edge": "x0"}], [load], ends)
    found = moved(question, mesh, element, step=0.1)
    np.testing.assert_allclose(found, [[x - 12.0, 0.0, z]] * 2, atol=miss * 12.0)


def test_tangent_of_a_moment_is_the_difference_of_its_force(make_body, deformed):
    plate = make_body("plain")
    row = slope_through_edge(plate.mesh, (), 0.05, "x1")
    load = EdgeMoment(row, np.array([0.3, -1.0, 0.2]), ((0.0, 0.0), (1.0, 2.0)))
    acting = system(plate, clamp(plate.mesh, "x0", "all"), (), 0.05, [load])
    q, eps = deformed(plate).ravel(), 1e-6
    plain = acting.assembly.pattern.full(acting.tangent(q)).toarray()
    K = acting.assembly.pattern.full(acting.tangent_loaded(q, 0.7)).toarray() - plain
    for u in np.flatnonzero(np.abs(K).sum(axis=0))[::5]:
        move = np.zeros_like(q)
        move[acting.assembly.free[u]] = eps
        change = (acting.following_total(q + move, 0.7) - acting.following_total(q - move, 0.7)) / (2 * eps)
        np.testing.assert_allclose(-K[:, u], change[acting.assembly.free], atol=1e-6 * np.abs(change).max() + 1e-9)


def test_a_moments_work_is_its_angle(make_body):
    """Turned rigidly about its axis from 0 to 2 rad the director takes M x 2 rad."""
    mesh = make_body("plain").mesh
    load = EdgeMoment(slope_through_edge(mesh, (), 0.05, "x1"), np.array([0.0, -3.0, 0.0]), ((0.0, 1.0),))
    angles = np.linspace(0, 2, 401)
    turns = [np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]]) for a in angles]
    paths = [(mesh.vectors @ turn).ravel() for turn in turns]
    work = sum((load.force(a, 0.0) + load.force(b, 0.0)) @ (b - a) / 2 for a, b in pairwise(paths))
    assert abs(work) == pytest.approx(6.0, rel=1e-5)


def test_without_moments_the_path_is_that_of_dead_loads(make_body):
    plate = make_body("plain")
    acting = system(plate, clamp(plate.mesh, "x0", "all"), (), 0.05)
    path = equilibrium(acting, LinearSolver(acting.assembly.pattern), plate.mesh.vectors.ravel(), 0.0, 1.0, 1.0)
    assert path.status == OK and np.array_equal(path.q, plate.mesh.vectors.ravel())


def test_explain_names_supports_and_loads():
    supports = [{"kind": "symmetry", "edge": "y1", "normal": "Y"}, {"kind": "hold", "edge": "x1", "components": ["Z"]}]
    loads = [{"kind": "pressure", "face": "top", "pressure": 1.0}]
    loads.append({"kind": "moment", "edge": "x0", "moment": [0.0, 1.0, 0.0]})
    question = scene(1.0, 1.0, 0.1, 1e6, 0.0, supports, loads, [[0.0, 0.0, 0.0]])
    told = estimate(question, question.ancf.levels[0])["modelled"]
    assert told[-4:] == [
        "symmetry at edge y1, normal Y: the face stays in its plane",
        "hold of Z at edge x1, over its face",
        "pressure on the top face, dead",
        "moment on edge x0 that turns with it",
    ]
