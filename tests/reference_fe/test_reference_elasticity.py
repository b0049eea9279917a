"""Truths of the St. Venant-Kirchhoff tetrahedra, and the compiled kernels against their plain twin."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from reference_fe.elasticity import (
    forces_by_forms,
    internal_force,
    lame,
    scalar_mass,
    tabulate,
    tangent_by_forms,
    vector_basis,
)

RUBBER = lame(1e6, 0.3)


def solids(build):
    return build.solid(build.grooved, 0.3), build.curved(0.4)


def wavy(solid, size: float = 0.05) -> np.ndarray:
    """A smooth displacement (n, 3) with strains of about `size`."""
    x, y, z = solid.mesh.doflocs
    return size * np.column_stack([np.sin(2 * y + z), np.cos(3 * x * y), x * x + np.sin(2 * z + y)])


def dense_tangent(system, u: np.ndarray) -> np.ndarray:
    """Full tangent (3 f, 3 f) from the upper triangle."""
    where = system.pattern
    size = 3 * where.free.size
    upper = csr_matrix((system.tangent(u), where.indices, where.indptr), shape=(size, size))
    return (upper + triu(upper, 1).T).toarray()


@pytest.mark.parametrize("which", [0, 1], ids=["flat", "curved"])
@pytest.mark.parametrize("degree", [2, 4])
def test_kernel_equals_the_forms(build, which, degree):
    solid = solids(build)[which]
    table, basis, u = tabulate(solid, degree), vector_basis(solid, degree), wavy(solid)
    force, _ = internal_force(table, RUBBER, u)
    plain = forces_by_forms(basis, RUBBER, u)
    assert np.abs(force.ravel() - plain).max() < 1e-12 * np.abs(plain).max()


@pytest.mark.parametrize("clamped", [False, True])
def test_tangent_equals_the_forms(build, clamped):
    solid = build.curved(0.4)
    held = (solid.box.doflocs[0] < 1e-9) & clamped
    system = build.system(solid, held)
    u = wavy(solid)
    u[held] = 0
    free = (3 * system.pattern.free[:, None] + np.arange(3)).ravel()
    plain = tangent_by_forms(vector_basis(solid, 4), RUBBER, u).toarray()[np.ix_(free, free)]
    fast = dense_tangent(system, u[system.pattern.free])
    assert np.abs(fast - plain).max() < 1e-12 * np.abs(plain).max()


def test_tangent_is_the_differenced_force(build):
    solid = build.solid(build.grooved, 0.3)
    system, u = build.system(solid), wavy(solid)
    way = wavy(solid, 1.0)[:, [1, 2, 0]]
    step = 1e-5 * way  # central differences: error about step², round-off about 1e-16 / step
    slope = (system.internal(u + step)[0] - system.internal(u - step)[0]) / 2e-5
    product = dense_tangent(system, u) @ way.ravel()
    assert np.abs(product - slope.ravel()).max() < 1e-8 * np.abs(product).max()


def test_energy_is_the_potential_of_the_force(build):
    solid = build.curved(0.4)
    system, u = build.system(solid), wavy(solid)
    way = wavy(solid, 1.0)[:, [1, 2, 0]]
    difference = (system.internal(u + 1e-5 * way)[1] - system.internal(u - 1e-5 * way)[1]) / 2e-5
    assert math.isclose(difference, float(np.sum(system.internal(u)[0] * way)), rel_tol=1e-7)


@pytest.mark.parametrize("which", [0, 1], ids=["flat", "curved"])
def test_rigid_motion_costs_nothing(build, which):
    solid = solids(build)[which]
    system = build.system(solid)
    points = solid.mesh.doflocs.T
    axis, angle = np.array([1.0, 2.0, -2.0]) / 3, 2.0
    cross = np.cross(np.eye(3), axis)
    rotation = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    for u in (np.zeros_like(points), points @ rotation.T - points + [1.0, -2.0, 3.0]):
        force, energy = system.internal(u)
        assert np.abs(force).max() < 1e-9 and energy < 1e-15  # E = 1e6: strains of a few 1e-15 in round-off


@pytest.mark.parametrize("which", [0, 1], ids=["flat", "curved"])
def test_patch_of_constant_strain_is_exact(build, which):
    solid = solids(build)[which]
    H = np.array([[0.1, 0.05, -0.02], [0.0, -0.1, 0.03], [0.04, 0.0, 0.2]])
    u = solid.mesh.doflocs.T @ H.T
    system = build.system(solid)
    force, energy = system.internal(u)
    E = (H + H.T + H.T @ H) / 2
    S = RUBBER.lam * np.trace(E) * np.eye(3) + 2 * RUBBER.mu * E
    assert math.isclose(energy, np.sum(S * E) / 2 * solid.volume, rel_tol=1e-12)
    inside = np.setdiff1d(np.arange(len(u)), solid.mesh.dofs.get_facet_dofs(solid.mesh.boundary_facets()).flatten())
    assert inside.size > 0
    assert np.abs(force[inside]).max() < 1e-12 * np.abs(force).max()
    assert np.allclose(solid.mesh.doflocs @ force, ((np.eye(3) + H) @ S).T * solid.volume, rtol=1e-11)


def test_stiffness_at_rest_has_six_zero_eigenvalues(build):
    solid = build.solid(build.grooved, 0.3)
    system = build.system(solid)
    values = np.linalg.eigvalsh(dense_tangent(system, np.zeros((solid.box.doflocs.shape[1], 3))))
    assert np.abs(values[:6]).max() < 1e-10 * values[-1] < values[6]


def test_mass_and_momentum(build):
    for solid in solids(build):
        mass = scalar_mass(solid, 1000.0)
        assert math.isclose(mass.sum(), 1000 * solid.volume, rel_tol=1e-12)
        assert abs(mass - mass.T).max() < 1e-15 * mass.max()
    turning = np.cross([1.0, 0.0, 0.0], solid.mesh.doflocs.T)  # about the cylinder's axis
    exact = 1000 * 0.4 * math.pi / 2 * (1.1**4 - 0.9**4) / 4
    assert math.isclose(np.sum(turning * (mass @ turning)), exact, rel_tol=1e-3)  # volume error of this coarse mesh


def test_stress_predicted_before_a_step_is_linear_in_that_step(build):
    solid = build.solid(build.grooved, 0.3)
    H = np.array([[0.1, 0.05, -0.02], [0.0, -0.1, 0.03], [0.04, 0.0, 0.2]])
    dH = np.array([[0.0, 0.2, 0.1], [-0.1, 0.1, 0.0], [0.0, 0.3, -0.2]])
    points = solid.mesh.doflocs.T
    force, _ = internal_force(tabulate(solid, 4), RUBBER, points @ (H + dH).T, points @ dH.T)
    F = np.eye(3) + H
    E = (F.T @ F - np.eye(3)) / 2 + (F.T @ dH + dH.T @ F) / 2
    S = RUBBER.lam * np.trace(E) * np.eye(3) + 2 * RUBBER.mu * E
    assert np.allclose(points.T @ force, ((F + dH) @ S).T * solid.volume, rtol=1e-11)
