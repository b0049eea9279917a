"""Truths of Mooney-Rivlin tetrahedra, and the compiled kernels against their plain twin."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from reference_fe import rubber
from reference_fe.elasticity import internal_force, tabulate, vector_basis
from reference_fe.rubber import mooney_rivlin

SOFT = mooney_rivlin(0.8e6, 0.2e6, 29.6e6)
STIFF = mooney_rivlin(0.8e6, 0.2e6, 80e6)


def wavy(solid, size: float = 0.05) -> np.ndarray:
    """A smooth displacement (n, 3) with strains of about `size`."""
    x, y, z = solid.mesh.doflocs
    return size * np.column_stack([np.sin(2 * y + z), np.cos(3 * x * y), x * x + np.sin(2 * z + y)])


def made(build, solid, material, held=None):
    return replace(build.system(solid, held), material=material)


def dense_tangent(system, u: np.ndarray) -> np.ndarray:
    """Full tangent (3 f, 3 f) from the upper triangle."""
    where = system.pattern
    size = 3 * where.free.size
    upper = csr_matrix((system.tangent(u), where.indices, where.indptr), shape=(size, size))
    return (upper + triu(upper, 1).T).toarray()


@pytest.fixture(params=[SOFT, STIFF], ids=["whole", "split"])
def material(request):
    return request.param


def test_only_what_exceeds_the_split_acts_on_the_mean():
    assert (SOFT.k_point, SOFT.k_mean) == (29.6e6, 0.0)
    assert (STIFF.k_point, STIFF.k_mean) == (40e6, 40e6)  # mu = 2e6


def test_kernels_equal_the_forms(build):
    """W_FF of the kernels against dS/dC of the forms: two derivations."""
    solid = build.curved(0.4)
    u, system, basis = wavy(solid), made(build, solid, SOFT), vector_basis(solid, 4)
    plain = rubber.forces_by_forms(basis, SOFT, u)
    force, _ = internal_force(tabulate(solid, 4), SOFT, u)
    assert np.abs(force.ravel() - plain).max() < 1e-11 * np.abs(plain).max()
    plain = rubber.tangent_by_forms(basis, SOFT, u).toarray()
    assert np.abs(dense_tangent(system, u) - plain).max() < 1e-11 * np.abs(plain).max()


def test_tangent_is_the_differenced_force(build, material):
    solid = build.solid(build.grooved, 0.3)
    system, u = made(build, solid, material), wavy(solid)
    way = wavy(solid, 1.0)[:, [1, 2, 0]]
    step = 1e-5 * way  # central differences: error about step², round-off about 1e-16 / step
    slope = (system.internal(u + step)[0] - system.internal(u - step)[0]) / 2e-5
    product = dense_tangent(system, u) @ way.ravel()
    assert np.abs(product - slope.ravel()).max() < 1e-7 * np.abs(product).max()


def test_energy_is_the_potential_of_the_force(build, material):
    solid = build.curved(0.4)
    system, u = made(build, solid, material), wavy(solid)
    way = wavy(solid, 1.0)[:, [1, 2, 0]]
    difference = (system.internal(u + 1e-5 * way)[1] - system.internal(u - 1e-5 * way)[1]) / 2e-5
    assert math.isclose(difference, float(np.sum(system.internal(u)[0] * way)), rel_tol=1e-6)


def test_rigid_motion_costs_nothing_and_no_other_is_free(build, material):
    solid = build.solid(build.grooved, 0.3)
    system = made(build, solid, material)
    points = solid.mesh.doflocs.T
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    force, energy = system.internal(points @ turn.T - points + [1.0, -2.0, 3.0])
    assert np.abs(force).max() < 1e-7 and energy < 1e-7  # k = 3e7: strains of a few 1e-15 in round-off
    values = np.linalg.eigvalsh(dense_tangent(system, np.zeros_like(points)))
    assert np.abs(values[:6]).max() < 1e-10 * values[-1] < values[6]


def stress(build, material, F) -> np.ndarray:
    """First Piola-Kirchhoff stress (3, 3) of a homogeneous deformation: mean over the volume, X (x) f."""
    solid = build.solid(build.grooved, 0.3)
    F = np.asarray(F, dtype=float)
    force, _ = made(build, solid, material).internal(solid.mesh.doflocs.T @ (F - np.eye(3)).T)
    return (solid.mesh.doflocs @ force).T / solid.volume


@pytest.mark.parametrize("stretch", [0.5, 1.3, 2.5])
def test_closed_forms_of_rubber_that_keeps_its_volume(build, material, stretch):
    """Differences of true stresses of an incompressible solid (Ogden 1984): uniaxial, equal biaxial, simple shear."""
    x, mu10, mu01 = stretch, material.mu10, material.mu01

    def true(F):
        return stress(build, material, F) @ np.asarray(F).T

    uniaxial, biaxial = true(np.diag([x, x**-0.5, x**-0.5])), true(np.diag([x, x, x**-2]))
    scale = 1e-9 * (material.k_point + material.k_mean) * (x + 1 / x) ** 4
    assert uniaxial[0, 0] - uniaxial[1, 1] == pytest.approx(2 * (x**2 - 1 / x) * (mu10 + mu01 / x), abs=scale)
    assert biaxial[0, 0] - biaxial[2, 2] == pytest.approx(2 * (x**2 - x**-4) * (mu10 + mu01 * x**2), abs=scale)
    sheared = true([[1, x, 0], [0, 1, 0], [0, 0, 1]])
    assert sheared[0, 1] == pytest.approx(2 * (mu10 + mu01) * x, abs=scale)
    assert sheared[0, 0] - sheared[2, 2] == pytest.approx(2 * mu10 * x**2, abs=scale)  # Poynting's effect


@pytest.mark.parametrize("volume", [0.8, 1.3])
def test_pressure_of_a_change_of_volume(build, material, volume):
    """k (J - 1), whatever the other constants are."""
    x = np.cbrt(volume)
    expected = (material.k_point + material.k_mean) * (volume - 1) * x**2 * np.eye(3)  # J F^-T of the true pressure
    np.testing.assert_allclose(
        stress(build, material, x * np.eye(3)), expected, atol=1e-9 * (material.k_point + material.k_mean)
    )


def test_an_inverted_solid_is_not_finite(build, material):
    solid = build.solid(build.grooved, 0.3)
    force, _ = made(build, solid, material).internal(solid.mesh.doflocs.T * [0.0, 0.0, -2.0])
    assert not np.isfinite(force).all()
