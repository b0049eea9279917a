"""Natural vibrations: K x = omega^2 M x about the undeformed plate, where no load or stress acts.

Lanczos iteration on (K + s M)^-1 M (shift and invert; Ericsson and Ruhe, Math. Comp. 35 (1980) 1251): one
factorisation, then a solution per Lanczos vector. The rigid motions that the supports allow are known exactly.
They are taken out of every vector (projection orthogonal in the mass), so that none of them, nor its round-off,
stands among the elastic modes; the shift s keeps the matrix of a free plate invertible.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from ancf.assembly import Pattern
from ancf.linear_solver import LinearSolver, SingularMatrix, Solve
from ancf.newton import OK, SINGULAR
from ancf.system import Body, System

NOT_CONVERGED = "modes_not_converged"
NO_MASS = "mass_not_positive"
NO_STIFFNESS = "stiffness_not_positive"
TOO_FEW = "too_few_unknowns"
WORDS = {
    NOT_CONVERGED: "the Lanczos iteration did not converge",
    NO_MASS: "the mass matrix is not positive definite: too few integration points, or an element without material",
    NO_STIFFNESS: "a vibration that is no rigid motion has no stiffness",
    TOO_FEW: "the mesh has fewer elastic modes than the scene asks for",
    SINGULAR: "the stiffness has no inverse to working precision",
}
TOLERANCE = 1e-8  # residual of an eigenvalue of the inverse; its error is of the square of that
GUARD = 4  # modes beyond those asked for: of a pair of equal frequencies Lanczos may find one late
HELD = 1e-9  # a rigid motion that moves held components less than this part of the largest is free


class Modes(NamedTuple):
    """Elastic modes: eigenvalues omega^2 (k,) in 1/s2, ascending; shapes (k, 3 v) with x M x = 1.

    rigid: number of rigid motions left free. solves: solutions with the factor. No modes unless status is "ok".
    """

    eigenvalues: np.ndarray
    shapes: np.ndarray
    rigid: int
    status: str
    solves: int


def lowest(system: System, count: int, shift: float) -> Modes:
    """The `count` lowest elastic modes of the undeformed plate. shift (1/s2): some part of the lowest eigenvalue."""
    mass = system.assembly.pattern.full(system.mass_values)
    rigid = rigid_motions(system, mass)
    if count >= system.unknowns - len(rigid):
        return _none(system, len(rigid), TOO_FEW)
    if not mass_is_positive(system.body):
        return _none(system, len(rigid), NO_MASS)
    shift = shift if len(rigid) else 0.0
    stiffness = system.tangent(system.body.mesh.vectors.ravel())
    try:
        factor = LinearSolver(system.assembly.pattern).factorise(stiffness + shift * system.mass_values)
    except SingularMatrix:
        return _none(system, len(rigid), SINGULAR)
    return _lanczos(system, mass, factor, rigid, count, shift)


def _lanczos(system: System, mass: sp.csc_matrix, factor: Solve, rigid: np.ndarray, count: int, shift: float) -> Modes:
    """Modes by a factor of K + shift M."""
    n, solves = system.unknowns, 0
    momenta = rigid @ mass

    def elastic(x: np.ndarray) -> np.ndarray:
        return x - rigid.T @ (momenta @ x)

    def inverse(b: np.ndarray) -> np.ndarray:
        nonlocal solves
        solves += 1
        return elastic(factor(b))

    operator = spl.LinearOperator((n, n), matvec=inverse, dtype=float)
    start = elastic(np.random.default_rng(0).standard_normal(n))
    wanted = min(count + GUARD, n - len(rigid) - 1)
    try:
        values, vectors = spl.eigsh(mass, wanted, mass, -shift, OPinv=operator, v0=start, tol=TOLERANCE)
    except spl.ArpackError:
        return _none(system, len(rigid), NOT_CONVERGED)
    order = np.argsort(values)[:count]
    if not values[order[0]] > 0:
        return _none(system, len(rigid), NO_STIFFNESS)
    shapes = np.zeros((count, len(system.assembly.unknown_of)))
    shapes[:, system.assembly.free] = vectors[:, order].T
    return Modes(values[order], shapes, len(rigid), OK, solves)


def highest(system: System) -> float:
    """The largest eigenvalue omega^2 (1/s2): explicit time steps are stable below 2 / omega.

    Raises SingularMatrix where the mass is not positive definite, ArpackNoConvergence.
    """
    pattern, n = system.assembly.pattern, system.unknowns
    stiffness, mass = (pattern.full(v) for v in (system.tangent(system.body.mesh.vectors.ravel()), system.mass_values))
    factor = LinearSolver(pattern).factorise(system.mass_values)
    start = np.random.default_rng(0).standard_normal(n)
    operator = spl.LinearOperator((n, n), matvec=factor, dtype=float)
    return float(spl.eigsh(stiffness, 1, mass, Minv=operator, v0=start, tol=1e-6, return_eigenvectors=False)[0])


def rigid_motions(system: System, mass: sp.csc_matrix) -> np.ndarray:
    """The rigid motions (r, u) of the undeformed plate that move no held component, orthonormal in the mass."""
    own = free_motions(system)[:, system.assembly.free]
    triangle = np.linalg.cholesky(own @ (mass @ own.T))
    return np.linalg.solve(triangle, own)


def free_motions(system: System) -> np.ndarray:
    """Rigid motions (r, 3 v) of the undeformed plate that move no held component.

    A rotation turns every nodal vector, and positions about the centre. What the motions do to held components, with
    gradients as lengths, has a singular value of zero for each combination of them that moves none; the squares of
    these values would not tell zero from 1e-8 of the largest.
    """
    mesh = system.body.mesh
    position = (mesh.kinds == "r")[:, None]
    centre = mesh.vectors[position[:, 0]].mean(axis=0)
    arms = mesh.vectors - position * centre
    size = np.abs(arms[position[:, 0]]).max()
    motions = [position * axis for axis in np.eye(3)] + [np.cross(axis, arms) / size for axis in np.eye(3)]
    lengths = np.where(position, 1.0, size)
    is_held = (system.assembly.unknown_of < 0).reshape(-1, 3)
    held = np.array([(motion * lengths)[is_held] for motion in motions])
    held = np.pad(held, ((0, 0), (0, max(0, 6 - held.shape[1]))))
    ways, moved, _ = np.linalg.svd(held, full_matrices=False)
    return ways[:, moved <= HELD * max(1.0, moved.max())].T @ np.array(motions).reshape(6, -1)


def mass_is_positive(plate: Body) -> bool:
    """Whether the scalar mass matrix can be factorised without a vanishing pivot."""
    lower = sp.tril(plate.mass, format="csc")
    lower.sort_indices()
    if not np.all(plate.mass.diagonal() > 0):
        return False
    try:
        LinearSolver(Pattern(lower.indptr, lower.indices)).factorise(lower.data)
    except SingularMatrix:
        return False
    return True


def _none(system: System, rigid: int, status: str) -> Modes:
    return Modes(np.empty(0), np.empty((0, len(system.assembly.unknown_of))), rigid, status, 0)
