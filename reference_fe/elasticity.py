"""Total-Lagrangian St. Venant-Kirchhoff elasticity on quadratic tetrahedra.

With H = du/dX, F = I + H, E = (H + Hᵀ + HᵀH) / 2 and S = lambda tr(E) I + 2 mu E, the energy density
is S : E / 2, the internal force of node a is ∫ F S g_a dV and the tangent of nodes a, b is

    ∫ (g_a · S g_b) I + lambda f_a f_bᵀ + mu f_b f_aᵀ + mu (g_a · g_b) F Fᵀ dV,   f_a = F g_a,

g_a being the gradient of shape function a (Belytschko, Liu, Moran, Nonlinear Finite Elements,
sections 4.9 and 6.4). On straight tetrahedra every integrand is of degree 4 at most.

The plain twin is written as scikit-fem forms (`forces_by_forms`, `tangent_by_forms`); the hot path
is a compiled loop over the same tabulated gradients that adds straight into a fixed pattern.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, triu
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, LinearForm
from skfem.helpers import ddot, eye, grad, identity, mul, trace, transpose

from reference_fe import rubber
from reference_fe.kernel import add_force, add_tangent
from reference_fe.mesh import Solid

EXACT = 5  # degree of the 14-point rule: the least one without negative weights that reaches degree 4


@dataclass(frozen=True)
class Lame:
    """Lamé constants lambda and mu (Pa)."""

    lam: float
    mu: float


def lame(youngs_modulus: float, poissons_ratio: float) -> Lame:
    """Lamé constants of Young's modulus (Pa) and Poisson's ratio."""
    mu = youngs_modulus / (2 * (1 + poissons_ratio))
    return Lame(2 * mu * poissons_ratio / (1 - 2 * poissons_ratio), mu)


Material = Lame | rubber.MooneyRivlin


@dataclass(frozen=True)
class Table:
    """Shape gradients at the quadrature points of every element.

    nodes (e, 10); gradient (e, q, 10, 3) in 1/m; weight (e, q) in m3.
    """

    nodes: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray


def tabulate(solid: Solid, degree: int) -> Table:
    """Table of a rule that is exact to `degree` on straight tetrahedra."""
    basis = Basis(solid.mesh, ElementTetP2(), intorder=degree)
    gradient = np.array([shape[0].grad for shape in basis.basis])
    nodes = np.ascontiguousarray(basis.element_dofs.T.astype(np.int64))
    return Table(nodes, np.ascontiguousarray(gradient.transpose(2, 3, 0, 1)), np.ascontiguousarray(basis.dx))


def scalar_mass(solid: Solid, density: float) -> csr_matrix:
    """Consistent mass of one component (n, n) in kg; degree 8 also integrates curved tetrahedra well."""
    basis = Basis(solid.mesh, ElementTetP2(), intorder=4 if solid.flat else 8)
    return BilinearForm(lambda u, v, w: density * u * v).assemble(basis).tocsr()


@dataclass(frozen=True)
class Pattern:
    """Upper triangle of the free unknowns in CSR form, 3 unknowns per free node, by node pairs.

    number (n,): number of each node among the free ones, -1 if held; free (f,) the other way round.
    start (f + 1,), column: upper triangle of node pairs in CSR form; indptr (3 f + 1,), indices: of unknowns.
    slot (e, 10, 10): place of node b among the upper neighbours of node a (0 = a itself), -1 where the
    pair lies below the diagonal or a node is held.
    """

    number: np.ndarray
    free: np.ndarray
    start: np.ndarray
    column: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray
    slot: np.ndarray


def pattern(nodes: np.ndarray, held: np.ndarray, coupled: Sequence[np.ndarray] = ()) -> Pattern:
    """Pattern of the mesh's tangent: nodes (e, 10) and held (n,) whether each node is fixed.

    coupled: sets of nodes that a load couples, each with each.
    """
    number = np.where(held, -1, np.cumsum(~held) - 1)
    count = int((~held).sum())
    local = number[nodes]
    first = np.repeat(local[:, :, None], nodes.shape[1], axis=2)
    second = np.repeat(local[:, None, :], nodes.shape[1], axis=1)
    upper = (first >= 0) & (second >= first)
    more = [_pairs(number[group][number[group] >= 0], count) for group in coupled]
    wanted = np.concatenate([first[upper] * count + second[upper], *more])
    keys, inverse = np.unique(wanted, return_inverse=True)
    inverse = inverse[: int(upper.sum())]
    row, column = np.divmod(keys, count)
    start = np.searchsorted(row, np.arange(count + 1))
    slot = np.full(first.shape, -1, dtype=np.int32)
    slot[upper] = inverse - start[first[upper]]
    indptr, indices = _expand(start, column)
    return Pattern(number, np.flatnonzero(~held), start, column, indptr, indices, slot)


def _pairs(numbers: np.ndarray, count: int) -> np.ndarray:
    """Keys of all pairs of free nodes, the smaller number first."""
    least, greatest = np.minimum.outer(numbers, numbers), np.maximum.outer(numbers, numbers)
    return (least * count + greatest).ravel()


def couple(where: Pattern, share: np.ndarray, block: np.ndarray, values: np.ndarray) -> None:
    """Add block (3, 3) x share_a share_b, symmetric, to the upper-triangle values (nnz,); share (n,) is zero beside
    a set `coupled`."""
    own = np.flatnonzero((share != 0) & (where.number >= 0))
    own = own[np.argsort(where.number[own])]
    number, weight = where.number[own], share[own]
    neighbours = np.repeat(np.arange(where.free.size), np.diff(where.start)) * where.free.size + where.column
    a, b = np.triu_indices(own.size)
    k = np.searchsorted(neighbours, number[a] * where.free.size + number[b]) - where.start[number[a]]
    for i in range(3):
        for j in range(3):
            there = (k > 0) | (j >= i)
            first = where.indptr[3 * number[a] + i] + 3 * k + j - i
            values[first[there]] += (block[i, j] * weight[a] * weight[b])[there]


def _expand(start: np.ndarray, column: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scalar CSR upper triangle of a block pattern with 3 x 3 blocks (first block of a row its diagonal)."""
    blocks = np.diff(start)
    length = (3 * blocks[:, None] - np.arange(3)).ravel()
    indptr = np.concatenate([[0], np.cumsum(length)])
    indices = np.empty(indptr[-1], dtype=np.int64)
    for c in range(3):
        for d in range(3):
            keep = np.ones(column.size, dtype=bool)
            if d < c:
                keep[start[:-1]] = False
            row = np.repeat(np.arange(blocks.size), blocks)[keep]
            k = (np.arange(column.size) - np.repeat(start[:-1], blocks))[keep]
            indices[indptr[3 * row + c] + 3 * k + d - c] = 3 * column[keep] + d
    return indptr, indices


def internal_force(
    table: Table, material: Material, displacement: np.ndarray, step: np.ndarray | None = None
) -> tuple[np.ndarray, float]:
    """Internal force (n, 3) in N and strain energy (J) at the displacement (n, 3) in m.

    With `step`, the last change of the displacement, the stress is the one predicted before that step:
    E loses its part (dHᵀ dH) / 2 of second order in dH = d(step)/dX (see newton.solve_mixed); Lame's solid alone.
    """
    force = np.zeros_like(displacement)
    if isinstance(material, rubber.MooneyRivlin):
        return force, rubber.add_force(
            table.nodes, table.gradient, table.weight, *_constants(material), displacement, force
        )
    change, mixed = _or_itself(step, displacement)
    energy = add_force(
        table.nodes, table.gradient, table.weight, material.lam, material.mu, displacement, change, mixed, force
    )
    return force, energy


def tangent(
    table: Table,
    material: Material,
    where: Pattern,
    displacement: np.ndarray,
    values: np.ndarray,
    factor: float = 1.0,
    step: np.ndarray | None = None,
) -> np.ndarray:
    """Add `factor` times the tangent (N/m) at the displacement (n, 3) to the upper-triangle values (nnz,).

    `step` as in `internal_force`.
    """
    if isinstance(material, rubber.MooneyRivlin):
        rubber.add_tangent(
            table.nodes, table.gradient, table.weight, *_constants(material), displacement, factor,
            where.number, where.indptr, where.slot, values,
        )  # fmt: skip
        return values
    change, mixed = _or_itself(step, displacement)
    add_tangent(
        table.nodes, table.gradient, table.weight, material.lam, material.mu, displacement, change, mixed, factor,
        where.number, where.indptr, where.slot, values,
    )  # fmt: skip
    return values


def _constants(material: rubber.MooneyRivlin) -> tuple[float, float, float, float]:
    """The kernels' arguments."""
    return material.mu10, material.mu01, material.k_point, material.k_mean


def _or_itself(step: np.ndarray | None, displacement: np.ndarray) -> tuple[np.ndarray, bool]:
    """The kernels' two arguments for an optional step."""
    return (displacement, False) if step is None else (step, True)


def mass_values(mass: csr_matrix, where: Pattern) -> np.ndarray:
    """The scalar mass (f, f) of the free nodes on the three components, as upper-triangle values (nnz,)."""
    upper = triu(mass, format="coo")
    count = where.free.size
    keys = np.repeat(np.arange(count), np.diff(where.start)) * count + where.column
    row = upper.row.astype(np.int64)
    k = np.searchsorted(keys, row * count + upper.col) - where.start[row]
    values = np.zeros(where.indices.size)
    for c in range(3):
        values[where.indptr[3 * row + c] + 3 * k] = upper.data
    return values


def vector_basis(solid: Solid, degree: int) -> Basis:
    """scikit-fem's vector basis of the mesh, for the plain twin."""
    return Basis(solid.mesh, ElementVector(ElementTetP2()), intorder=degree)


def forces_by_forms(basis: Basis, material: Lame, displacement: np.ndarray) -> np.ndarray:
    """The internal force (3 n,) again, as a scikit-fem form."""

    @LinearForm
    def force(v, w):
        F, S = _kinematics(w["u"], material)
        return ddot(mul(F, S), grad(v))

    return force.assemble(basis, u=basis.interpolate(displacement.ravel()))


def tangent_by_forms(basis: Basis, material: Lame, displacement: np.ndarray) -> csr_matrix:
    """The tangent (3 n, 3 n) again, as a scikit-fem form."""

    @BilinearForm
    def stiffness(u, v, w):
        F, S = _kinematics(w["u"], material)
        dE = 0.5 * (mul(transpose(F), grad(u)) + mul(transpose(grad(u)), F))
        dS = material.lam * eye(trace(dE), 3) + 2 * material.mu * dE
        return ddot(mul(grad(u), S) + mul(F, dS), grad(v))

    return stiffness.assemble(basis, u=basis.interpolate(displacement.ravel()))


def _kinematics(u, material: Lame):
    """F and S of a displacement field, in scikit-fem's notation."""
    H = grad(u)
    F = H + identity(H)
    E = 0.5 * (H + transpose(H) + mul(transpose(H), H))
    return F, material.lam * eye(trace(E), 3) + 2 * material.mu * E
