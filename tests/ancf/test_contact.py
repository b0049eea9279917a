"""Contact point by point: gaps, the law by hand, the true face, and tangents against differences of forces."""

from dataclasses import replace

import numpy as np
import pytest

from ancf import obstacle
from ancf.contact import Contact, Pair, Reach
from ancf.contact_law import Law, Motion, friction, part_inside, pressure_at_end, pressure_in_mean
from ancf.face import _profile, _share, face
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.nurbs import Curve
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, TOP, Band, Outlined, thickness_range
from ancf.system import body, system

from .conftest import PLATES, THICKNESS

GROUND = obstacle.plane([0, 0, 0.1], [0, 0, 2.0])
SLOPE = obstacle.plane([0.1, 0, 0], [0.2, -0.3, 1.0])
BALL = obstacle.sphere([0.1, 0.2, -0.5], 0.8)
DRUM = obstacle.drum([0.1, 0.2, -0.5], [1.0, 0.5, 0.1], 0.8)
BODIES = {"plane": SLOPE, "sphere": BALL, "drum": DRUM}


@pytest.fixture(params=["enriched"])
def element(request):
    """The default element; the tangent is also taken of the paper's."""
    return request.param


LAW = Law(stiffness=1000.0, damping=10.0, friction=0.5, stick_stiffness=400.0, stick_damping=2.0)


@pytest.mark.parametrize("kind", BODIES)
def test_normals_are_the_gradient_of_the_gap_and_turning_that_of_the_normals(kind):
    body, x, h = BODIES[kind], np.random.default_rng(1).normal(size=(7, 3)), 1e-6
    steps = np.eye(3) * h
    slope = np.stack([(body.gap(x + e) - body.gap(x - e)) / (2 * h) for e in steps], axis=1)
    np.testing.assert_allclose(body.normals(x), slope, atol=1e-9)  # h^2 and round-off / h
    turned = np.stack([(body.normals(x + e) - body.normals(x - e)) / (2 * h) for e in steps], axis=2)
    np.testing.assert_allclose(body.turning(x), turned, atol=1e-8)
    y = x + np.random.default_rng(2).normal(size=x.shape)
    mean = body.mean_normals(x, y)
    np.testing.assert_allclose(np.einsum("nc,nc->n", mean, y - x), body.gap(y) - body.gap(x), atol=1e-14)


def test_gaps_by_hand():
    assert GROUND.gap(np.array([[5.0, 3.0, 0.35]])) == pytest.approx([0.25])
    assert obstacle.sphere([0, 0, 1], 2.0).gap(np.array([[3.0, 0, 1 + 4.0]])) == pytest.approx([3.0])
    assert obstacle.drum([0, 0, 1], [0, 7.0, 0], 2.0).gap(np.array([[3.0, 9.0, 1 + 4.0]])) == pytest.approx([3.0])


def one(x0, x1, v, rate=0.0):
    """Motion of one point above GROUND."""
    x0, x1, v = (np.array([value], dtype=float) for value in (x0, x1, v))
    return Motion(x0, x1, -GROUND.gap(x0), -GROUND.gap(x1), v, rate)


@pytest.mark.parametrize(
    ("z0", "z1", "v", "pressure"),
    [
        (0.09, 0.07, -0.5, 1000 * 0.03 + 10 * 0.5),  # inside throughout: k d + c d'
        (0.09, 0.07, 0.5, 1000 * 0.03 - 10 * 0.5),  # the damper helps the point out
        (0.09, 0.097, 0.5, 0.0),  # 3 - 5 < 0: it does not pull
        (0.12, 0.07, -0.5, 1000 * 0.03 + 10 * 0.5 * 0.6),  # 0.03 of 0.05 m were inside
        (0.12, 0.11, -0.5, 0.0),  # outside
    ],
)
def test_pressure_of_one_point_by_hand(z0, z1, v, pressure):
    found = pressure_at_end(LAW, GROUND, one([0, 0, z0], [0, 0, z1], [0, 0, v]))
    assert found.p == pytest.approx([pressure])
    np.testing.assert_array_equal(found.n, [[0, 0, 1]])


@pytest.mark.parametrize(
    ("z0", "z1", "pressure"),
    [
        (0.09, 0.07, 1000 * 0.02 + 10 * 0.02 / 0.1),  # mean depth 0.02, 0.02 m deeper in 0.1 s
        (0.12, 0.07, 1000 * 0.03**2 / 2 / 0.05 + 10 * 0.03 / 0.1),  # U / 0.05 m
        (0.07, 0.12, 1000 * 0.03**2 / 2 / 0.05 - 10 * 0.03 / 0.1),
        (0.12, 0.11, 0.0),
    ],
)
def test_mean_pressure_of_one_point_by_hand(z0, z1, pressure):
    found = pressure_in_mean(LAW, GROUND, one([0, 0, z0], [0, 0, z1], [0, 0, (z1 - z0) / 0.1], 10.0))
    assert found.p == pytest.approx([pressure])


def test_friction_of_one_point_by_hand():
    """mu p = 10 Pa: 0.01 m at 0.5 m/s stick with 400 x 0.01 + 2 x 0.5 = 5; 0.04 m more would be 21 and slide."""
    motion = one([0, 0, 0.08], [0.01, 0, 0.08], [0.5, 0, 0])
    normal = pressure_at_end(LAW, GROUND, motion)
    stuck = friction(LAW, GROUND, motion, normal.p, np.zeros((1, 3)))
    np.testing.assert_allclose([stuck.t[0], stuck.slip[0]], [[-5.0, 0, 0], [0.01, 0, 0]], atol=1e-14)
    slid = friction(LAW, GROUND, motion, normal.p, np.array([[0.04, 0, 0]]))
    np.testing.assert_allclose([slid.t[0], slid.slip[0]], [[-10.0, 0, 0], [10 / 400, 0, 0]], atol=1e-14)


def test_a_spring_that_its_damper_lets_slide_early_does_not_stretch():
    """0.01 m in 1 ms: the damper alone, 2 x 10 = 20, is beyond mu p = 10 Pa, the spring's 4 Pa are not."""
    motion = one([0, 0, 0.08], [0.01, 0, 0.08], [10.0, 0, 0])
    normal = pressure_at_end(LAW, GROUND, motion)
    slid = friction(LAW, GROUND, motion, normal.p, np.zeros((1, 3)))
    np.testing.assert_allclose([slid.t[0], slid.slip[0]], [[-10.0, 0, 0], [0.01, 0, 0]], atol=1e-14)


def test_part_of_a_step_inside_is_continuous_where_a_point_enters_and_where_a_step_begins():
    theta, _ = part_inside(np.array([-0.1, -0.1, -1e-12, 0.0]), np.array([1e-12, 0.1, 0.1, 0.1]))
    np.testing.assert_allclose(theta, [0.0, 0.5, 1.0, 1.0], atol=1e-10)


MADE = {}


def faced(make_body, kind="grooved", side=BOTTOM, counts=(4, 4), bands=None):
    """A free plate of `conftest.PLATES`, or one with these bands on its flat lines, and one of its faces."""
    own = PLATES[kind][1] if bands is None else bands
    key = make_body.args, kind, bands
    if key not in MADE:
        plate = make_body(kind, bands=own)
        MADE[key] = system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), THICKNESS)
    acting = MADE[key]
    return acting, face(acting.body.mesh, own, THICKNESS, counts, side, acting.assembly)


@pytest.mark.parametrize(("side", "depth"), [(BOTTOM, 0.03), (TOP, 0.015)])
def test_points_lie_on_the_true_face_and_share_its_area(make_body, side, depth):
    acting, own = faced(make_body, side=side)
    assert own.share.sum() == pytest.approx(1.2 * 0.6, rel=1e-12)  # flat: the walls have no points
    x, y, z = own.points.T
    groove = (0.2 < y) & (y < 0.3) if side == BOTTOM else (0.35 < x) & (x < 0.5)
    np.testing.assert_allclose(z, side * (0.025 - depth * groove), atol=1e-15)
    np.testing.assert_allclose(own.positions(acting.body.mesh.vectors.ravel()), own.points, atol=1e-14)


def test_area_of_a_round_floor_is_the_length_of_its_arc(make_body):
    """A groove 0.02 m wide whose floor is an arc of 90 degrees: radius 0.01 sqrt 2, length pi r / 2."""
    root = np.sqrt(0.5)
    arc = Curve(2, [0, 0, 0, 1, 1, 1], np.array([[0.1, 0.0], [0.11, 0.01], [0.12, 0.0]]), [1, root, 1])
    _, own = faced(make_body, counts=(4, 8), bands=(Band(BOTTOM, GROOVE, 0, (0.1, 0.12), arc),))
    inside = (own.points[:, 1] > 0.1) & (own.points[:, 1] < 0.12)
    length = np.pi / 2 * 0.01 * np.sqrt(2)
    assert own.share[inside].sum() == pytest.approx(1.2 * length, rel=1e-6)  # slopes by differences


def test_points_in_a_round_dimple_lie_on_its_floor(make_body):
    """An outline that cuts elements where it likes: radius 0.1 m, 0.01 m deep; the walls have no points."""
    root, (x, y), r = np.sqrt(0.5), (0.55, 0.3), 0.1
    ring = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    points = np.array([[x + r * a, y + r * b] for a, b in ring])
    circle = Curve(2, [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], points, [1, root] * 4 + [1])
    _, own = faced(make_body, bands=(Outlined(BOTTOM, GROOVE, circle, 0.01),))
    floor = np.hypot(own.points[:, 0] - x, own.points[:, 1] - y) < r
    np.testing.assert_allclose(own.points[:, 2], np.where(floor, -0.015, -0.025), atol=1e-15)
    assert own.share[floor].sum() == pytest.approx(np.pi * r**2, rel=1e-6)  # a curve cut by 4 points in each part
    assert own.share.sum() == pytest.approx(1.2 * 0.6, rel=1e-12)


@pytest.mark.parametrize("angle", [1e-7, 1e-5])
def test_walls_beside_a_point_have_no_part_in_its_area(make_body, angle):
    """A flat floor within an outline turned by a hair, whose walls pass points at less than any difference, is as large
    as what it is cut from."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = np.array([[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.3, 0.1], [-0.3, -0.1]]) @ turn.T + [0.6, 0.3]
    square = Curve(1, [0, 0, 1, 2, 3, 4, 4], corners)
    _, own = faced(make_body, bands=(Outlined(BOTTOM, GROOVE, square, 0.02),))
    assert own.share.sum() == pytest.approx(1.2 * 0.6, rel=1e-12)


def test_a_leaning_floor_beside_its_walls_has_one_slope():
    """One grid over elements whose middle points lie on walls: their slope is that of the floor, 0.02 m over 0.3 m."""
    section = Curve(1, [0, 0, 1, 1], [[0.15, 0.01], [0.45, 0.03]])
    bands = [Band(BOTTOM, GROOVE, 0, (0.15, 0.45), section)]
    mesh = grid(np.linspace(0.0, 1.2, 3), np.linspace(0.0, 0.6, 3), None, FAMILY["enriched"])
    for cell in mesh.cells:
        profile = _profile(cell, bands, THICKNESS, (3, 3), BOTTOM, "global")
        y = profile.points[:, 1] + cell[1][0]
        inside = (y > 0.15 - 1e-12) & (y < 0.45 + 1e-12)
        np.testing.assert_allclose(profile.slopes, [0.0 * y, np.where(inside, 0.02 / 0.3, 0.0)], atol=1e-8)


def test_area_of_the_faces_of_a_quarter_cylinder(make_body):
    """Radius 1 m at the middle, 0.5 m long: the two faces have 0.975 and 1.025 of its area."""
    areas = sorted(faced(make_body, "curved", side)[1].share.sum() for side in (BOTTOM, TOP))
    middle = np.pi / 4
    # the director is linear between the normals of nodes 30 degrees apart
    np.testing.assert_allclose(areas, [0.975 * middle, 1.025 * middle], rtol=2e-3)


def pressed(acting, own, kind, law, mean, moved):
    """A step of a deformed, moving plate that is partly inside a body, and the components it ends with."""
    rng, vectors = np.random.default_rng(3), acting.body.mesh.vectors
    q0 = (vectors + 0.01 * rng.normal(size=vectors.shape)).ravel()
    q1 = q0 + moved * rng.normal(size=q0.size)
    heights = np.sort(BODIES[kind].gap(own.positions(q0)))
    shift = -heights[len(heights) // 2]  # half of the points are inside
    body = BODIES[kind]
    up = np.tile(body.normals(np.zeros((1, 3)) + own.points.mean(axis=0))[0], len(vectors)).reshape(-1, 3)
    up[acting.body.mesh.kinds != "r"] = 0.0
    q0, q1 = q0 + shift * up.ravel(), q1 + shift * up.ravel()
    contact = Contact((Pair(own, body, law, own.share),))
    touches = contact.untouched()
    touches[0].slip[:] = 1e-3 * rng.normal(size=(len(own.share), 3))
    if mean:
        return contact.in_mean(q0, touches, 0.01), q1
    return contact.at_end(q0, touches, -200 * q0 + 0.1 * rng.normal(size=q0.size), 200.0, 0.01), q1


@pytest.mark.parametrize("element", ["conforming", "enriched"], indirect=True)
@pytest.mark.parametrize("mean", [False, True])
@pytest.mark.parametrize("mu", [0.0, 0.05, 5.0])
@pytest.mark.parametrize("kind", BODIES)
def test_tangent_is_the_differenced_force(make_body, kind, mu, mean):
    """Opening, closing, sticking and sliding points; the derivative by each unknown, central differences."""
    acting, own = faced(make_body)
    step, q = pressed(acting, own, kind, LAW._replace(friction=mu), mean, 2e-4)
    lower, upper = step.tangent_contact(q)
    K = acting.assembly.pattern.full(lower, upper).toarray()
    h, rng = 1e-8, np.random.default_rng(5)
    for _ in range(5):
        way = rng.normal(size=q.size)
        there, back = (step.force_contact(q + sign * h * way)[acting.assembly.free] for sign in (1, -1))
        found = -(there - back) / (2 * h)
        scale = np.abs(K @ way).max()
        # round-off of the force over h; a point within h of a bend is off by a part of its stiffness
        np.testing.assert_allclose(K @ way[acting.assembly.free], found, atol=2e-6 * scale)


@pytest.mark.parametrize("kind", BODIES)
def test_points_out_of_reach_would_not_have_touched(make_body, kind):
    """Beside all points, on ways of any length taken one after another: the same points touch, with the same force.

    Where a way is long enough to bring every point to the body, all are looked at.
    """
    acting, own = faced(make_body)
    some = pressed(acting, own, kind, LAW, False, 0.0)[0].meetings[0]
    every = replace(
        some, _reach=Reach(np.inf, own.some(np.arange(len(own.points))), *map(own.positions, (some.q0, some.base)))
    )
    rng, counts = np.random.default_rng(7), []
    for moved in (0.0, 1e-4, 1e-3, 1e-2, 1e-3, 0.1):
        q = some.q0 + moved * rng.normal(size=some.q0.size)
        found, wanted = some.answer(q), every.answer(q)
        np.testing.assert_array_equal(found.near, wanted.near)
        np.testing.assert_allclose(found.force_all, wanted.force_all, rtol=1e-13, atol=1e-12)
        counts.append(len(some.reach(q).some.points))
    assert counts == sorted(counts) and counts[0] < len(own.points)
    assert len(some.reach(some.q0 + 10.0).some.points) == len(own.points)


def test_no_point_moves_beyond_the_farthest(make_body):
    """The bound holds for any change of the components, and for a shift of the whole it is at most four times it."""
    acting, own = faced(make_body)
    rng, n = np.random.default_rng(8), 3 * len(acting.body.mesh.vectors)
    for change in rng.normal(size=(20, n)):
        assert np.linalg.norm(own.positions(change), axis=1).max() <= own.farthest(change)
    shift = np.where((acting.body.mesh.kinds == "r")[:, None], [0.0, 0.0, 1.0], 0.0).ravel()
    assert 1.0 <= own.farthest(shift) <= 4.0


@pytest.mark.parametrize("kind", BODIES)
def test_mean_force_does_the_work_of_the_springs(make_body, kind):
    """Undamped, without friction: force times step = what the springs gave, between any two states."""
    acting, own = faced(make_body)
    law = Law(1000.0, 0.0, 0.0, 1.0, 1.0)
    step, q1 = pressed(acting, own, kind, law, True, 0.02)
    x0 = own.positions(step.meetings[0].q0)
    stored = [law.stiffness / 2 * own.share @ np.maximum(-BODIES[kind].gap(x), 0) ** 2
              for x in (x0, own.positions(q1))]  # fmt: skip
    (answer,) = step.answers(q1)
    work = np.einsum("nc,nc->", answer.force, (own.positions(q1) - x0)[answer.near])
    assert work == pytest.approx(stored[0] - stored[1], abs=1e-12 * max(stored))
    touch = step.touched(q1)[0]
    assert touch.dissipated == pytest.approx(0.0, abs=1e-12 * max(stored))
    assert touch.stored == pytest.approx(stored[1])


@pytest.mark.parametrize("mean", [False, True])
def test_damper_never_pulls_and_friction_stays_in_its_cone(make_body, mean):
    acting, own = faced(make_body)
    step, q1 = pressed(acting, own, "sphere", LAW, mean, 0.003)
    (answer,) = step.answers(q1)
    assert np.all(answer.normal.p >= 0)
    assert np.all(np.linalg.norm(answer.friction.t, axis=1) <= LAW.friction * answer.normal.p * (1 + 1e-12))


@pytest.mark.parametrize("seed", range(4))
def test_what_damper_and_friction_take_in_a_step_of_any_length_is_never_negative(make_body, seed):
    """From no slip: the spring of stick then has nothing to give back."""
    acting, own = faced(make_body)
    step, q1 = pressed(acting, own, "sphere", LAW, True, 0.003 * (seed + 1))
    step.meetings[0].touch.slip[:] = 0.0
    assert step.touched(q1)[0].dissipated >= 0


def test_elements_that_see_the_same_share_their_profile_and_keep_their_places():
    """Four columns of elements with the same leaning groove each, but the last, whose groove is not as far in: every
    point lies on the true face, and its share is what each element on its own gives."""
    section = Curve(1, [0, 0, 1, 2, 3, 3], [[0.05, 0.0], [0.08, 0.02], [0.12, 0.02], [0.15, 0.0]])
    places = (0.0, 0.3, 0.6, 0.88)
    bands = [Band(TOP, GROOVE, 1, (at + 0.05, at + 0.15), moved(section, at)) for at in places]
    lines = np.linspace(0.0, 1.2, 5), np.array([0.0, 0.3, 0.6])
    mesh = grid(*lines, None, FAMILY["enriched"])
    plate = body(mesh, bands, THICKNESS, from_engineering(2.0e6, 0.3), 1.0, (5, 5, 3))
    acting = system(plate, np.zeros(mesh.vectors.size, dtype=bool), (), THICKNESS)
    found = face(mesh, bands, THICKNESS, (4, 3), TOP, acting.assembly)
    z_max = thickness_range(bands, THICKNESS, *found.points[:, :2].T)[1]
    np.testing.assert_allclose(found.points[:, 2], z_max, atol=1e-15)
    low = np.array([[x[0], y[0]] for x, y in mesh.cells])[found.element]
    assert np.all((found.points[:, :2] > low) & (found.points[:, :2] < low + 0.3))
    for e in range(len(mesh.cells)):
        alone = _share(mesh, e, _profile(mesh.cells[e], bands, THICKNESS, (4, 3), TOP, "subdomain"))
        np.testing.assert_allclose(found.share[found.element == e], alone, rtol=1e-9)
    assert found.share.sum() == pytest.approx(0.6 * (1.2 - 8 * 0.03 + 8 * np.hypot(0.03, 0.02)), rel=1e-9)


def moved(section, distance):
    """A section moved across its band."""
    return Curve(section.degree, section.knots, section.control_points + np.array([distance, 0.0]), section.weights)
