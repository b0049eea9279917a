"""All that acts on the free nodes of a solid: mass, internal force, tangent, applied loads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, triu

from reference_fe.elasticity import Lame, Pattern, Table, internal_force, mass_values, tangent
from reference_fe.kernel import smallest_volume_ratio
from reference_fe.linear_solver import direct_solver
from reference_fe.newton import Memory, NewtonFailure


@dataclass(frozen=True)
class System:
    """A discretised solid under dead loads; arrays of the f free nodes are (f, 3).

    mass: scalar (f, f) in kg, or None in statics; scale: length (m) below which displacements do not matter.
    """

    table: Table
    material: Lame
    pattern: Pattern
    mass: csr_matrix | None
    mass_values: np.ndarray | None
    loads: Callable[[float], np.ndarray]
    scale: float

    def expand(self, u: np.ndarray) -> np.ndarray:
        """Values (n, 3) at all nodes from those (f, 3) at the free ones; zero where held."""
        full = np.zeros((self.pattern.number.size, 3))
        full[self.pattern.free] = u
        return full

    def internal(self, u: np.ndarray, step: np.ndarray | None = None) -> tuple[np.ndarray, float]:
        """Internal force (f, 3) in N and strain energy (J); with `step` as elasticity.internal_force has it."""
        change = None if step is None else self.expand(step)
        force, energy = internal_force(self.table, self.material, self.expand(u), change)
        return force[self.pattern.free], energy

    def applied(self, time: float) -> np.ndarray:
        """Applied force (f, 3) in N at a time (s)."""
        return self.loads(time)[self.pattern.free]

    def tangent(
        self, u: np.ndarray, stiffness: float = 1.0, mass: float = 0.0, step: np.ndarray | None = None
    ) -> np.ndarray:
        """Upper-triangle values of stiffness x K(u) + mass x M; with `step` as elasticity.tangent has it."""
        values = mass * self.mass_values if mass else np.zeros(self.pattern.indices.size)
        change = None if step is None else self.expand(step)
        return tangent(self.table, self.material, self.pattern, self.expand(u), values, stiffness, change)

    def refuse_inversion(self, u: np.ndarray) -> None:
        """Raise NewtonFailure "inverted" where det F is not positive: such an equilibrium is not physical."""
        ratio = smallest_volume_ratio(self.table.nodes, self.table.gradient, self.expand(u))
        if not ratio > 0:
            raise NewtonFailure("inverted", f"a tetrahedron is turned inside out: det F = {ratio:.3g}")

    def solve_mass(self, force: np.ndarray) -> np.ndarray:
        """Acceleration (f, 3) in m/s2 that the force (f, 3) in N gives the mass."""
        upper = csr_matrix(triu(self.mass))
        upper.sort_indices()
        solver = direct_solver(upper.indptr, upper.indices)
        solver.factorise(upper.data)
        acceleration = np.column_stack([solver.solve(column) for column in force.T])
        solver.close()
        return acceleration

    def memory(self) -> Memory:
        """A fresh factorisation memory for this system's pattern."""
        where = self.pattern
        return Memory(direct_solver(where.indptr, where.indices), diagonal=where.indptr[:-1])


def assemble(
    table: Table, material: Lame, pattern: Pattern, mass: csr_matrix | None, loads: Callable, scale: float
) -> System:
    """System from a mesh's table and pattern and its scalar mass (n, n) on all nodes."""
    if mass is None:
        return System(table, material, pattern, None, None, loads, scale)
    free = csr_matrix(mass[pattern.free][:, pattern.free])
    return System(table, material, pattern, free, mass_values(free, pattern), loads, scale)
