"""Holds, planes of symmetry, pressure and turning moments against closed forms and against whole solids."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import fsolve

from compare.scene import ReferenceLevel, parse
from reference_fe.geometry import MeshError, Plate
from reference_fe.loads import Moment, pressure_force, slope_share
from reference_fe.mesh import Spacing, make
from reference_fe.run import solve
from reference_fe.supports import held
from reference_fe.unpack import mid_surface, plate_of, spacing_of

ROOT = 2**-0.5
RAMP = [[0.0, 0.0], [1.0, 1.0]]


def scene(shape, thickness, young, nu, supports, loads, at, **changes):
    length, width = shape if isinstance(shape, tuple) else (0, 0)
    flat = {"kind": "rectangle", "length": length, "width": width}
    return parse(
        {
            "name": "plate",
            "title": "a plate",
            "surface": flat if isinstance(shape, tuple) else shape,
            "thickness": thickness,
            "material": {"kind": "svk", "youngs_modulus": young, "poissons_ratio": nu, "density": 1000.0},
            "supports": supports,
            "loads": [{"history": RAMP, **load} for load in loads],
            "probes": [{"name": f"P{i}", "at": place} for i, place in enumerate(at)],
            "analysis": {"kind": "static"},
            "reference": {"levels": [{"size": 1.0, "time_step": 1.0}]},
            **changes,
        },
        "test",
    )


def solved(question, size, step=1.0):
    result = solve(question, ReferenceLevel(size=size, time_step=step))
    assert result.status == "ok", result.message
    return result


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_half_a_plate_beside_its_plane_of_symmetry_is_the_whole(kind):
    """Bent and stretched; the meshes differ, each within 1 % of the limit. The face slides in its plane."""
    moves = []
    for width, share in ((0.6, 1.0), (0.3, 0.5)):
        supports = [{"kind": "clamp", "edge": "x0"}, {"kind": "symmetry", "edge": "y1", "normal": "Y"}]
        force = {"kind": "edge", "edge": "x1", "force": [200.0 * share, 0.0, -20.0 * share]}
        ends = [[1.0, 0.0, 0.0], [1.0, 0.3, 0.0], [0.5, 0.3, 0.01]]
        analysis = {"kind": kind, "until": 1.0, "every": 1.0}
        kept = supports if width == 0.3 else supports[:1]
        question = scene((1.0, width), 0.1, 2e6, 0.3, kept, [force], ends, analysis=analysis)
        moves.append(solved(question, 0.2, 0.1 if kind == "dynamic" else 1.0))
    half, whole = moves[1], moves[0]
    found, expected = half.displacement[-1], whole.displacement[-1]
    assert np.abs(expected[:, 2]).max() > 0.01
    np.testing.assert_allclose(found, expected, atol=0.01 * np.abs(expected).max())
    assert np.abs(half.displacement[:, 1:, 1]).max() < 1e-15  # a probe's weights have round-off
    energy = half.energies["kinetic"][-1] + half.energies["strain"][-1]
    assert kind == "static" or energy == pytest.approx(half.energies["external"][-1], rel=0.01)


def test_a_held_component_at_free_nodes_is_counted_and_leaves_the_others():
    """A bar held along Y and Z on all its sides slides freely along X: u = g X^2 rho (L - X / 2) / E."""
    supports = [{"kind": "clamp", "edge": "x0"}]
    supports += [{"kind": "hold", "edge": edge, "components": ["Y", "Z"]} for edge in ("y0", "y1")]
    load = {"kind": "gravity", "acceleration": [0.001, 0.0, 0.0]}
    question = scene((1.0, 0.2), 0.2, 1e6, 0.0, supports, [load], [[1.0, 0.1, 0.0], [0.5, 0.0, 0.0]])
    result = solved(question, 0.2)
    x = np.array([1.0, 0.5])
    exact = np.stack([1e-6 * x * (1 - x / 2), 0 * x, 0 * x], axis=1)
    np.testing.assert_allclose(result.displacement[-1], exact, atol=1e-11)
    plain = solved(scene((1.0, 0.2), 0.2, 1e6, 0.0, supports[:1], [load], [[1.0, 0.1, 0.0]]), 0.2)
    assert 0 < result.unknowns < plain.unknowns


def test_a_plate_held_throughout_along_z_stretches_in_plane_strain():
    """Small uniaxial tension with Y free: strain p (1 - nu^2) / E, across -p nu (1 + nu) / E."""
    young, nu, p = 1e6, 0.3, 1e-3
    supports = [{"kind": "symmetry", "edge": "x0", "normal": "X"}, {"kind": "symmetry", "edge": "y0", "normal": "Y"}]
    supports.append({"kind": "hold", "whole": True, "components": ["Z"]})
    load = {"kind": "edge", "edge": "x1", "force": [p * 0.6 * 0.2, 0.0, 0.0]}
    found = solved(scene((1.0, 0.6), 0.2, young, nu, supports, [load], [[1.0, 0.6, 0.1]]), 0.4)
    exact = [p * (1 - nu**2) / young, -p * nu * (1 + nu) / young * 0.6, 0.0]
    np.testing.assert_allclose(found.displacement[-1, 0], exact, rtol=1e-6, atol=1e-20)


@pytest.mark.parametrize("over", ["middle", "bottom"])
def test_beam_on_two_hinges_sags_as_a_timoshenko_beam(over):
    """nu = 0: 5 p L^4 / (384 E I) + 6/5 p L^2 / (8 G h); a line hinge in a solid adds its local dent, below 1 %.

    Held at the bottom, the end sections turn about it, which stretches nothing as X is free at one end.
    """
    length, h, young, p = 2.0, 0.1, 1e6, 1e-4
    hinge = {"kind": "hold", "components": ["Y", "Z"], "over": over}
    supports = [{**hinge, "edge": "x0"}, {**hinge, "edge": "x1"}]
    supports.append({"kind": "hold", "corner": "x0y0", "components": ["X"], "over": over})
    press = {"kind": "pressure", "face": "bottom", "pressure": p}
    question = scene((length, 0.1), h, young, 0.0, supports, [press], [[1.0, 0.05, 0.0]])
    exact = 5 * p * length**4 / (32 * young * h**3) + 6 / 5 * p * length**2 / (8 * young / 2 * h)
    assert solved(question, 0.1).displacement[-1, 0, 2] == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.0, 0.0), (1.0, 0.3)])
def test_a_corner_is_held_at_its_middle_alone(place):
    solid = make(Plate(1.0, 0.3, 0.1, marks=(((*place, 0.0), (*place, 0.0)),)), Spacing(0.3))
    mask = held(solid, ((0, place[0]), (1, place[1]), (2, 0.0)), (2,))
    assert mask.sum() == 1 and np.allclose(solid.box.doflocs[:, mask.any(axis=1)].ravel(), [*place, 0.0])


def test_a_middle_line_is_imprinted_from_end_to_end():
    solid = make(Plate(1.0, 0.3, 0.1, marks=(((0.0, 0.0, 0.0), (0.0, 0.3, 0.0)),)), Spacing(0.1))
    nodes = held(solid, ((0, 0.0), (2, 0.0)), (0, 2)).any(axis=1)
    y = np.sort(solid.box.doflocs[1, nodes])
    assert y[0] == 0 and np.isclose(y[-1], 0.3) and len(y) % 2 == 1 and np.diff(y).max() < 0.06


@pytest.mark.parametrize("face", ["bottom", "top"])
@pytest.mark.parametrize("across", [[0.1, 0.2], [0.0, 0.3]], ids=["part", "all"])
@pytest.mark.parametrize("place", [{"edge": "x0"}, {"corner": "x0y0"}], ids=["edge", "corner"])
def test_a_face_is_held_at_its_own_height_where_a_protrusion_covers_it(face, across, place):
    """Nodes on the whole edge, no farther apart than the largest edge, or the one at the corner."""
    hold = {"kind": "hold", "components": ["Y", "Z"], "over": face, **place}
    rib = {"name": "rib", "face": face, "along": "x", "across": across, "depth": 0.04}
    question = scene((1.0, 0.3), 0.1, 1e6, 0.3, [hold], [], [[1.0, 0.3, 0.0]], protrusions=[rib])
    frame, surface = mid_surface(question)
    plate = plate_of(question, frame, surface)
    solid = make(plate, spacing_of(plate, 0.2), surface)
    at = ((0, 0.0), (2, 0.05 if face == "top" else -0.05)) + (((1, 0.0),) if "corner" in place else ())
    y = np.sort(solid.places[1, held(solid, at, (2,)).any(axis=1)])
    assert y[0] == 0 and len(y) % 2 == 1
    assert len(y) == 1 if "corner" in place else y[-1] == 0.3 and np.diff(y).max() < 0.11


def test_a_support_where_the_material_is_cut_away_is_a_named_failure(build):
    solid = build.solid(build.grooved, 0.3)
    with pytest.raises(MeshError) as failure:
        held(solid, ((1, 0.4), (2, -0.02)), (2,))
    assert failure.value.status == "support_misses"


@pytest.mark.parametrize("side", [-1, 1])
def test_pressure_on_a_cylinder_has_the_resultant_of_its_chord(build, side):
    """Quarter cylinder about X, radius 1, length 0.4, thickness 0.2; quadratic facets err by 1e-4."""
    force = pressure_force(build.curved(0.2), side, 0.1).sum(axis=0)
    np.testing.assert_allclose(force, [0, 0, -side * 0.4 * np.sqrt(2) * (1 + side * 0.1)], atol=2e-4)


def test_quarter_ring_between_planes_of_symmetry_swells_as_lame_says():
    """nu = 0 and an inner pressure; the normal points inward, so the inner face is the top."""
    young, p, radius, h = 1e6, 1e-2, 1.0, 0.3
    a, b = radius - h / 2, radius + h / 2
    exact = p / young * a**2 / (b**2 - a**2) * (radius + b**2 / radius)
    arc = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    points = [[[x, y, z] for y in (0.0, 0.3)] for x, z in arc]
    weights = [[1.0, 1.0], [ROOT, ROOT], [1.0, 1.0]]
    ring = {"kind": "nurbs", "degree": [2, 1], "knots": [[0, 0, 0, 1, 1, 1], [0, 0, 0.3, 0.3]]}
    supports = [{"kind": "symmetry", "edge": "x0", "normal": "Z"}, {"kind": "symmetry", "edge": "x1", "normal": "X"}]
    supports.append({"kind": "hold", "corner": "x0y0", "components": ["Y"], "over": "middle"})
    press = {"kind": "pressure", "face": "top", "pressure": p}
    surface = {**ring, "control_points": points, "weights": weights}
    found = solved(scene(surface, h, young, 0.0, supports, [press], [[0, 0.15, 0], [1, 0.15, 0]]), 0.25)
    np.testing.assert_allclose(
        [found.displacement[-1, 0, 0], found.displacement[-1, 1, 2]], exact, rtol=2e-3
    )  # 0.25 m edges, as in the other test of Lame's cylinder


def arc(moment, length, h, young):
    """End (X, Z) of a strip of unit width, nu = 0, bent by an end moment, and its curvature, to second order in k h.

    Fibres stretched to s + k y, with the radial strain -k^2 (h^2/4 - z^2) / 2 from the bending stress that
    turns with them: y = z - k^2 (h^2 z / 4 - z^3 / 3) / 2.
    """
    z, w = np.polynomial.legendre.leggauss(6)
    z, w = z * h / 2, w * h / 2

    def out_of_balance(state):
        s, k = state
        y = z - k**2 * (h**2 * z / 4 - z**3 / 3) / 2
        pull = young / 2 * ((s + k * y) ** 3 - (s + k * y)) * w
        return pull.sum(), pull @ y - moment

    s, k = fsolve(out_of_balance, (1.0, moment / (young * h**3 / 12)), xtol=1e-13)
    return s * np.sin(k * length) / k, s * (1 - np.cos(k * length)) / k


def test_end_moment_bends_a_strip_to_half_a_circle():
    """L / h = 20. The linear traction differs from the bending stress by a self-equilibrated (k h)^2 = 2 % of it,
    within h of the end; the clamp holds the radial strain within h. Each changes the end by about (k h)^2 h / L."""
    length, h, young = 4.0, 0.2, 1.2e6
    moment = np.pi / length * young * h**3 / 12 * h
    load = {"kind": "moment", "edge": "x1", "moment": [0.0, -moment, 0.0]}
    question = scene((length, h), h, young, 0.0, [{"kind": "clamp", "edge": "x0"}], [load], [[length, h / 2, 0.0]])
    x, z = arc(moment / h, length, h, young)
    found = solved(question, 0.2, step=0.5).displacement[-1, 0]
    np.testing.assert_allclose(found, [x - length, 0.0, z], atol=2e-3 * length)


def test_tangent_of_a_moment_is_the_difference_of_its_force(build):
    solid = build.solid(Plate(1.0, 0.3, 0.1), 0.3)
    slope = slope_share(solid, 0, 1.0)
    np.testing.assert_allclose(slope @ solid.mesh.doflocs.T, [0, 0, 1], atol=1e-12)
    moment = Moment(slope, np.array([0.0, 0.0, 1.0]), np.array([0.3, -1.0, 0.2]), np.array([[0.0, 0.0], [1.0, 2.0]]))
    rng, eps = np.random.default_rng(0), 1e-6
    u, move = (0.1 * rng.standard_normal((slope.size, 3)) for _ in range(2))
    change = (moment.at(u + eps * move, 0.7)[0] - moment.at(u - eps * move, 0.7)[0]) / (2 * eps)
    expected = np.outer(slope, moment.at(u, 0.7)[1] @ (slope @ move))
    np.testing.assert_allclose(change, expected, atol=1e-7 * np.abs(expected).max())


def test_coupled_tangent_is_the_dense_one(build):
    """The values that a moment adds, put back into a full matrix, are slope x slope x its 3 x 3 derivative."""
    from reference_fe.elasticity import couple, pattern, tabulate

    solid = build.solid(Plate(1.0, 0.3, 0.1), 0.3)
    slope, block = slope_share(solid, 0, 1.0), np.array([[2.0, 1.0, 0.5], [1.0, -1.0, 0.2], [0.5, 0.2, 3.0]])
    fixed = solid.box.doflocs[0] < 1e-9
    fixed |= (solid.box.doflocs[0] > 1 - 1e-9) & (solid.box.doflocs[1] < 1e-9)  # some of the coupled nodes
    where = pattern(tabulate(solid, 4).nodes, fixed, [np.flatnonzero(slope)])
    values = np.zeros(where.indices.size)
    couple(where, slope, block, values)
    n = 3 * where.free.size
    full = np.zeros((n, n))
    full[np.repeat(np.arange(n), np.diff(where.indptr)), where.indices] = values
    full += np.triu(full, 1).T
    np.testing.assert_allclose(full, np.kron(np.outer(slope[where.free], slope[where.free]), block), atol=1e-12)
