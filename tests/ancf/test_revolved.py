"""Revolved plates: the seam has no edge, volumes are Pappus', a ring vibrates and gives way as one, half as a whole."""

import math

import numpy as np
import pytest

from ancf.linear_solver import LinearSolver
from ancf.mesh import grid
from ancf.nurbs import Curve, Revolved, crease, surface_derivatives
from ancf.run import solve
from ancf.shape import FAMILY
from ancf.supports import free_edges
from ancf.unpack import build
from tests.revolved_scenes import RADIUS, THICKNESS, TUBE, arc, arc_volume, cylinder, first, scene_of

BENT = Curve(2, [0, 0, 0, 1, 1, 1], [[-0.3, 0.8], [0.1, 1.4], [0.5, 0.7]], [1, 0.6, 1.2])


def test_derivatives_of_a_revolved_section_are_those_of_its_points():
    """Central differences with a step of 1e-5: their own error is 1e-10 in first, 1e-5 in second derivatives."""
    surface, u, v, step = Revolved(BENT, 1), np.array([0.3, 2.0, 4.0]), np.array([0.2, 0.5, 0.9]), 1e-5
    found = surface_derivatives(surface, u, v)
    for name, du, dv in (("s_u", step, 0), ("s_v", 0, step)):
        ahead, behind = (surface_derivatives(surface, u + k * du, v + k * dv) for k in (1, -1))
        assert np.abs(getattr(found, name) - (ahead.s - behind.s) / (2 * step)).max() < 1e-9
    for name, first_one, du, dv in (("s_uu", "s_u", step, 0), ("s_uv", "s_u", 0, step), ("s_vv", "s_v", 0, step)):
        ahead, behind = (getattr(surface_derivatives(surface, u + k * du, v + k * dv), first_one) for k in (1, -1))
        assert np.abs(getattr(found, name) - (ahead - behind) / (2 * step)).max() < 1e-8


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_angle_begins_on_the_next_axis_and_grows_toward_the_one_after(axis):
    surface = Revolved(Curve(1, [0, 0, 1, 1], [[0.0, 2.0], [1.0, 2.0]]), axis)
    s = surface_derivatives(surface, np.array([0.0, math.pi / 2]), np.array([0.0, 1.0])).s
    assert np.allclose(s[0], 2 * np.eye(3)[(axis + 1) % 3], atol=1e-15)
    assert np.allclose(s[1], 2 * np.eye(3)[(axis + 2) % 3] + np.eye(3)[axis], atol=1e-15)


def test_a_bent_section_has_a_crease_along_the_section_only():
    kinked = Curve(1, [0, 0, 0.5, 1, 1], [[0.0, 1.0], [0.5, 1.2], [1.0, 1.0]])
    assert crease(Revolved(kinked, 0), 1) == 0.5
    assert crease(Revolved(kinked, 0), 0) is None and crease(Revolved(BENT, 0), 1) is None


def test_the_seam_has_no_vectors_of_its_own(element):
    """n x m elements on a closed ring have n lines across it, not n + 1."""
    n, m, shape = 5, 3, FAMILY[element]
    mesh = grid(np.linspace(0, 2 * np.pi, n + 1), np.linspace(0, 1, m + 1), Revolved(BENT, 1), shape, closed=True)
    expected = n * (m + 1) * len(shape.node_kinds) + (n * (m + 1) + n * m) * len(shape.edge_kinds)
    assert len(mesh.vectors) == expected == len(np.unique(mesh.connectivity))
    places = mesh.vectors[mesh.kinds == "r"]
    apart = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(len(places))
    assert apart.min() > 0.1
    assert {edge for e in range(n * m) for edge in mesh.edges_of(e)} == {"y0", "y1"}
    if shape.edges:
        assert free_edges(mesh, np.zeros(3 * len(mesh.vectors), dtype=bool)) == ("y0", "y1")


@pytest.mark.parametrize("mesh", [[12, 4], [4, 9]])
def test_the_seam_at_most_doubles_the_band(mesh):
    """Lines numbered to and fro keep neighbours two apart; one line more is for the elements at the turn."""
    bands = []
    for angle in ([0.0, 6.0], [0.0, 2 * math.pi]):
        system = build(
            *_scene_and_level(
                scene_of(arc(), angle, ancf={"levels": [{"mesh": mesh, "element": "conforming", "points": [4, 4, 2]}]})
            )
        ).system
        bands.append(LinearSolver(system.assembly.pattern).bandwidth)
    assert bands[1] <= 2.1 * bands[0]


def _scene_and_level(scene):
    return scene, first(scene, "ancf")


def test_volume_and_mass_are_those_of_pappus():
    """Cubic arcs and directors quadratic along edges: the volume is right to order 4 at least in the elements' size."""
    errors = []
    for count in (1, 2, 4):
        scene = scene_of(arc(), ancf={"levels": [{"mesh": [8 * count, 2 * count]}]})
        plate = build(*_scene_and_level(scene)).body
        errors.append(abs(plate.volume / arc_volume() - 1))
        assert plate.total_mass == pytest.approx(1000.0 * plate.volume, rel=1e-12)
    assert errors[2] < 5e-5 and errors[0] / errors[1] > 14 and errors[1] / errors[2] > 14


def test_a_groove_around_takes_away_its_own_volume():
    """To the error of the plain plate on the same mesh, 4e-5; the arc's parameter is not its angle."""
    groove = {"name": "round", "face": "top", "along": "x", "across": [0.25, 0.75], "depth": 0.06}
    scene = scene_of(arc(), grooves=[groove], ancf={"levels": [{"mesh": [32, 8]}]})
    exact = arc_volume(depth=0.06, part=_angle_at(0.75))
    assert build(*_scene_and_level(scene)).body.volume == pytest.approx(exact, rel=5e-5)
    assert exact < 0.8 * arc_volume()


def _angle_at(v: float) -> float:
    """Angle about the tube's centre (rad) at the parameter v of the section, from its middle."""
    section = arc()
    curve = Curve(2, section["knots"], section["control_points"], section["weights"])
    along, radius = surface_derivatives(Revolved(curve, 1), 0.0, v).s[[1, 2]]
    assert math.hypot(along, radius - RADIUS) == pytest.approx(TUBE)
    return math.atan2(along, radius - RADIUS)


def test_a_free_ring_has_six_rigid_motions_and_the_ring_s_frequencies():
    """omega^2 = n^2 (n^2 - 1)^2 / (n^2 + 1) E h^2 / (12 rho R^4), in pairs, for h, width << R (Love, art. 293).

    Left out: shear and rotary inertia, (n h/R)^2 in all, 0.03 % here for n = 3.
    """
    width, radius, thickness = 0.02, 1.0, 0.02
    levels = [{"mesh": [48, 1], "points": [5, 5, 3]}]
    scene = scene_of(cylinder(radius, width), thickness=thickness, analysis={"kind": "modes", "count": 9})
    result = solve(*_scene_and_level(scene.override({"ancf.levels": levels})))
    assert result.facts["rigid_modes"] == 6
    for n in (2, 3):
        omega = n * (n**2 - 1) / math.sqrt(n**2 + 1) * thickness / radius**2 * math.sqrt(2e6 / 12 / 1000)
        near = np.sort(np.abs(result.frequencies / (omega / 2 / math.pi) - 1))
        assert near[1] < 2e-3, f"n = {n}: {result.frequencies}, {omega / 2 / math.pi}"


def test_half_a_ring_between_planes_of_symmetry_vibrates_as_the_whole():
    """Frequencies of the half are among those of the whole ring on the same lines, to the eigensolver's 1e-9."""
    whole = solve(*_scene_and_level(scene_of(arc(), analysis={"kind": "modes", "count": 20})))
    supports = [{"kind": "symmetry", "edge": edge, "normal": "X"} for edge in ("x0", "x1")]
    half = scene_of(
        arc(),
        [0.0, math.pi],
        supports=supports,
        ancf={"levels": [{"mesh": [6, 4]}]},
        analysis={"kind": "modes", "count": 6},
    )
    part = solve(*_scene_and_level(half))
    assert part.facts["rigid_modes"] == 3  # Y, Z and about X
    apart = np.abs(part.frequencies[:, None] / whole.frequencies - 1).min(axis=1)
    assert apart.max() < 1e-7, apart


def test_a_ring_between_two_forces_gives_way_as_a_thin_ring():
    """Both forces P, E I of the ring: each end comes closer by (pi/4 - 2/pi)/2 P R^3 / (E I) (Timoshenko).

    A quarter carries P/2 at its end. The wall is R/50 thick: shear and stretch add 1e-3, and a force of 1e-4 of what
    bends it by its own radius keeps the answer linear to 1e-4.
    """
    thickness, width, young = 0.02, 0.1, 2e6
    stiffness = young * width * thickness**3 / 12
    push = 1e-3 * stiffness
    supports = [{"kind": "symmetry", "edge": "x0", "normal": "X"}, {"kind": "symmetry", "edge": "x1", "normal": "Z"}]
    scene = scene_of(
        cylinder(1.0, width),
        [0.0, math.pi / 2],
        thickness=thickness,
        material={"kind": "svk", "youngs_modulus": young},
        supports=[*supports, {"kind": "hold", "corner": "x0y0", "components": ["Y"], "over": "middle"}],
        loads=[{"kind": "edge", "edge": "x0", "force": [0, 0, -push / 2]}],
        probes=[{"name": "top", "at": [0.0, 0.5, 0.0]}],
        analysis={"kind": "static"},
        ancf={"levels": [{"mesh": [16, 1], "time_step": 1.0}]},
        reference=None,
    )
    result = solve(*_scene_and_level(scene))
    assert result.status == "ok"
    exact = -(math.pi / 4 - 2 / math.pi) / 2 * push / stiffness
    assert result.displacement[-1, 0, 2] == pytest.approx(exact, rel=2e-3)


def test_the_picture_has_no_wall_at_the_seam():
    outline = solve(*_scene_and_level(scene_of(arc()))).outline
    middle = outline.points[outline.triangles].mean(axis=1)
    assert THICKNESS and not np.any((np.abs(middle[:, 0]) < 1e-9) & (middle[:, 2] > 0))
