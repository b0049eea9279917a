"""Layer functions beside groove edges, the indicator that chooses them, and grid lines on the edges."""

import itertools

import numpy as np
import pytest

from ancf.element import PointElements
from ancf.functional import interpolation, mean_over_region
from ancf.layer import KIND, layer_vectors, only, with_layers
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.refine import chosen, fitted
from ancf.run import estimate, solve
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, PROTRUSION, TOP, Band
from ancf.supports import clamp
from ancf.system import body, system
from ancf.unpack import build
from compare.scene import AncfLevel, load

from . import conftest
from .conftest import THICKNESS

FLOOR, BELOW = -0.005, Band(BOTTOM, GROOVE, 0, (0.25, 0.6), 0.02)
LINES = (np.array([0.0, 0.5, 1.2]), np.array([0.0, 0.2, 0.35, 0.6]))
ON_LINES = (Band(BOTTOM, GROOVE, 0, (0.2, 0.35), 0.03), Band(TOP, PROTRUSION, 1, (0.5, 1.2), 0.02))
PLATES = {**conftest.PLATES, "grooved on lines": (LINES, ON_LINES, None)}
LEVEL = AncfLevel(mesh=(4, 1), element="enriched", fit=(0.8,), enrich=0.95, time_step=0.5)
FORCE = 2.0e6 * THICKNESS  # N: modulus times the area of a strip one metre wide


def layered(element="enriched", kind="grooved", *, some=None, nu=0.3, points=(5, 5, 3), pointwise=False):
    """A body of PLATES with all its layer vectors, or every `some`-th."""
    lines, bands, surface = PLATES[kind]
    mesh = grid(*lines, surface, FAMILY[element])
    mesh = with_layers(mesh, layer_vectors(mesh, bands, THICKNESS)[::some], bands, THICKNESS)
    return body(mesh, bands, THICKNESS, from_engineering(2.0e6, nu), 2000.0, points, pointwise=pointwise)


def acting(plate, held=None):
    held = np.zeros(plate.mesh.vectors.size, dtype=bool) if held is None else held
    return system(plate, held, (), THICKNESS)


def dense(free, q):
    return free.assembly.pattern.full(free.tangent(q.ravel())).toarray()


def straight(mesh, bands):
    """The layer vectors that share the director's functions whole."""
    return [vector for vector in layer_vectors(mesh, bands, THICKNESS) if not vector.through.decay]


def at_nodes(mesh):
    """Whether a vector belongs to a node (v,), not to an edge."""
    return np.isin(mesh.parameters[:, 0], mesh.x_lines) & np.isin(mesh.parameters[:, 1], mesh.y_lines)


GROOVED = [kind for kind in PLATES if "grooved" in kind]


@pytest.mark.parametrize("kind", GROOVED)
def test_layers_change_no_position_of_the_reference(element, kind):
    """Their reference vectors are zero: nothing moves, volume and mass are those of the plain mesh."""
    plate, lines = layered(element, kind, pointwise=True), PLATES[kind]
    plain = body(
        grid(*lines[0], lines[2], FAMILY[element]), lines[1], THICKNESS, from_engineering(2e6, 0.3), 2e3, (7, 7, 3)
    )
    assert np.all(plate.mesh.vectors[plate.mesh.kinds == KIND] == 0)
    assert plate.volume == pytest.approx(plain.volume, rel=1e-13)
    assert plate.total_mass == pytest.approx(plain.total_mass, rel=1e-13)


@pytest.mark.parametrize("kind", GROOVED)
def test_rigid_motion_costs_nothing_and_six_modes_have_no_energy(element, kind):
    """Six zero eigenvalues, the others positive: the layers add no mode without energy."""
    plate = layered(element, kind, pointwise=True)
    free, rest = acting(plate), plate.mesh.vectors
    assert np.abs(free.force_internal(rest.ravel())).max() < 1e-12 * FORCE
    K = dense(free, rest)
    scale = np.sqrt(np.diag(K))
    values = np.linalg.eigvalsh(K / scale / scale[:, None])
    assert np.abs(values[:6]).max() < 1e-12 < 1e-7 < values[6]


@pytest.mark.parametrize("kind", GROOVED)
def test_tangent_is_the_derivative_of_force(element, kind, deformed):
    """The force is a cubic of q: differences over four points leave round-off alone."""
    plate, h = layered(element, kind, some=3), 1e-3
    q, free = deformed(plate), acting(plate)
    direction = np.random.default_rng(6).standard_normal(q.size)
    ahead, behind, far, back = (free.force_internal(q.ravel() + s * direction) for s in (h, -h, 2 * h, -2 * h))
    found = dense(free, q) @ direction
    differenced = (8 * (ahead - behind) - (far - back)) / (12 * h)
    np.testing.assert_allclose(found, differenced, rtol=0, atol=1e-10 * np.abs(found).max())


@pytest.mark.parametrize("kind", GROOVED)
def test_quadratic_form_equals_the_sum_over_points(element, kind, deformed):
    """1e-12 of the largest entry: both sum the same numbers in another order."""
    fast, plain = layered(element, kind, some=2), layered(element, kind, some=2, pointwise=True)
    assert all(isinstance(group, PointElements) for group in plain.elements.groups)
    q = deformed(fast)
    one, other = acting(fast), acting(plain)
    f = other.force_internal(q.ravel())
    np.testing.assert_allclose(one.force_internal(q.ravel()), f, atol=1e-12 * np.abs(f).max())
    K = dense(other, q)
    np.testing.assert_allclose(dense(one, q), K, atol=1e-12 * np.abs(K).max())
    still = np.zeros(q.size)
    assert one.energies(q.ravel(), still) == pytest.approx(other.energies(q.ravel(), still), rel=1e-12)


def test_elements_without_layers_stay_as_they_are():
    """Only elements beside a chosen vector have more functions, and each only those that it needs."""
    lines, bands, _ = PLATES["grooved"]
    mesh = grid(*lines, None, FAMILY["enriched"])
    corner = next(v for v in layer_vectors(mesh, bands, THICKNESS) if np.all(mesh.parameters[v.v] == 0))
    special = with_layers(mesh, [corner], bands, THICKNESS).special
    assert {e: len(own.vectors) for e, own in special.items()} == {mesh.locate(0.0, 0.0): 25}


@pytest.mark.parametrize("face", [BOTTOM, TOP])
@pytest.mark.parametrize("sign", [GROOVE, PROTRUSION])
def test_the_layer_beyond_the_floor_shears_on_its_own(face, sign):
    """u = (0, min(0, z - floor), 0) is represented exactly, and continuous from element to element."""
    band = Band(face, sign, 0, (0.2, 0.4), 0.02)
    mesh = grid(np.array([0.0, 0.5, 1.2]), np.array([0.0, 0.2, 0.4, 0.6]), None, FAMILY["enriched"])
    mesh = with_layers(mesh, straight(mesh, (band,)), (band,), THICKNESS)
    floor, reach = (face * 0.005, 0.025) if sign == GROOVE else (face * 0.025, 0.045)
    vectors = mesh.vectors.copy()
    vectors[(mesh.kinds == KIND) & at_nodes(mesh)] = [0.0, 1.0, 0.0]
    inside = (0.1, 0.5) if sign == GROOVE else (0.3, 0.3)
    for y, z in itertools.product(inside, np.linspace(floor, face * reach, 4)):
        found = interpolation(mesh, np.array([mesh.locate(0.3, y)]), np.array([[0.3, y, z]])) @ (vectors - mesh.vectors)
        np.testing.assert_allclose(found[0], [0, z - floor, 0], atol=1e-14)


@pytest.mark.parametrize(("axis", "edges"), [(1, (0.2, 0.4)), (0, (0.5, 0.7))])
def test_beside_a_wall_a_layer_fades_out(axis, edges):
    """u = e(d) T(z), e of Reissner's layer, on both sides of a groove whose edges are grid lines; none within it."""
    band = Band(BOTTOM, GROOVE, 1 - axis, edges, 0.02)
    lines = [np.array([0.0, 0.5, 0.7, 1.2]), np.array([0.0, 0.2, 0.4, 0.6])]
    mesh = grid(*lines, None, FAMILY["enriched"])
    fading = [v for v in layer_vectors(mesh, (band,), THICKNESS) if v.through.decay]
    mesh = with_layers(mesh, fading, (band,), THICKNESS)
    vectors = np.zeros_like(mesh.vectors)
    vectors[(mesh.kinds == KIND) & at_nodes(mesh)] = [1.0, 0.0, 0.0]
    decay, z = np.sqrt(10) / THICKNESS, -0.02
    for d, outward in itertools.product((0.0, 0.01, 0.03), (0, 1)):
        at = np.array([0.3, 0.3, z])
        at[axis] = edges[outward] + (2 * outward - 1) * d
        beside = [x for x in lines[axis] if (x - edges[outward]) * (2 * outward - 1) > 1e-9]
        a = np.abs(np.array(beside) - edges[outward]).min()
        e = mesh.locate(*(at[:2] + np.eye(2)[axis] * (2 * outward - 1) * 1e-6))
        found = interpolation(mesh, np.array([e]), at[None]) @ vectors
        wanted = np.sinh(decay * (a - d)) / np.sinh(decay * a) * (z - FLOOR)
        assert found[0] == pytest.approx([wanted, 0, 0], abs=1e-14)
    inside = mesh.locate(*np.where(np.arange(2) == axis, np.mean(edges), 0.3))
    assert inside not in mesh.special


def test_a_narrow_rib_has_no_layers_that_fade_out():
    """Between walls nearer than three decay lengths e is nearly the director's own function."""
    bands = Band(BOTTOM, GROOVE, 0, (0.0, 0.29), 0.02), Band(BOTTOM, GROOVE, 0, (0.31, 0.6), 0.02)
    mesh = grid(np.array([0.0, 1.0]), np.array([0.0, 0.29, 0.31, 0.6]), None, FAMILY["enriched"])
    assert not any(vector.through.decay for vector in layer_vectors(mesh, bands, THICKNESS))


def test_layers_that_fade_out_are_integrated_however_wide_their_elements():
    """Of elements four times as wide as the layer reaches, 7x7x3 points give the stiffness to 1.3e-5."""
    band = Band(BOTTOM, GROOVE, 0, (0.4, 0.6), 0.02)
    mesh = grid(np.array([0.0, 0.5]), np.array([0.0, 0.4, 0.6, 1.0]), None, FAMILY["enriched"])
    mesh = with_layers(mesh, layer_vectors(mesh, (band,), THICKNESS), (band,), THICKNESS)
    few, many = (
        dense(acting(body(mesh, (band,), THICKNESS, from_engineering(2e6, 0.3), 1.0, (n, n, 3))), mesh.vectors)
        for n in (7, 12)
    )
    scale = np.sqrt(np.diag(many))
    np.testing.assert_allclose(few / scale / scale[:, None], many / scale / scale[:, None], atol=2e-5)


@pytest.mark.parametrize("kind", ["grooved", "grooved on lines"])
def test_fields_are_continuous_across_elements(kind, deformed):
    """Points on the sides that two elements share, in the material of both, seen from either."""
    plate = layered(kind=kind, some=2)
    mesh, q = plate.mesh, deformed(plate)
    for e, other in itertools.combinations(range(len(mesh.cells)), 2):
        (x0, x1), (y0, y1) = (
            (max(a[0], b[0]), min(a[1], b[1])) for a, b in zip(mesh.cells[e], mesh.cells[other], strict=True)
        )
        if x1 < x0 or y1 < y0:
            continue
        s = np.linspace(0, 1, 4)
        points = np.stack(np.meshgrid(x0 + s * (x1 - x0), y0 + s * (y1 - y0), [0.006, 0.009], indexing="ij"), -1)
        points = points.reshape(-1, 3)
        one, two = (interpolation(mesh, np.full(len(points), own), points) @ q for own in (e, other))
        np.testing.assert_allclose(one, two, atol=1e-14)


def test_loads_see_the_layers():
    """The mean over a region sums each function's own integral: here that of T over the rib's lower layer."""
    mesh = grid(np.array([0.0, 1.0]), np.array([0.0, 0.25, 0.6]), None, FAMILY["enriched"])
    mesh = with_layers(mesh, straight(mesh, (BELOW,)), (BELOW,), THICKNESS)
    row = mean_over_region(mesh, (BELOW,), THICKNESS, ((0.0, 1.0), (0.0, 0.25)))
    mean = -((THICKNESS / 2 + FLOOR) ** 2) / 2 / THICKNESS
    corners = (mesh.kinds == KIND) & at_nodes(mesh) & (mesh.parameters[:, 1] < 0.3)
    assert row[corners].sum() == pytest.approx(mean, rel=1e-12)  # the four corners' functions sum to T


def test_fitted_lines_hold_every_edge_and_stay_apart():
    rng = np.random.default_rng(0)
    for _ in range(50):
        edges = np.sort(rng.uniform(-0.1, 1.1, rng.integers(0, 9)))
        lines = fitted((0.0, 1.0), int(rng.integers(1, 9)), edges.tolist(), [0.02, 0.04], 1e-3)
        inside = edges[(edges > 1e-3) & (edges < 1 - 1e-3)]
        assert lines[0] == 0 and lines[-1] == 1 and np.all(np.diff(lines) > 0.999e-3)
        assert all(np.abs(lines - edge).min() <= 1e-3 for edge in inside)
    np.testing.assert_array_equal(fitted((0.0, 2.0), 4, [], [0.04]), np.linspace(0, 2, 5))


def table_groove(**changes):
    return load("cantilever_patch").override({"analysis.kind": "static", "analysis.every": 1.0, **changes})


def test_the_indicator_chooses_the_groove_edges():
    """Of 100 nodes and edges beside the floor fewer than half are chosen, none of them in the middle of a rib."""
    model = build(table_groove(), LEVEL)
    mesh = model.mesh
    y = mesh.parameters[mesh.kinds == KIND, 1]
    distance = np.abs(y[:, None] - [0.2, 0.3, 0.7, 0.8]).min(axis=1)
    assert 10 < len(y) < 50
    assert np.mean(distance < 1e-9) > 0.5 and np.mean(distance < 0.041) > 0.8


def test_a_plain_plate_has_nothing_to_choose():
    plain = table_groove(grooves=[])
    base = LEVEL.model_copy(update={"enrich": None})
    assert build(plain, LEVEL).system.unknowns == build(plain, base).system.unknowns


@pytest.mark.slow
def test_the_choice_beats_uniform_layers_at_equal_unknowns():
    """A third of the vectors, the best ones, give nearly all that all give; as many taken evenly give less."""
    scene, level = table_groove(), LEVEL.model_copy(update={"enrich": 0.9})
    bands, base = build(scene, level).bands, build(scene, level.model_copy(update={"enrich": None}))
    every = with_layers(base.mesh, layer_vectors(base.mesh, bands, THICKNESS), bands, THICKNESS)
    layers = np.flatnonzero(every.kinds == KIND)
    best = build(scene, level).mesh
    count = int((best.kinds == KIND).sum())
    even = np.zeros(len(every.kinds), dtype=bool)
    even[layers[np.linspace(0, len(layers) - 1, count).round().astype(int)]] = True
    plain = _flexibility(base.mesh, bands)
    evenly, chosen_well, all_of_them = (_flexibility(mesh, bands) - plain for mesh in (only(every, even), best, every))
    assert count < 0.4 * len(layers)
    assert chosen_well > 0.85 * all_of_them and evenly < 0.6 * chosen_well


def _flexibility(mesh, bands):
    """Linear deflection under the corner load of the table's plate (m)."""
    plate = body(mesh, bands, THICKNESS, from_engineering(2.0e6, 0.0), 2000.0, (7, 7, 3))
    free = acting(plate, clamp(mesh, "x0", "tangential"))
    row = mean_over_region(mesh, bands, THICKNESS, ((0.9, 1.0), (0.9, 1.0)))
    F = np.outer(row, [0, 0, 50.0]).ravel()[free.assembly.free]
    return float(F @ np.linalg.solve(dense(free, mesh.vectors), F)) / 50.0


def test_a_larger_share_chooses_more():
    scene = table_groove()
    counts = [
        int((build(scene, LEVEL.model_copy(update={"enrich": s})).mesh.kinds == KIND).sum()) for s in (0.3, 0.8, 0.99)
    ]
    assert 0 < counts[0] < counts[1] < counts[2]


@pytest.mark.parametrize(("mesh", "keeps_points"), [((3, 1), True), ((20, 1), False)])
def test_a_trial_has_tensors_where_enough_elements_share_them(mesh, keeps_points, monkeypatch):
    """Either way the same vectors are chosen."""
    scene, level, trials = table_groove(), LEVEL.model_copy(update={"mesh": mesh, "points": (5, 5, 3)}), []

    def followed(trial, *more):
        trials.append(trial)
        return chosen(trial, *more)

    def places():
        mesh = build(scene, level).mesh
        return mesh.parameters[mesh.kinds == KIND]

    monkeypatch.setattr("ancf.unpack.chosen", followed)
    found = places()
    assert len(found) > 0
    groups = trials[0].body.elements.groups
    assert all(isinstance(group, PointElements) == keeps_points for group in groups)
    monkeypatch.setattr("ancf.system.REPAID", 0 if keeps_points else np.inf)
    assert np.array_equal(places(), found)


def test_estimate_counts_the_unknowns_of_the_solve():
    scene = table_groove()
    told, result = estimate(scene, LEVEL), solve(scene, LEVEL)
    assert result.status == "ok" and told["unknowns"] == result.unknowns
    assert any("layer" in line for line in told["modelled"])


def test_mean_stress_does_the_work_of_the_strain_energy_where_elements_carry_layers(deformed):
    """What the energy-momentum scheme rests on, on groups of elements with unequally many functions."""
    plate = layered("enriched", some=7)
    assert len(plate.elements.groups) > 1
    free = acting(plate)
    q0, q1 = (deformed(plate, seed).ravel() for seed in (0, 1))
    work = free.force_internal((q0 + q1) / 2, ((1.0, (q1 - q0) / 2),)) @ (q1 - q0)
    U0, U1 = (free.energies(q, 0 * q)[1] for q in (q0, q1))
    assert work == pytest.approx(U1 - U0, abs=1e-12 * (U0 + U1))
