"""Elements of Mooney-Rivlin material: fast against plain, derivatives, closed forms, locking."""

import numpy as np
import pytest

from ancf.element import PointElements, integrand
from ancf.hyperelastic import SHEAR, HyperelasticElements, form
from ancf.material import MooneyRivlin, from_engineering
from ancf.mesh import grid
from ancf.moduli import stress_and_moduli
from ancf.packing import packing
from ancf.rubber import inverse_cube_roots
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, Band, element_rule
from ancf.system import FULL, REDUCED, RELAXED, body

RUBBER = MooneyRivlin(0.8e6, 0.2e6, 29.6e6)  # k = 14.8 shear moduli, as in Table 6
THICKNESS = 0.05
POINTS = (4, 4, 3)
LINES = np.array([0.0, 0.3, 0.7, 1.2]), np.array([0.0, 0.25, 0.6])
BANDS = (Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 0.03),)


def plate(element, volumetric=RELAXED, bands=BANDS, material=RUBBER, points=POINTS):
    return body(grid(*LINES, None, FAMILY[element]), bands, THICKNESS, material, 1100.0, points, volumetric=volumetric)


def dense(tangents, count, functions):
    """Packed tangents of one span as matrices (e, 3 i, 3 i)."""
    rows, columns, second = packing(functions)
    (packed,) = tangents
    parts = packed[: count * second].reshape(count, -1), packed[count * second :].reshape(count, -1)
    K = np.zeros((count, 3 * functions, 3 * functions))
    K[:, rows, columns] = K[:, columns, rows] = np.hstack(parts)
    return K


def test_the_fast_path_agrees_with_the_plain_one(element, deformed):
    """The same sums in another order: equal to round-off."""
    mesh = grid(*LINES, None, FAMILY[element])
    rules = [element_rule(cell, BANDS, THICKNESS, POINTS) for cell in mesh.cells]
    parts = [
        integrand(mesh.shape, rule, cell, mesh.vectors[own], (), False)
        for rule, cell, own in zip(rules, mesh.cells, mesh.connectivity, strict=True)
    ]
    plain = PointElements(tuple(parts), RUBBER)
    fast = HyperelasticElements(RUBBER, tuple(map(form, parts)), np.arange(len(parts)), relax=False)
    Q = deformed(plate(element))[mesh.connectivity]
    assert fast.energy(Q) == pytest.approx(plain.energy(Q), rel=1e-12)
    np.testing.assert_allclose(fast.force(Q), plain.force(Q), atol=1e-12 * np.abs(plain.force(Q)).max())
    (one,), (other,) = fast.tangent(Q), plain.tangent(Q)
    np.testing.assert_allclose(one, other, atol=1e-12 * np.abs(other).max())


@pytest.mark.parametrize("volumetric", [RELAXED, REDUCED, FULL])
def test_force_and_tangent_are_derivatives(element, volumetric, deformed):
    """Central differences err by the square of their step."""
    made = plate(element, volumetric)
    q, connectivity = deformed(made, amount=0.01), made.connectivity
    direction, step = np.random.default_rng(1).standard_normal(q.shape), 1e-6
    Q, d = q[connectivity], direction[connectivity]
    ahead, behind = Q + step * d, Q - step * d
    difference = (made.elements.energy(ahead) - made.elements.energy(behind)) / (2 * step)
    assert np.sum(made.elements.force(Q) * d) == pytest.approx(difference, rel=1e-6)
    difference = (made.elements.force(ahead) - made.elements.force(behind)) / (2 * step)
    K = dense(made.elements.tangent(Q), *Q.shape[:2])
    change = np.einsum("eij,ej->ei", K, d.reshape(len(d), -1)).reshape(d.shape)
    np.testing.assert_allclose(change, difference, atol=1e-6 * np.abs(difference).max())


def test_a_rigid_motion_costs_nothing_and_no_other_is_free(element, deformed):
    made = plate(element)
    q = deformed(made, amount=0.0)
    assert made.elements.energy(q[made.connectivity]) == pytest.approx(0, abs=1e-9 * RUBBER.shear * made.volume)
    K = dense(made.elements.tangent(q[made.connectivity]), *made.connectivity.shape)
    scale = 1 / np.sqrt(np.einsum("eii->ei", K))
    values = np.linalg.eigvalsh(scale[:, :, None] * K * scale[:, None])
    np.testing.assert_array_equal((np.abs(values) < 1e-8).sum(axis=1), 6)
    assert values.min() > -1e-12


def stretched(made, F):
    """Nodal vectors of a homogeneous deformation gradient (3, 3)."""
    return made.mesh.vectors @ np.asarray(F).T


def work(made, F, dF):
    """dW/dF : dF of a homogeneous deformation, from the elements' forces (N m per m3)."""
    force = made.elements.force(stretched(made, F)[made.connectivity])
    return np.sum(force * stretched(made, dF)[made.connectivity]) / made.volume


@pytest.mark.parametrize("stretch", [0.6, 1.5, 2.5])
@pytest.mark.parametrize("across", ["y", "yz"])
def test_uniaxial_and_biaxial_stress(element, stretch, across):
    """P = 2 (x - x^-2) (mu10 + mu01 / x) under uniaxial, 2 (x - x^-5) (mu10 + mu01 x^2) under equal biaxial stress of
    an incompressible solid (Ogden 1984). The deformation keeps the volume; k = 1e6 shear moduli only amplify round-off.
    """
    stiff = MooneyRivlin(RUBBER.mu10, RUBBER.mu01, 1e6 * RUBBER.shear)
    made = plate(element, material=stiff)
    x = stretch
    if across == "y":  # uniaxial along X
        F, dF = np.diag([x, x**-0.5, x**-0.5]), np.diag([1, -0.5 * x**-1.5, -0.5 * x**-1.5])
        expected = 2 * (x - x**-2) * (stiff.mu10 + stiff.mu01 / x)
    else:  # equal along X and Y: work on both
        F, dF = np.diag([x, x, x**-2]), np.diag([1, 1, -2 * x**-3])
        expected = 2 * 2 * (x - x**-5) * (stiff.mu10 + stiff.mu01 * x**2)
    assert work(made, F, dF) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("shear", [0.2, 1.0])
def test_simple_shear_in_the_plane(element, shear):
    """tau = 2 (mu10 + mu01) shear: the volume is kept, and a uniform state has no strain of the points alone."""
    made = plate(element)
    F, dF = np.eye(3), np.zeros((3, 3))
    F[0, 1], dF[0, 1] = shear, 1.0
    assert work(made, F, dF) == pytest.approx(RUBBER.shear * shear, rel=1e-12)


def test_small_strains_are_those_of_the_linear_solid(element):
    """Without relaxation, which that solid has as enhanced strains, the tangents at rest are the same."""
    nu = (3 * RUBBER.bulk - 2 * RUBBER.shear) / (6 * RUBBER.bulk + 2 * RUBBER.shear)
    linear = from_engineering(2 * RUBBER.shear * (1 + nu), nu)
    made = plate(element, FULL)
    mesh, rest = made.mesh, made.mesh.element_vectors
    rules = [element_rule(cell, BANDS, THICKNESS, POINTS) for cell in mesh.cells]
    parts = [
        integrand(mesh.shape, rule, cell, mesh.vectors[own], (), False)
        for rule, cell, own in zip(rules, mesh.cells, mesh.connectivity, strict=True)
    ]
    K = dense(PointElements(tuple(parts), linear).tangent(rest), *rest.shape[:2])
    found = dense(made.elements.tangent(rest), *rest.shape[:2])
    own = np.abs(K).max(axis=(1, 2))
    order = np.argsort([np.flatnonzero((mesh.connectivity == row).all(axis=1))[0] for row in made.connectivity])
    np.testing.assert_allclose(found[order] / own[:, None, None], K / own[:, None, None], atol=1e-12)


@pytest.mark.parametrize("element", ["conforming", "enriched"], indirect=True)
@pytest.mark.parametrize("ratio", [14.8, 1e4])
def test_bending_does_not_lock(element, ratio):
    """Bent to a cylinder a plate has the energy E / (1 - nu^2) h^3 / 12 kappa^2 / 2 per area (Kirchhoff), exactly:

    the mid-surface z = kappa x^2 / 2 and the normal directors are in the element, the thickness strain
    -nu / (1 - nu) E11 is in the relaxed one alone.
    """
    stiff = MooneyRivlin(RUBBER.mu10, RUBBER.mu01, ratio * RUBBER.shear)
    made = plate(element, bands=(), material=stiff)
    mesh, bent = made.mesh, np.zeros_like(made.mesh.vectors)
    x = mesh.parameters[:, 0]
    for kind, component, value in (("r", 2, x**2 / 2), ("r_x", 2, x), ("r_z", 0, -x)):
        own = mesh.kinds == kind
        bent[own, component] = value[own]
    d = bent[made.connectivity].reshape(len(made.connectivity), -1)
    K = dense(made.elements.tangent(mesh.vectors[made.connectivity]), *made.connectivity.shape)
    nu = (3 * stiff.bulk - 2 * stiff.shear) / (6 * stiff.bulk + 2 * stiff.shear)
    young, area = 2 * stiff.shear * (1 + nu), made.volume / THICKNESS
    expected = young / (1 - nu**2) * THICKNESS**3 / 12 * area
    assert np.einsum("ei,eij,ej", d, K, d) == pytest.approx(expected, rel=1e-9)


def test_a_plate_turned_inside_out_is_not_a_number(element):
    made = plate(element)
    q = stretched(made, np.diag([1.0, 1.0, 0.0]))
    with np.errstate(invalid="ignore", divide="ignore"):
        assert not np.isfinite(made.elements.energy(q[made.connectivity]))


def test_the_shear_factor_is_reissners():
    """Sheared directors of small angle: 5/6 G h per area with the enriched element, G h with the conforming one."""
    for name, factor in (("enriched", SHEAR**2), ("conforming", 1.0)):
        made = plate(name, bands=())
        q = made.mesh.vectors.copy()
        q[made.mesh.kinds == "r_z", 0] += 1e-4
        energy = made.elements.energy(q[made.connectivity])
        assert energy == pytest.approx(factor * RUBBER.shear / 2 * 1e-8 * made.volume, rel=1e-6)


@pytest.mark.parametrize("span", [(0.6, 1 / 0.6), (1e-3, 50.0)])
def test_inverse_cube_roots_end_in_round_off(span):
    """Iterated near one, by logarithms where any is farther off: 4 units in the last place."""
    square, root = np.linspace(*span, 1001), np.empty(1001)
    inverse_cube_roots(square, root)
    np.testing.assert_allclose(root, square ** (-1 / 3), rtol=1e-15)
    square[3] = -0.1
    inverse_cube_roots(square, root)
    assert np.isnan(root[3]) and np.isfinite(root[4:]).all()


def test_the_compiled_moduli_are_those_of_the_material():
    """dS/dE and S at a point, in six components, of a large strain; with a factor of the transverse shears."""
    F = np.eye(3) + 0.2 * np.random.default_rng(3).standard_normal((3, 3))
    E, factor, six = (F.T @ F - np.eye(3)) / 2, 0.9, [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    C, shears = tuple(2 * E[m] + (m[0] == m[1]) for m in six), np.array([1, 1, 1, factor, factor, 1])
    law = (RUBBER.mu10, RUBBER.mu01, RUBBER.bulk)
    S, M = stress_and_moduli.py_func(law, factor, C, np.linalg.det(F) ** (-2 / 3))
    stress, tangent = RUBBER.stress(E), RUBBER.tangent(E)
    np.testing.assert_allclose(S, [stress[m] for m in six] * shears, rtol=1e-12)
    expected = [[tangent[*m, *n] for n in six] for m in six] * shears * shears[:, None]
    np.testing.assert_allclose(M, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
