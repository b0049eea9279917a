"""Wall functions: elements that kink where a floor begins, what they leave alone, and where there are any."""

import numpy as np
import pytest

from ancf.functional import interpolation, pressure_on_face
from ancf.material import MooneyRivlin, from_engineering
from ancf.mesh import grid
from ancf.nurbs import Curve, Revolved
from ancf.pressure import follower_pressure
from ancf.run import estimate, solve
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, PROTRUSION, TOP, Band, Outlined
from ancf.system import body, system
from ancf.wall import KINDS, floor_edges, with_walls
from compare.scene import parse

from . import conftest
from .conftest import THICKNESS

RUBBER, SVK = MooneyRivlin(2.5e6, 2.0e6, 1.33e8), from_engineering(2.0e6, 0.3)
FORCE = 2.0e6 * THICKNESS  # N: modulus times the area of a strip one metre wide
LEANING = Curve(1, [0, 0, 1, 2, 3, 3], [[0.1, 0.0], [0.12, 0.02], [0.2, 0.02], [0.24, 0.0]])
SMALL = np.array([0.0, 0.1, 0.25]), np.array([0.0, 0.08, 0.13])  # m: elements with room for lips of a plate of 0.05 m
ALONG = Band(TOP, GROOVE, 0, (0.03, 0.05), 0.02), Band(BOTTOM, PROTRUSION, 0, (0.09, 0.11), 0.02)
TWO = Band(TOP, GROOVE, 0, (0.03, 0.05), 0.02), Band(TOP, GROOVE, 0, (0.085, 0.11), 0.02)
BEHIND = SMALL[0], np.array([0.0, 0.08, 0.15])  # the second groove begins just behind a line
PLATES = conftest.PLATES | {"lips, grooved": (SMALL, ALONG, None), "lips over a line, grooved": (BEHIND, TWO, None)}
GROOVED = [kind for kind in PLATES if "grooved" in kind]


def walled(element, kind, material=SVK, pointwise=False, walls=True):
    """A body of the plates with wall functions, and lips where there is room, or without."""
    lines, bands, surface = PLATES[kind]
    mesh = grid(*lines, surface, FAMILY[element])
    mesh = with_walls(mesh, bands, THICKNESS) if walls else mesh
    return body(mesh, bands, THICKNESS, material, 2000.0, (5, 5, 3), pointwise=pointwise)


def acting(plate):
    return system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), THICKNESS)


def dense(free, q):
    return free.assembly.pattern.full(free.tangent(q.ravel())).toarray()


@pytest.mark.parametrize("kind", GROOVED)
def test_walls_change_no_position_of_the_reference(element, kind):
    """Their reference vectors are zero: nothing moves, volume and mass are those of the plain mesh."""
    plate, (lines, bands, surface) = walled(element, kind), PLATES[kind]
    plain = body(grid(*lines, surface, FAMILY[element]), bands, THICKNESS, SVK, 2000.0, (7, 7, 3))
    assert np.all(plate.mesh.vectors[np.isin(plate.mesh.kinds, KINDS)] == 0)
    assert plate.volume == pytest.approx(plain.volume, rel=1e-13)
    assert plate.total_mass == pytest.approx(plain.total_mass, rel=1e-13)


@pytest.mark.parametrize("material", [SVK, RUBBER], ids=["svk", "rubber"])
@pytest.mark.parametrize("kind", GROOVED)
def test_rigid_motion_costs_nothing_and_six_modes_have_no_energy(element, kind, material):
    """Six zero eigenvalues, and the next is near the plain mesh's: walls add no mode without energy."""
    plate, plain = (walled(element, kind, material, pointwise=True, walls=walls) for walls in (True, False))
    free, rest = acting(plate), plate.mesh.vectors
    stiffness = material.shear / SVK.shear
    assert np.abs(free.force_internal(rest.ravel())).max() < 1e-12 * FORCE * stiffness
    turned = rest @ np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0].T
    assert np.abs(free.force_internal(turned.ravel())).max() < 1e-11 * FORCE * stiffness
    values, before = (
        np.linalg.eigvalsh(dense(own, own.body.mesh.vectors) / own.lengths[:, None] / own.lengths)
        for own in (free, acting(plain))
    )
    assert np.abs(values[:6]).max() < 1e-10 * values[-1]
    assert values[6] > 0.3 * before[6]


@pytest.mark.parametrize("material", [SVK, RUBBER], ids=["svk", "rubber"])
def test_sparing_rules_leave_no_mode_without_energy(material):
    """Of rubber they have two points in each half of the thickness; with two, transverse shear of the elements with
    enhanced strains would cost nothing, since their warping is zero there: these keep three."""
    lowest, groove = [], (Band(TOP, GROOVE, 0, (-0.1, 0.05), THICKNESS / 2),)
    mesh = with_walls(grid(np.array([0.0, 0.1]), np.array([0.0, 0.08]), None, FAMILY["enriched"]), groove, THICKNESS)
    assert mesh.levels(0) == [0.0]
    for way in ("subdomain", "sparing"):
        free = acting(body(mesh, groove, THICKNESS, material, 2000.0, (5, 5, 3), way))
        K = dense(free, free.body.mesh.vectors) / free.lengths[:, None] / free.lengths
        lowest.append(np.linalg.eigvalsh(K)[6] / material.shear)
    assert lowest[1] == pytest.approx(lowest[0], rel=1e-3)


@pytest.mark.parametrize("kind", GROOVED)
def test_quadratic_form_equals_the_sum_over_points(element, kind, deformed):
    """1e-12 of the largest entry: both sum the same numbers in another order."""
    fast, plain = walled(element, kind), walled(element, kind, pointwise=True)
    q, one, other = deformed(fast).ravel(), acting(fast), acting(plain)
    f, K = other.force_internal(q), dense(other, q)
    np.testing.assert_allclose(one.force_internal(q), f, atol=1e-12 * np.abs(f).max())
    np.testing.assert_allclose(dense(one, q), K, atol=1e-12 * np.abs(K).max())


@pytest.mark.parametrize("kind", ["grooved", "lips, grooved", "lips over a line, grooved"])
@pytest.mark.parametrize("volumetric", ["relaxed", "reduced"])
def test_force_and_tangent_of_rubber_are_derivatives(volumetric, kind, deformed):
    """Central differences along some directions, in all groups of elements: their error falls as h^2."""
    lines, bands, _ = PLATES[kind]
    mesh = with_walls(grid(*lines, None, FAMILY["enriched"]), bands, THICKNESS)
    plate = body(mesh, bands, THICKNESS, RUBBER, 2000.0, (5, 5, 3), volumetric=volumetric)
    assert kind != "grooved" or len(plate.connectivity) > 1
    free, q, h = acting(plate), deformed(plate, amount=0.003).ravel(), 1e-6
    still, rng = np.zeros_like(q), np.random.default_rng(2)
    K = dense(free, q)
    for _ in range(3):
        way = rng.standard_normal(q.size)
        ahead, behind = q + h * way, q - h * way
        work = (free.energies(ahead, still)[1] - free.energies(behind, still)[1]) / (2 * h)
        assert free.force_internal(q) @ way == pytest.approx(work, rel=1e-6)
        change = (free.force_internal(ahead) - free.force_internal(behind)) / (2 * h)
        np.testing.assert_allclose(K @ way, change, atol=1e-6 * np.abs(change).max())


@pytest.mark.parametrize("axis", [0, 1])
def test_the_field_kinks_at_a_wall_and_is_continuous(axis):
    """All vectors at random: on both sides of grid lines and walls the same position, another slope at the wall."""
    lines = (np.array([0.0, 0.5, 1.2]), np.array([0.0, 0.4, 1.0]))[:: 1 if axis else -1]
    band = Band(TOP, GROOVE, 1 - axis, (0.55, 0.7), 0.02)
    mesh = with_walls(grid(*lines, None, FAMILY["enriched"]), (band,))
    vectors, hair = np.random.default_rng(0).standard_normal(mesh.vectors.shape), 1e-7

    def at(along, across, z=0.01):
        place = (along, across)[:: 1 if axis else -1]
        return interpolation(mesh, np.array([mesh.locate(*place)]), np.array([[*place, z]])) @ vectors

    for along, across in ((0.2, 0.4), (0.9, 0.4), (0.2, 0.55), (0.9, 0.7)):
        np.testing.assert_allclose(at(along, across - hair), at(along, across + hair), atol=1e-5)
    for across in (0.2, 0.6, 0.8):
        np.testing.assert_allclose(at(0.5 - hair, across), at(0.5 + hair, across), atol=1e-5)
    slopes = [(at(0.2, y + hair) - at(0.2, y - hair)) / (2 * hair) for y in (0.55 - 2 * hair, 0.55 + 2 * hair)]
    assert np.abs(slopes[1] - slopes[0]).max() > 0.1


def test_where_there_are_lips_and_what_they_move():
    """Beside walls with room, each out of its floor; the material beyond it alone, most at the wall, none at the side.

    The groove's walls at 0.03 and 0.05 m have 0.03 m of their element beside them, those of the protrusion on it. In
    longer elements there are none.
    """
    mesh = with_walls(grid(*SMALL, None, FAMILY["enriched"]), ALONG, THICKNESS)
    at = sorted(set(mesh.parameters[mesh.kinds == "l_w", 1].tolist()))
    assert at == [0.03, 0.05, 0.09, 0.11]
    longer = with_walls(grid(SMALL[0], np.array([0.0, 0.2]), None, FAMILY["enriched"]), ALONG[:1], THICKNESS)
    assert set(longer.parameters[longer.kinds == "l_w", 1].tolist()) == {0.03}  # 0.15 m beyond 0.05
    assert not np.any(with_walls(grid(*SMALL, None, FAMILY["enriched"]), ALONG).kinds == "l_w")
    vectors = np.zeros_like(mesh.vectors)
    vectors[(mesh.kinds == "l_w") & (mesh.parameters[:, 1] == 0.03)] = [0.0, 1.0, 0.0]

    def moved(y, z):
        return float((interpolation(mesh, np.array([mesh.locate(0.05, y)]), np.array([[0.05, y, z]])) @ vectors)[0, 1])

    top, floor = THICKNESS / 2, THICKNESS / 2 - 0.02
    assert moved(0.03 - 1e-12, top) == pytest.approx(0.02, rel=1e-6)
    assert 0 < moved(0.015, top) < moved(0.025, top) < 0.02
    assert moved(0.0, top) == pytest.approx(0.0, abs=1e-15)
    assert moved(0.02, floor) == moved(0.02, -top) == moved(0.04, floor) == 0.0


@pytest.mark.parametrize("axis", [0, 1])
def test_lips_go_on_beyond_a_grid_line_and_end_at_the_next_wall(axis):
    """A wall just behind a grid line, another before it: what their lips move is continuous across the line, and
    the tread between the two grooves alone follows them, in the element before the line for the most part."""
    lines = BEHIND[:: 1 if axis else -1]
    bands = [Band(TOP, GROOVE, 1 - axis, band.edges, band.section) for band in TWO]
    mesh = with_walls(grid(*lines, None, FAMILY["enriched"]), bands, THICKNESS)
    at = mesh.parameters[:, axis]
    assert sorted(set(at[mesh.kinds == "l_w"].tolist())) == [0.03, 0.05, 0.085, 0.11]
    assert {shape.walls[-1].inside for shape, _ in mesh.special.values()} == {True, False}

    def moved(wall, across, z=THICKNESS / 2):
        vectors = np.zeros_like(mesh.vectors)
        vectors[(mesh.kinds == "l_w") & (at == wall)] = [0.0, 0.0, 1.0]
        place = (0.05, across)[:: 1 if axis else -1]
        element = np.array([mesh.locate(*place)])
        return float((interpolation(mesh, element, np.array([[*place, z]])) @ vectors)[0, 2])

    assert moved(0.085, 0.085 - 1e-12) == pytest.approx(0.02, rel=1e-6)
    assert moved(0.085, 0.08 - 1e-9) == pytest.approx(moved(0.085, 0.08 + 1e-9), rel=1e-5)
    assert 0 < moved(0.085, 0.06) < moved(0.085, 0.07) < moved(0.085, 0.08) < 0.02
    assert moved(0.085, 0.05) == moved(0.085, 0.02) == moved(0.085, 0.1) == moved(0.085, 0.07, 0.0) == 0
    assert 0 < moved(0.05, 0.07) < moved(0.05, 0.06)
    assert moved(0.05, 0.08) == pytest.approx(0, abs=1e-12)
    assert moved(0.05, 0.09) == 0


@pytest.mark.parametrize("kind", ["lips, grooved", "lips over a line, grooved"])
def test_slopes_on_an_element_s_side_are_those_just_inside(kind):
    """What a lip is where it ends, too: det F is asked for at corners."""
    lines, bands, _ = PLATES[kind]
    mesh = with_walls(grid(*lines, None, FAMILY["enriched"]), bands, THICKNESS)
    for e, (shape, _) in mesh.special.items():
        size = tuple(high - low for low, high in mesh.cells[e])
        for y, inward in ((0.0, 1), (size[1], -1)):
            on, near = (np.array([[0.3 * size[0], y + step, THICKNESS / 2]]) for step in (0.0, inward * 1e-8))
            np.testing.assert_allclose(shape.evaluate(on, size).S_p, shape.evaluate(near, size).S_p, atol=1e-3)


OTHERS = {
    "opposite": Band(BOTTOM, GROOVE, 0, (0.085, 0.095), 0.02),
    "short": Band(TOP, GROOVE, 0, (0.085, 0.095), 0.02, (0.0, 0.1)),
    "shallow": Band(TOP, GROOVE, 0, (0.085, 0.095), 0.001),
    "raised": Band(TOP, PROTRUSION, 0, (0.085, 0.095), 0.02),
    "crossing": Band(TOP, GROOVE, 1, (0.085, 0.095), 0.02),
}


def lip_ends(*bands):
    """Where in one element lips end, by the place of their wall."""
    mesh = with_walls(grid(SMALL[0], np.array([0.0, 0.1]), None, FAMILY["enriched"]), bands, THICKNESS)
    walls = [wall for wall in mesh.special[0].shape.walls if wall.lip and wall.across == 1]
    return {wall.at: wall.lip.end for wall in walls}


def test_what_ends_a_lip():
    """The next groove on its face that is as deep, all along; else the side of the element, or of the next one. That of
    a protrusion its other edge."""
    assert lip_ends(*TWO)[0.05] == 0.085
    for other in OTHERS.values():
        assert lip_ends(TWO[0], other)[0.05] == lip_ends(TWO[0])[0.05] == 0.1
    assert lip_ends(Band(TOP, PROTRUSION, 0, (0.03, 0.05), 0.02)) == {0.03: 0.05, 0.05: 0.03}


OVERLAPS = {
    "deeper over shallower": (Band(TOP, GROOVE, 0, (0.03, 0.06), 0.02), Band(TOP, GROOVE, 0, (0.05, 0.09), 0.03)),
    "as deep": (Band(TOP, GROOVE, 0, (0.03, 0.06), 0.02), Band(TOP, GROOVE, 0, (0.05, 0.09), 0.02)),
    "one in the other": (Band(TOP, GROOVE, 0, (0.03, 0.08), 0.02), Band(TOP, GROOVE, 0, (0.05, 0.06), 0.02)),
    "raised": (Band(TOP, PROTRUSION, 0, (0.03, 0.06), 0.02), Band(TOP, PROTRUSION, 0, (0.05, 0.09), 0.02)),
}


@pytest.mark.parametrize("bands", OVERLAPS.values(), ids=OVERLAPS)
def test_bands_that_overlap_leave_no_mode_without_energy(bands):
    """Of one face the deepest counts: where a wall ends nothing it has no lip, and none lies in the air."""
    mesh = with_walls(grid(*SMALL, None, FAMILY["enriched"]), bands, THICKNESS)
    assert np.any(mesh.kinds == "l_w")
    free = acting(body(mesh, bands, THICKNESS, SVK, 2000.0, (7, 7, 3), pointwise=True))
    values = np.linalg.eigvalsh(dense(free, mesh.vectors) / free.lengths[:, None] / free.lengths)
    assert np.abs(values[:6]).max() < 1e-10 * values[-1] < 1e-3 * values[6]


def test_a_ring_with_grooves_across_has_no_seam_either():
    """Equal elements around, each with a groove just behind its line: one form, and the walls of all alike."""
    tube, count = Revolved(Curve(1, [0, 0, 1, 1], [[0.0, 0.4], [0.1, 0.4]]), 1), 24
    lines = np.linspace(0, 2 * np.pi, count + 1)
    bands = [Band(TOP, GROOVE, 1, (line + 0.03, line + 0.15), 0.02) for line in lines[:-1].tolist()]
    mesh = grid(lines, np.array([0.0, 0.1]), tube, FAMILY["enriched"], True)
    mesh = with_walls(mesh, bands, THICKNESS)
    assert (mesh.kinds == "l_w").sum() % (2 * count) == 0 < (mesh.kinds == "l_w").sum()
    assert body(mesh, bands, THICKNESS, RUBBER, 1100.0, (5, 5, 3)).shapes == 1


def test_outlines_in_an_element_with_walls_cost_no_accuracy():
    """Parts as thick on both sides of a wall are two: 1e-5 of the stiffness at 5 points, 22 % where they were one."""
    square = Curve(1, [0, 0, 1, 2, 3, 4, 4], [[0.02, 0.1], [0.06, 0.1], [0.06, 0.13], [0.02, 0.13], [0.02, 0.1]])
    bands = (*TWO, Outlined(BOTTOM, GROOVE, square, 0.01))
    mesh = with_walls(grid(SMALL[0], np.array([0.0, 0.14]), None, FAMILY["conforming"]), bands, THICKNESS)

    def stiffness(points):
        return dense(acting(body(mesh, bands, THICKNESS, SVK, 2000.0, points, pointwise=True)), mesh.vectors)

    found, exact = stiffness((5, 5, 3)), stiffness((9, 9, 4))
    size = np.sqrt(np.diag(exact))
    np.testing.assert_allclose(found / size[:, None] / size, exact / size[:, None] / size, atol=1e-5)


@pytest.mark.parametrize("kind", GROOVED)
def test_slopes_are_those_of_the_values(kind):
    """Central differences of all functions at places away from kinks, beyond the ends of lips too."""
    lines, bands, surface = PLATES[kind]
    mesh = with_walls(grid(*lines, surface, FAMILY["enriched"]), bands, THICKNESS)
    rng, h = np.random.default_rng(3), 1e-6
    for e, (shape, _) in mesh.special.items():
        size = tuple(high - low for low, high in mesh.cells[e])
        points = rng.random((40, 3)) * (*size, THICKNESS) - (0, 0, THICKNESS / 2)
        for p in range(3):
            step = h * np.eye(3)[p]
            difference = (shape.evaluate(points + step, size).S - shape.evaluate(points - step, size).S) / (2 * h)
            np.testing.assert_allclose(shape.evaluate(points, size).S_p[:, :, p], difference, atol=1e-5)


PULLED = {
    "name": "pulled strip",
    "title": "A strip with a waist, pulled",
    "surface": {"kind": "rectangle", "length": 1.0, "width": 0.4},
    "thickness": THICKNESS,
    "grooves": [
        {"name": face, "face": face, "along": "y", "across": [0.3, 0.55], "depth": 0.015} for face in ("top", "bottom")
    ],
    "material": {"kind": "svk", "youngs_modulus": 2.0e6, "poissons_ratio": 0.0},
    "supports": [{"kind": "clamp", "edge": "x0"}],
    "loads": [{"kind": "edge", "edge": "x1", "force": [1e-3, 0.0, 0.0], "history": [[0.0, 0.0], [1.0, 1.0]]}],
    "probes": [{"name": "end", "at": [1.0, 0.2, 0.0]}],
    "analysis": {"kind": "static"},
    "ancf": {"time_step": 1.0, "levels": [{"mesh": [1, 1], "element": "conforming", "walls": True}]},
}


def test_one_element_holds_a_waist_that_is_pulled():
    """Parts of unequal section in series, nu = 0: F (sum of length / section) / E, exact in one element with walls.

    1e-6: the strain itself, which the linear answer leaves out.
    """
    scene = parse(PULLED, "pulled")
    answer = solve(scene, scene.ancf.levels[0]).displacement[-1, 0, 0]
    exact = 1e-3 / 2.0e6 / 0.4 * (0.75 / THICKNESS + 0.25 / 0.02)
    assert answer == pytest.approx(exact, rel=1e-6)
    plain = solve(scene, scene.ancf.levels[0].model_copy(update={"walls": False})).displacement[-1, 0, 0]
    assert plain < 0.98 * exact


def test_where_there_are_walls():
    """At the edges of a floor; not where a grid line is near, where the band ends, or on an outline."""
    assert floor_edges(Band(TOP, GROOVE, 0, (0.1, 0.24), LEANING)) == pytest.approx([0.12, 0.2])
    assert floor_edges(Band(TOP, GROOVE, 0, (0.1, 0.24), 0.02)) == [0.1, 0.24]
    bent = Curve(2, [0, 0, 0, 1, 1, 1], [[0.1, 0.0], [0.15, 0.02], [0.24, 0.0]])
    assert floor_edges(Band(TOP, GROOVE, 0, (0.1, 0.24), bent)) == [0.1, 0.24]
    lines = np.linspace(0, 1, 5), np.array([0.0, 0.2, 0.5])

    def places(band):
        mesh = with_walls(grid(*lines, None, FAMILY["enriched"]), (band,))
        return sorted(map(tuple, mesh.parameters[mesh.kinds == "r_w"].tolist()))

    assert places(Band(TOP, GROOVE, 0, (0.2 + 1e-4, 0.3), 0.02)) == [(x, 0.3) for x in lines[0]]
    assert places(Band(TOP, GROOVE, 0, (0.25, 0.6), 0.02, (0.1, 0.8))) == [(0.5, 0.25)]
    assert places(Band(TOP, GROOVE, 0, (0.25, 0.6), 0.02, (0.1, np.nextafter(0.75, 0)))) == [(0.5, 0.25)]
    assert places(Band(TOP, GROOVE, 1, (0.3, 0.6), 0.02)) == [(x, y) for x in (0.3, 0.6) for y in lines[1]]


def test_lips_end_at_the_next_groove_though_it_ends_by_round_off_before_the_plate():
    """Its length is that of the plate but for a last digit: the lips of the first groove are the same."""

    def lips(last):
        mesh = grid(*SMALL, None, FAMILY["enriched"])
        bands = (TWO[0], Band(TOP, GROOVE, 0, (0.06, 0.11), 0.02, (0.0, last)))
        return [wall.lip for shape, _ in with_walls(mesh, bands, THICKNESS).special.values() for wall in shape.walls]

    whole = lips(0.25)
    assert any(lip is not None for lip in whole)
    assert lips(np.nextafter(0.25, 0)) == whole


@pytest.mark.parametrize("element", ["enriched", "conforming"])
def test_walls_that_round_off_parts_are_one(element):
    """Grooves that end at 0.3 and begin at the next number: as many vectors as where both say 0.3, and no mode of
    hardly any energy."""

    def made(place):
        bands = (Band(BOTTOM, GROOVE, 0, (0.1, 0.3), 0.02), Band(TOP, GROOVE, 0, (place, 0.45), 0.01))
        mesh = with_walls(grid(np.array([0.0, 0.5]), np.array([0.0, 1.0]), None, FAMILY[element]), bands, THICKNESS)
        return body(mesh, bands, THICKNESS, SVK, 2000.0, (5, 5, 3))

    one, other = made(0.3), made(np.nextafter(0.3, 1))
    assert len(other.mesh.vectors) == len(one.mesh.vectors)
    (value, expected) = (np.linalg.eigvalsh(dense(acting(plate), plate.mesh.vectors)) for plate in (other, one))
    np.testing.assert_allclose(value, expected, atol=1e-9 * expected.max())


def test_a_closed_ring_has_no_seam_in_its_walls():
    """As many wall vectors as grid lines around, and no force at rest."""
    tube = Revolved(Curve(1, [0, 0, 1, 1], [[0.0, 1.0], [0.5, 1.0]]), 1)
    band = Band(TOP, GROOVE, 0, (0.4, 0.6), 0.02)
    mesh = with_walls(grid(np.linspace(0, 2 * np.pi, 9), np.array([0.0, 1.0]), tube, FAMILY["enriched"], True), (band,))
    assert (mesh.kinds == "r_w").sum() == 2 * 8
    ring = body(mesh, (band,), THICKNESS, RUBBER, 1100.0, (5, 5, 3))
    assert ring.shapes == 1
    assert np.abs(acting(ring).force_internal(mesh.vectors.ravel())).max() < 1e-12 * FORCE * RUBBER.shear / SVK.shear


@pytest.mark.parametrize("face", [BOTTOM, TOP])
def test_a_pressure_on_elements_with_walls(face):
    """At rest the follower pressure is the dead one, with forces on the walls too."""
    lines, bands, surface = conftest.PLATES["curved, grooved"]
    mesh = with_walls(grid(*lines, surface, FAMILY["enriched"]), bands)
    load = follower_pressure(mesh, THICKNESS, face, 1.0, ((0.0, 1.0),))
    expected = pressure_on_face(mesh, THICKNESS, face)
    found = load.force(mesh.vectors.ravel(), 0.0).reshape(-1, 3)
    np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())
    assert np.abs(expected[mesh.kinds == "r_w"]).max() > 0.01 * np.abs(expected).max()


def test_symmetry_holds_walls():
    """Half a strip with a plane of symmetry across its groove bends as the whole one."""
    told = PULLED | {
        "grooves": [{"name": "g", "face": "top", "along": "y", "across": [0.3, 0.55], "depth": 0.02}],
        "loads": [{"kind": "edge", "edge": "x1", "force": [0.0, 0.0, 1.0], "history": [[0.0, 0.0], [1.0, 1.0]]}],
        "ancf": {"time_step": 0.5, "levels": [{"mesh": [2, 2], "walls": True}]},
    }
    whole = parse(told, "whole")
    half = parse(
        told
        | {
            "surface": {"kind": "rectangle", "length": 1.0, "width": 0.2},
            "supports": [*told["supports"], {"kind": "symmetry", "edge": "y1", "normal": "Y"}],
            "loads": [told["loads"][0] | {"force": [0.0, 0.0, 0.5]}],
            "ancf": {"time_step": 0.5, "levels": [{"mesh": [2, 1], "walls": True}]},
        },
        "half",
    )
    one, other = (solve(scene, scene.ancf.levels[0]).displacement[-1, 0] for scene in (whole, half))
    np.testing.assert_allclose(other, one, atol=1e-8 * np.abs(one).max())
    assert estimate(half, half.ancf.levels[0])["unknowns"] == solve(half, half.ancf.levels[0]).unknowns
