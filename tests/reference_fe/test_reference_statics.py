"""Closed forms and observed orders of the static solver."""

from __future__ import annotations

import math

import numpy as np
import pytest
from skfem import Basis, ElementTetP2, ElementVector, FacetBasis, LinearForm
from skfem.helpers import ddot, grad

from reference_fe import statics
from reference_fe.geometry import Plate
from reference_fe.linear_solver import direct_solver
from reference_fe.loads import Load, face_share, line_share
from reference_fe.mesh import Spacing, make
from reference_fe.newton import NewtonFailure

RAMP = np.array([[0.0, 0.0], [1.0, 1.0]])


def linear_solution(system, force: np.ndarray) -> np.ndarray:
    """Displacement (n, 3) of the linear problem K(0) u = force (n, 3)."""
    solver = direct_solver(system.pattern.indptr, system.pattern.indices)
    solver.factorise(system.tangent(np.zeros((system.pattern.free.size, 3))))
    return system.expand(solver.solve(force[system.pattern.free].ravel()).reshape(-1, 3))


def loaded_beam(build, plate, size, force, **material):
    """A plate clamped at x = 0 with a force over its end face, ramped over one second."""
    solid = build.solid(plate, size)
    load = Load(np.outer(face_share(solid, 0, plate.length), force), RAMP)
    system = build.system(solid, solid.box.doflocs[0] < 1e-9, (load,), **material)
    return solid, system


def test_slender_cantilever_bends_as_timoshenko_says(build):
    plate = Plate(1.0, 0.05, 0.05)
    solid, system = loaded_beam(build, plate, 0.05, [0.0, 0.0, 1e-6], young=1e6, poisson=0.0)
    state = statics.balance(system, statics.begin(system), 1.0, system.memory())
    tip = face_share(solid, 0, 1.0) @ system.expand(state.u)[:, 2]
    bending, shear = 1e-6 / (3 * 1e6 * 0.05**4 / 12), 1e-6 / (5 / 6 * 0.5e6 * 0.05**2)
    assert math.isclose(tip, bending + shear, rel_tol=2e-3)  # warping held at the clamp, not in the closed form


def test_stretched_bar_follows_the_law_at_large_strain(build):
    """Uniaxial St. Venant-Kirchhoff bar with nu = 0: force = A E (s³ - s) / 2 at the stretch s."""
    plate, stretch = Plate(1.0, 0.2, 0.2), 1.5
    force = 0.04 * 1e6 * (stretch**3 - stretch) / 2
    solid, system = loaded_beam(build, plate, 0.3, [force, 0.0, 0.0], young=1e6, poisson=0.0)
    state, _ = statics.advance(system, statics.begin(system), 1.0, 0.25, system.memory())
    expected = (stretch - 1) * solid.box.doflocs[0]
    assert np.allclose(system.expand(state.u)[:, 0], expected, atol=1e-9)
    assert math.isclose(state.strain, 0.04 * 1e6 / 2 * ((stretch**2 - 1) / 2) ** 2, rel_tol=1e-9)


def manufactured_errors(build, size: float) -> np.ndarray:
    """Errors in L2 and in the H1 seminorm for a smooth field on a unit cube held on all faces."""
    solid = build.solid(Plate(1.0, 1.0, 1.0), size)
    x, y, z = solid.box.doflocs
    held = (np.minimum(x, 1 - x) < 1e-9) | (np.minimum(y, 1 - y) < 1e-9) | (np.abs(z) > 0.5 - 1e-9)
    system = build.system(solid, held)
    lam, mu, p = system.material.lam, system.material.mu, math.pi
    way = np.array([1.0, -0.5, 2.0])

    def wave(s):
        return [np.sin(p * s[0]), np.sin(p * s[1]), np.cos(p * s[2])]

    def slope(s):
        return [p * np.cos(p * s[0]), p * np.cos(p * s[1]), -p * np.sin(p * s[2])]

    def exact(s):
        w, d = wave(s), slope(s)
        value = w[0] * w[1] * w[2]
        gradient = np.stack([d[0] * w[1] * w[2], w[0] * d[1] * w[2], w[0] * w[1] * d[2]])
        mixed = [d[0] * d[1] * w[2], d[0] * w[1] * d[2], w[0] * d[1] * d[2]]
        hessian = np.stack(
            [
                [-p * p * value, mixed[0], mixed[1]],
                [mixed[0], -p * p * value, mixed[2]],
                [mixed[1], mixed[2], -p * p * value],
            ]
        )
        return value, gradient, hessian

    basis = Basis(solid.mesh, ElementVector(ElementTetP2()), intorder=6)

    def body(w):  # -div sigma of u = way * value
        value, _, hessian = exact(w.x)
        divergence = np.einsum("j,ij...->i...", way, hessian)
        return 3 * p * p * mu * way[:, None, None] * value - (lam + mu) * divergence

    force = LinearForm(lambda v, w: np.sum(body(w) * v, axis=0)).assemble(basis)
    field = basis.interpolate(linear_solution(system, force.reshape(-1, 3)).ravel())
    value, gradient, _ = exact(basis.global_coordinates())
    miss = field - way[:, None, None] * value
    turn = grad(field) - way[:, None, None, None] * gradient[None]
    return np.sqrt([np.sum(miss**2 * basis.dx), np.sum(ddot(turn, turn) * basis.dx)])


def test_quadratic_tetrahedra_converge_at_orders_three_and_two(build):
    coarse, fine = build.solid(Plate(1.0, 1.0, 1.0), 0.25), build.solid(Plate(1.0, 1.0, 1.0), 0.125)
    ratio = (fine.tetrahedra / coarse.tetrahedra) ** (1 / 3)
    errors = manufactured_errors(build, 0.25) / manufactured_errors(build, 0.125)
    orders = np.log(errors) / math.log(ratio)
    assert 2.75 < orders[0] < 3.4 and 1.85 < orders[1] < 2.4


def test_thick_cylinder_under_pressure_is_lames(build):
    """nu = 0, so that plane strain and plane stress agree; the error falls with the mesh to 0.05 %."""
    errors = []
    for size in (0.25, 0.12):
        solid = build.curved(size, 1.0, 0.4, 0.4)
        system = build.system(solid, poisson=0.0)
        inner, outer = 0.8, 1.2
        radius = np.hypot(solid.mesh.doflocs[1], solid.mesh.doflocs[2])
        outward = solid.mesh.doflocs / radius * np.array([[0.0], [1.0], [1.0]])
        a = inner**2 / (outer**2 - inner**2)
        exact = (a / 1e6 * (radius + outer**2 / radius) * outward).T
        found = linear_quarter(system, solid, pressure_force(solid, 1.0))
        errors.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert errors[1] < 5e-4 and errors[0] / errors[1] > 4


def pressure_force(solid, pressure: float) -> np.ndarray:
    """Nodal forces (n, 3) of a pressure on the inner face."""
    facets = solid.mesh.boundary_facets()
    corners = solid.box.doflocs[2][solid.mesh.facets[:, facets]]
    low = solid.box.doflocs[2].min()
    facets = facets[(np.abs(corners - low) < 1e-9).all(axis=0)]
    basis = FacetBasis(solid.mesh, ElementVector(ElementTetP2()), facets=facets, intorder=6)
    return LinearForm(lambda v, w: -pressure * np.sum(w.n * v, axis=0)).assemble(basis).reshape(-1, 3)


def linear_quarter(system, solid, force: np.ndarray) -> np.ndarray:
    """Linear solution with the two cut faces held along their normals (penalty) and x = 0 along x."""
    where = system.pattern
    values = system.tangent(np.zeros((where.free.size, 3)))
    x, y, _ = solid.box.doflocs
    penalty = 1e6 * np.abs(values).max()
    rows = where.indptr[:-1].reshape(-1, 3)
    w = 2**-0.5
    for mask, normal in ((y < 1e-9, [0, w, w]), (y > y.max() - 1e-9, [0, -w, w]), (x < 1e-9, [1, 0, 0])):
        for node in np.flatnonzero(mask):
            for i in range(3):
                for j in range(i, 3):
                    values[rows[node, i] + j - i] += penalty * normal[i] * normal[j]
    solver = direct_solver(where.indptr, where.indices)
    solver.factorise(values)
    return solver.solve(force.ravel()).reshape(-1, 3)


def test_one_load_step_reaches_a_large_rotation(build):
    """The mixed iteration takes in one step what plain Newton would need many for; the path does not matter."""
    plate = Plate(1.0, 0.1, 0.05)
    answers = []
    for step in (1.0, 0.25):
        _, system = loaded_beam(build, plate, 0.1, [0.0, 0.0, -3.0], young=2e6, poisson=0.0)
        state, _ = statics.advance(system, statics.begin(system), 1.0, step, system.memory())
        answers.append(state.u)
    assert np.abs(answers[0]).max() > 0.3
    assert np.abs(answers[0] - answers[1]).max() < 1e-8


@pytest.mark.slow
def test_elastica_under_end_shear(build):
    """Sze, Liu, Lo 2004, section 3.1: L = 10, b = 1, h = 0.1, E = 1.2e6, nu = 0, P = 4 at the tip."""
    plate = Plate(10.0, 1.0, 0.1)
    solid = build.solid(plate, 0.25)
    load = Load(np.outer(face_share(solid, 0, 10.0), [0.0, 0.0, 4.0]), RAMP)
    system = build.system(solid, solid.box.doflocs[0] < 1e-9, (load,), young=1.2e6, poisson=0.0)
    state, _ = statics.advance(system, statics.begin(system), 1.0, 0.25, system.memory())
    tip = face_share(solid, 0, 10.0) @ system.expand(state.u)
    assert math.isclose(-tip[0], 3.286, rel_tol=5e-3) and math.isclose(tip[2], 6.698, rel_tol=5e-3)


def test_a_body_without_supports_is_a_named_failure(build):
    solid = make(Plate(1.0, 0.8, 0.1, lines=((1.0, 0.8),)), Spacing(0.4))
    system = build.system(solid, loads=(Load(np.outer(line_share(solid, (1.0, 0.8)), [0, 0, 1.0]), RAMP),))
    with pytest.raises(NewtonFailure) as failure:
        statics.advance(system, statics.begin(system), 1.0, 0.5, system.memory())
    assert failure.value.status == "singular_tangent"


def test_a_load_beyond_equilibrium_is_a_named_failure(build):
    """In compression a St. Venant-Kirchhoff bar carries A E / (3 sqrt 3) at most."""
    plate = Plate(1.0, 0.2, 0.2)
    _, system = loaded_beam(build, plate, 0.3, [-2 * 0.04 * 1e6 / (3 * math.sqrt(3)), 0, 0], young=1e6, poisson=0.0)
    with pytest.raises(NewtonFailure) as failure:
        statics.advance(system, statics.begin(system), 1.0, 0.5, system.memory())
    assert failure.value.status in ("newton_diverged", "not_finite", "singular_tangent", "inverted")
