"""Natural frequencies of the undeformed solid: K x = omega^2 M x by ARPACK's Lanczos iteration in shift-invert mode.

(K + s M)^-1 is one factorisation of `direct_solver`. A body that is free to move as a rigid one has up to six
eigenvalues zero; their vectors are known beforehand and are projected out, so only elastic modes are found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from reference_fe.linear_solver import Pardiso, SingularTangent, SuperLU
from reference_fe.system import System

TOLERANCE = 1e-8  # relative residual of a Ritz value; its error is quadratic in that
SPARE = 4  # modes sought beyond those wanted, because the partner of a double eigenvalue may come late
STILL = 1e-9  # part of the largest motion that held components may show in a motion called rigid


class ModesFailure(RuntimeError):
    """No modes were found; `status` is its short name."""

    def __init__(self, status: str, message: str):
        super().__init__(message)
        self.status = status


@dataclass(frozen=True)
class Vibration:
    """Elastic modes: frequencies (k,) in Hz, ascending; shapes (k, n, 3) at all nodes; how many motions are rigid.

    solves: solutions with the factor.
    """

    frequencies: np.ndarray
    shapes: np.ndarray
    rigid: int
    solves: int


def vibration(system: System, solver: Pardiso | SuperLU, points: np.ndarray, count: int, shift: float) -> Vibration:
    """The `count` lowest elastic modes of the solid with nodes at `points` (n, 3), by a solver of its pattern.

    shift (1/s2): of the size of the lowest eigenvalue or less; used where rigid motions are free. Raises ModesFailure.
    """
    rigid = rigid_motions(system, points)
    if count >= system.unknowns - len(rigid):
        raise ModesFailure("too_few_unknowns", f"{system.unknowns} unknowns have fewer than {count} elastic modes")
    shift = shift if len(rigid) else 0.0
    try:
        solver.factorise(system.tangent(np.zeros((system.pattern.free.size, 3)), mass=shift))
        values, vectors, solves = _lanczos(system, solver, rigid, count, shift)
    except SingularTangent as error:
        raise ModesFailure("singular_tangent", str(error)) from error
    except ArpackError as error:
        raise ModesFailure("modes_not_converged", str(error)) from error
    if not values[0] > 0:
        raise ModesFailure("stiffness_not_positive", f"the least elastic eigenvalue is {values[0]:.3g} 1/s2")
    shapes = np.array([system.expand(vector.reshape(-1, 3)) for vector in vectors])
    return Vibration(np.sqrt(values) / (2 * np.pi), shapes, len(rigid), solves)


def _lanczos(
    system: System, solver: Pardiso | SuperLU, rigid: np.ndarray, count: int, shift: float
) -> tuple[np.ndarray, np.ndarray, int]:
    """Eigenvalues (count,) in 1/s2, ascending, vectors (count, 3 f) and the number of solutions.

    Single components that are held begin at zero, and nothing moves them: mass and tangent do not couple them.
    """
    size, solves = 3 * system.pattern.free.size, 0

    def inertia(x: np.ndarray) -> np.ndarray:
        return system.inertia(x.reshape(-1, 3)).ravel()

    momenta = _inertia(system, rigid)

    def elastic(x: np.ndarray) -> np.ndarray:
        return x - (momenta @ x) @ rigid

    def flexibility(force: np.ndarray) -> np.ndarray:
        nonlocal solves
        solves += 1
        return elastic(solver.solve(force))

    mass, inverse = (LinearOperator((size, size), matvec=act, dtype=float) for act in (inertia, flexibility))
    start = elastic((_moving(system) * np.random.default_rng(0).standard_normal((size // 3, 3))).ravel())
    sought = min(count + SPARE, system.unknowns - len(rigid) - 1)
    values, vectors = eigsh(mass, sought, mass, -shift, OPinv=inverse, v0=start, tol=TOLERANCE)
    order = np.argsort(values)[:count]
    return values[order], vectors[:, order].T, solves


def rigid_motions(system: System, points: np.ndarray) -> np.ndarray:
    """Rigid motions (r, 3 f) that leave held components where they are, orthonormal in the mass."""
    arms = points - points.mean(axis=0)
    shifts = [np.broadcast_to(axis, arms.shape) for axis in np.eye(3)]
    motions = np.array([*shifts, *(np.cross(axis, arms) / np.abs(arms).max() for axis in np.eye(3))])
    moving = np.zeros(points.shape, dtype=bool)
    moving[system.pattern.free] = _moving(system)
    held = motions[:, ~moving]
    ways, some, _ = np.linalg.svd(np.linalg.qr(held.T, mode="r").T)  # held @ held.T would square the round-off
    moved = np.zeros(6)
    moved[: some.size] = some
    free = ways[:, moved <= STILL * max(1.0, moved.max())].T
    own = free @ (motions[:, system.pattern.free] * _moving(system)).reshape(6, -1)
    return np.linalg.solve(np.linalg.cholesky(own @ _inertia(system, own).T), own)


def _inertia(system: System, vectors: np.ndarray) -> np.ndarray:
    """M x (r, 3 f) of the vectors x (r, 3 f)."""
    return np.array([system.inertia(x.reshape(-1, 3)).ravel() for x in vectors]).reshape(vectors.shape)


def _moving(system: System) -> np.ndarray:
    """Components (f, 3) of the free nodes that are not held."""
    return np.ones((system.pattern.free.size, 3), dtype=bool) if system.fixed is None else ~system.fixed.mask
