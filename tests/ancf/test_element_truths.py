"""Truths of the elements: plain and grooved, flat and curved, pre-integrated and point by point."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from ancf.assembly import assembly
from ancf.element import PointElements, integrand
from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.packing import PORTION, SPAN, packing
from ancf.quadratic_form import QuadraticElements
from ancf.quadrature import gauss, onto_cell, tensor
from ancf.shape import FAMILY
from ancf.split_form import SplitFormElements
from ancf.subdomain import BOTTOM, GROOVE, Band
from ancf.system import body, expected_memory, form_bytes, system

FORCE = 2.0e6 * 0.05  # N per metre: Young's modulus times thickness, the size of forces at strain one


FEW_POINTS = {"conforming": (3, 3, 2), "acm": (3, 3, 2), "enriched": (4, 4, 3)}


def free_system(plate):
    return system(plate, np.zeros(plate.mesh.vectors.size, dtype=bool), (), 0.05)


def dense_tangent(plate, q):
    acting = free_system(plate)
    return acting.assembly.pattern.full(acting.tangent(q.ravel())).toarray()


def test_no_force_and_no_energy_at_rest(plate):
    Q = plate.mesh.vectors[plate.connectivity]
    assert np.abs(plate.elements.force(Q)).max() < 1e-13 * FORCE
    assert abs(plate.elements.energy(Q)) < 1e-20 * FORCE


@pytest.mark.parametrize("shift", [1.0, 1e3])
def test_rigid_motion_costs_no_energy(plate, shift):
    """Rotation by 2 rad and a shift; positions far away lose as many digits as the shift has.

    The energy is a square of strains of round-off: (1e-16 shift)^2 times the stiffness.
    """
    turn = Rotation.from_rotvec([0.9, -1.4, 1.1]).as_matrix()
    moved = plate.mesh.vectors @ turn.T
    moved[plate.mesh.kinds == "r"] += shift * np.array([1.0, -2.0, 0.5])
    Q = moved[plate.connectivity]
    assert abs(plate.elements.energy(Q)) < (1e-14 * shift) ** 2 * FORCE
    assert np.abs(plate.elements.force(Q)).max() < 1e-13 * shift * FORCE


def test_force_is_the_derivative_of_energy(plate, deformed):
    """Central difference with h = 1e-5: its error h^2 and the energy's round-off / h are both about 1e-9."""
    q, direction = deformed(plate), np.random.default_rng(5).standard_normal(plate.mesh.vectors.shape)
    h = 1e-5
    ahead, behind = (plate.elements.energy((q + s * direction)[plate.connectivity]) for s in (h, -h))
    slope = np.sum(plate.elements.force(q[plate.connectivity]) * direction[plate.connectivity])
    assert slope == pytest.approx((ahead - behind) / (2 * h), rel=1e-7)


def test_tangent_is_the_derivative_of_force(plate, deformed):
    """The force is a cubic of q: central differences err by h^2 times its third derivative."""
    q = deformed(plate)
    acting, K, h = free_system(plate), dense_tangent(plate, q), 1e-5
    direction = np.random.default_rng(6).standard_normal(q.size)
    ahead, behind = (acting.force_internal(q.ravel() + s * direction) for s in (h, -h))
    np.testing.assert_allclose(K @ direction, (ahead - behind) / (2 * h), atol=1e-8 * np.abs(K @ direction).max())


@pytest.mark.parametrize("kind", ["plain", "grooved", "curved", "curved, grooved"])
@pytest.mark.parametrize("points", [(4, 4, 3), (7, 7, 3)])
def test_quadratic_form_equals_the_sum_over_points(make_body, deformed, kind, points):
    """1e-12 of the largest entry: both sum the same numbers in another order."""
    fast, plain = make_body(kind, points=points), make_body(kind, points=points, pointwise=True)
    assert isinstance(plain.elements, PointElements)
    q = deformed(fast)
    Q = q[fast.connectivity]
    force = plain.elements.force(Q)
    np.testing.assert_allclose(fast.elements.force(Q), force, atol=1e-12 * np.abs(force).max())
    assert fast.elements.energy(Q) == pytest.approx(plain.elements.energy(Q), rel=1e-12)
    K, K_plain = dense_tangent(fast, q), dense_tangent(plain, q)
    np.testing.assert_allclose(K, K_plain, atol=1e-12 * np.abs(K_plain).max())


def test_points_condense_their_enhanced_strains_once(make_body, deformed, monkeypatch):
    """What is asked for a second time solves no system of equations, and is the same."""
    plate = make_body("grooved", points=(4, 4, 3), pointwise=True)
    Q = deformed(plate)[plate.connectivity]

    def found():
        return [*plate.elements.tangent(Q), plate.elements.force(Q), plate.elements.energy(Q)]

    def never(*arrays):
        raise AssertionError("solved anew")

    first = found()
    for name in ("solve", "inv", "cholesky", "lstsq"):
        monkeypatch.setattr(np.linalg, name, never)
    assert all(np.array_equal(*both) for both in zip(found(), first, strict=True))


def looped_stress(E, lame, shear):
    """S_pr = lambda E_ss delta_pr + 2 mu E_pr."""
    trace = E[0, 0] + E[1, 1] + E[2, 2]
    return np.array([[lame * trace * (p == r) + 2 * shear * E[p, r] for r in range(3)] for p in range(3)])


def looped_force(Q, part, lame, shear):
    """f_ia of one element by the textbook: loops over points, functions, components and enhanced strains."""
    f, strains, modes = np.zeros(Q.shape), [], part.M.shape[-1]
    H, b = np.zeros((modes, modes)), np.zeros(modes)
    for G_q, M_q, dV in zip(part.G, part.M, part.volume, strict=True):
        F = [[sum(Q[i][a] * G_q[i][p] for i in range(len(Q))) for p in range(3)] for a in range(3)]
        E = [[(sum(F[a][p] * F[a][r] for a in range(3)) - (p == r)) / 2 for r in range(3)] for p in range(3)]
        strains.append((np.array(F), np.array(E)))
        for k in range(modes):
            S_k = looped_stress(M_q[..., k], lame, shear)
            b[k] += np.sum(S_k * strains[-1][1]) * dV
            H[k] += [np.sum(S_k * M_q[..., n]) * dV for n in range(modes)]
    alpha = -np.linalg.solve(H, b)
    for (F, E), G_q, M_q, dV in zip(strains, part.G, part.M, part.volume, strict=True):
        S = looped_stress(E + M_q @ alpha, lame, shear)
        for i, a, p, r in itertools.product(range(len(Q)), range(3), range(3), range(3)):
            f[i, a] += F[a, p] * S[p, r] * G_q[i][r] * dV
    return f


@pytest.mark.parametrize("kind", ["grooved", "curved, grooved"])
def test_force_equals_plain_loops(make_body, deformed, kind):
    """One element, 4 x 4 x 3 points per subdomain, summed as printed in any textbook."""
    plate = make_body(kind, points=(4, 4, 3), pointwise=True)
    q = deformed(plate)
    part, Q, material = plate.elements.parts[1], q[plate.connectivity[1]], plate.elements.material
    looped = looped_force(Q, part, material.lame, material.shear)
    force = plate.elements.force(q[plate.connectivity])[1]
    np.testing.assert_allclose(force, looped, atol=1e-13 * np.abs(looped).max())


@pytest.mark.parametrize("kind", ["plain", "grooved"])
@pytest.mark.parametrize("lines", [(np.array([0.0, 1.2]), np.array([0.0, 0.6])), None])
@pytest.mark.parametrize("rule", ["few points", "exact"])
def test_exactly_six_modes_without_energy(make_body, element, kind, lines, rule):
    """Gradients measured in lengths, so that the eigenvalues compare; six rigid modes, and no spurious one."""
    plate = make_body(kind, lines=lines, points=(7, 7, 3) if rule == "exact" else FEW_POINTS[element])
    acting = free_system(plate)
    K = dense_tangent(plate, plate.mesh.vectors) / np.outer(acting.lengths, acting.lengths)
    eigenvalues = np.linalg.eigvalsh(K) / np.abs(K).max()
    np.testing.assert_allclose(eigenvalues[:6], 0, atol=1e-13)
    assert eigenvalues[6] > 1e-8


@pytest.mark.parametrize("bands", [(), (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 0.03),)])
@pytest.mark.parametrize("rule", ["few points", "exact"])
@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_patch_of_unequal_elements_under_constant_stress(make_body, element, bands, rule, nu):
    """Uniaxial stress along x leaves faces, and walls of grooves along x, free: no force on inner nodes.

    The strain across is - nu times that along x, Green's (s^2 - 1)/2.
    """
    points = (7, 7, 3) if rule == "exact" else FEW_POINTS[element]
    plate = make_body(bands=bands, nu=nu, points=points, lines=([0, 0.3, 0.7, 1.2], [0, 0.25, 0.35, 0.6]))
    across = np.sqrt(1 - nu * (1.2**2 - 1))
    stretched = plate.mesh.vectors * [1.2, across, across] @ Rotation.from_rotvec([0.3, 0.8, -0.2]).as_matrix().T
    force = free_system(plate).force_internal(stretched.ravel()).reshape(-1, 3)
    x, y = plate.mesh.parameters.T
    inner = (x > 0) & (x < 1.2) & (y > 0) & (y < 0.6)
    assert inner.sum() == (4 * 5 + 12 if element == "enriched" else 4 * 4)
    assert np.abs(force[inner]).max() < 1e-14 * np.abs(force).max() + 1e-13 * FORCE


@pytest.mark.parametrize("kind", ["plain", "grooved"])
@pytest.mark.parametrize("pointwise", [False, True])
def test_homogeneous_strain_has_the_energy_of_the_material(make_body, element, kind, pointwise):
    """W(E) times the kept volume for any constant gradient: enhanced strains relieve no constant stress.

    But for the shear between faces and cross-sections: the enriched element warps, to 5/6 of its energy.
    """
    plate = make_body(kind, pointwise=pointwise)
    F = np.eye(3) + 0.1 * np.random.default_rng(8).standard_normal((3, 3))
    strain = (F.T @ F - np.eye(3)) / 2
    material, sheared = from_engineering(2.0e6, 0.3), np.zeros((3, 3))
    sheared[2, :2] = sheared[:2, 2] = strain[2, :2]
    relief = material.energy(sheared) / 6 if element == "enriched" else 0.0
    expected = (material.energy(strain) - relief) * plate.volume
    assert relief == 0 or relief > 0.01 * material.energy(strain)
    assert plate.elements.energy((plate.mesh.vectors @ F.T)[plate.connectivity]) == pytest.approx(expected, rel=1e-11)


def test_too_few_points_are_refused(make_body, element):
    """Three points along x or y leave a bicubic mid-surface four modes without energy."""
    if element != "enriched":
        make_body(points=(3, 3, 2))
        return
    with pytest.raises(ValueError, match=r"3x3x2 points leave the enriched element .* 4x4x3 at least"):
        make_body(points=(3, 3, 2))


def test_an_element_between_two_free_edges_needs_one_point_more_across():
    """Four points do not tell two layers, which fade from either edge, from polynomials of degree two."""

    def strip(points, free):
        mesh = grid(np.linspace(0, 1, 7), np.array([0.0, 0.1]), shape=FAMILY["enriched"])
        return body(mesh, (), 0.05, from_engineering(2e6, 0.3), 2e3, points, free=free)

    with pytest.raises(ValueError, match=r"4x4x3 points leave the enriched element .* 4x5x3 at least"):
        strip((4, 4, 3), ("y0", "y1", "x1"))
    for points, free in (((4, 5, 3), ("y0", "y1", "x1")), ((4, 4, 3), ("y1", "x0", "x1"))):
        plate = strip(points, free)
        assert np.isfinite(plate.elements.energy(1.1 * plate.mesh.vectors[plate.connectivity]))


def test_elements_of_equal_shape_share_one_form(make_body):
    """Equal spacing: one shape when plain; on the cylinder two, which mirror each other, not four."""
    even = (np.linspace(0, 1, 6), np.linspace(0, 1, 5))
    assert make_body(lines=even).shapes == 1
    groove = (Band(BOTTOM, GROOVE, 0, (0.3, 0.4), 0.02),)
    assert make_body(lines=even, bands=groove).shapes == 2


def test_too_many_distinct_elements_keep_their_points(make_body, element, monkeypatch):
    """Where the tensors of all distinct elements would not fit, the mesh is evaluated point by point."""
    monkeypatch.setattr("ancf.system.MOST_FORM_BYTES", 5 * form_bytes(len(FAMILY[element].kinds)))
    assert isinstance(make_body(lines=([0, 0.3, 0.7], [0, 0.2, 0.6])).elements, QuadraticElements | SplitFormElements)
    assert isinstance(make_body(lines=([0, 0.3, 0.7, 1.2], [0, 0.2, 0.6])).elements, PointElements)


def test_memory_told_is_that_of_points_where_there_are_no_tensors(make_body, element, monkeypatch):
    mesh = make_body(lines=([0, 0.3, 0.7, 1.2], [0, 0.2, 0.6])).mesh
    first, count = np.arange(len(mesh.cells)), 3 * len(mesh.vectors)
    tensors = len(first) * form_bytes(len(FAMILY[element].kinds)) / 1e6
    with_tensors = expected_memory(mesh, count, first)
    monkeypatch.setattr("ancf.system.MOST_FORM_BYTES", 0.9e6 * tensors)
    assert expected_memory(mesh, count, first) == pytest.approx(with_tensors - 2 / 3 * tensors)


def test_shallow_groove_is_no_groove(make_body, deformed):
    """A depth of 1e-9 m changes the stiffness by about 1e-9 / thickness = 2e-8."""
    plain, grooved = (make_body(bands=b) for b in ((), (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 1e-9),)))
    q = deformed(plain)
    K = dense_tangent(plain, q)
    np.testing.assert_allclose(dense_tangent(grooved, q), K, atol=1e-7 * np.abs(K).max())


def test_groove_over_the_whole_plate_is_a_thinner_plate(make_body, deformed):
    """Depth 0.02 everywhere on the bottom leaves z in [-0.005, 0.025], integrated directly."""
    plate = make_body(bands=(Band(BOTTOM, GROOVE, 0, (0.0, 0.6), 0.02),), pointwise=True)
    mesh = plate.mesh
    rules = [onto_cell(tensor(gauss(7), gauss(7), gauss(3)), (*cell, (-0.005, 0.025))) for cell in mesh.cells]
    parts = [integrand(mesh.shape, r, c, Q) for r, c, Q in zip(rules, mesh.cells, mesh.element_vectors, strict=True)]
    Q = deformed(plate)[mesh.connectivity]
    force = PointElements(tuple(parts), plate.elements.material).force(Q)
    np.testing.assert_allclose(plate.elements.force(Q), force, atol=1e-12 * np.abs(force).max())
    assert plate.volume == pytest.approx(1.2 * 0.6 * 0.03, rel=1e-13)


def test_folded_reference_shape_is_refused(make_body):
    mesh = make_body().mesh
    rule = onto_cell(tensor(gauss(3), gauss(3), gauss(2)), (*mesh.cells[0], (-0.02, 0.02)))
    with pytest.raises(ValueError, match="folds"):
        integrand(mesh.shape, rule, mesh.cells[0], mesh.element_vectors[0] * [1, 1, -1])


def test_spans_and_portions_of_many_elements_sum_like_one(make_body, deformed):
    """More elements than a span holds, some shapes shared and some not, against a plain sum of every entry."""
    lines = (np.r_[np.linspace(0, 1, 33), 1.04, 1.1], np.linspace(0, 0.6, 32))
    options = {"lines": lines, "bands": (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 0.03),), "points": (4, 4, 3)}
    plate, twin = make_body(**options), make_body(**options, pointwise=True)
    assert len(plate.connectivity) > SPAN > PORTION
    q = deformed(plate)
    at = (3 * twin.connectivity[:, :, None] + np.arange(3)).reshape(len(twin.connectivity), -1)
    rows, columns, values = [], [], []
    for start, K in zip(range(0, len(at), 100), batched_tangents(twin, q, 100), strict=True):
        own = at[start : start + 100]
        rows.append(np.repeat(own, own.shape[1], axis=1).ravel())
        columns.append(np.tile(own, (1, own.shape[1])).ravel())
        values.append(K.ravel())
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    plain = sp.csc_matrix(entries, shape=(q.size, q.size))
    acting = free_system(plate)
    difference = acting.assembly.pattern.full(acting.tangent(q.ravel())) - plain
    assert np.abs(difference.data).max() < 1e-12 * np.abs(plain.data).max()


def batched_tangents(plate, q, size):
    """Full tangents (e, 3 i, 3 i) of a point-by-point body, `size` elements at a time."""
    functions = plate.connectivity.shape[1]
    rows, columns, second = packing(functions)
    for start in range(0, len(plate.connectivity), size):
        part = replace(plate.elements, parts=plate.elements.parts[start : start + size])
        Q = q[plate.connectivity[start : start + size]]
        (packed,) = part.tangent(Q)
        K = np.empty((len(Q), 3 * functions, 3 * functions))
        for own, values in (
            (slice(second), packed[: len(Q) * second]),
            (slice(second, None), packed[len(Q) * second :]),
        ):
            K[:, rows[own], columns[own]] = K[:, columns[own], rows[own]] = values.reshape(len(Q), -1)
        yield K


def test_held_components_leave_the_sum(make_body, deformed):
    """Matrix and vector of the unknowns are those of the free plate without the held rows and columns."""
    plate = make_body("grooved")
    q = deformed(plate)
    held = np.random.default_rng(9).uniform(size=q.size) < 0.3
    sums = assembly(plate.connectivity, len(q), held)
    Q = sums.gather(q.ravel())
    K = sums.pattern.full(sums.matrix(plate.elements.tangent(Q))).toarray()
    np.testing.assert_allclose(K, dense_tangent(plate, q)[np.ix_(~held, ~held)], atol=1e-9)
