"""All that acts on the free nodes of a solid: mass, internal force, tangent, applied loads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_matrix, triu

from reference_fe.elasticity import Material, Pattern, Table, couple, internal_force, mass_values, tangent
from reference_fe.kernel import smallest_volume_ratio
from reference_fe.linear_solver import direct_solver
from reference_fe.loads import Moment
from reference_fe.newton import Memory, NewtonFailure
from reference_fe.pressure import FollowerPressure

if TYPE_CHECKING:
    from reference_fe.contact import Contact, Stretch


@dataclass(frozen=True)
class Fixed:
    """Single components held at free nodes: mask (f, 3), and what holds them in the tangent.

    dropped: places in the upper-triangle values that couple a held component with any other. Its diagonal
    stays, and with a residual of zero Newton never moves it.
    """

    mask: np.ndarray
    dropped: np.ndarray


@dataclass(frozen=True)
class System:
    """A discretised solid; arrays of the f free nodes, those with a component to move, are (f, 3).

    mass: scalar (f, f) in kg, or None in statics; scale: length (m) below which displacements do not matter;
    fixed: single components held; moments: loads that turn with an edge; pressures: loads that follow a face;
    contact: with obstacles.
    """

    table: Table
    material: Material
    pattern: Pattern
    mass: csr_matrix | None
    mass_values: np.ndarray | None
    loads: Callable[[float], np.ndarray]
    scale: float
    fixed: Fixed | None = None
    moments: tuple[Moment, ...] = ()
    pressures: tuple[FollowerPressure, ...] = ()
    contact: Contact | None = None

    @property
    def unknowns(self) -> int:
        """Number of displacement components to find."""
        return 3 * self.pattern.free.size - (0 if self.fixed is None else int(self.fixed.mask.sum()))

    def expand(self, u: np.ndarray) -> np.ndarray:
        """Values (n, 3) at all nodes from those (f, 3) at the free ones; zero where held."""
        full = np.zeros((self.pattern.number.size, 3))
        full[self.pattern.free] = u
        return full

    def internal(self, u: np.ndarray, step: np.ndarray | None = None) -> tuple[np.ndarray, float]:
        """Internal force (f, 3) in N and strain energy (J); with `step` as elasticity.internal_force has it."""
        change = None if step is None else self.expand(step)
        force, energy = internal_force(self.table, self.material, self.expand(u), change)
        return self.free(force), energy

    def free(self, force: np.ndarray) -> np.ndarray:
        """Forces (f, 3) on the free nodes of those (n, 3) on all, without those on held components."""
        own = force[self.pattern.free]
        if self.fixed is not None:
            own[self.fixed.mask] = 0.0
        return own

    def applied(self, time: float) -> np.ndarray:
        """Dead forces (f, 3) in N at a time (s)."""
        return self.free(self.loads(time))

    def following(self, u: np.ndarray, time: float) -> np.ndarray:
        """Forces (f, 3) in N of what follows the motion: moments turn with their edges, pressures with their faces."""
        full = self.expand(u)
        forces = [moment.at(full, time)[0] for moment in self.moments]
        forces += [pressure.force(full, time) for pressure in self.pressures]
        return self.free(sum(forces, np.zeros_like(full)))

    def inertia(self, a: np.ndarray) -> np.ndarray:
        """Force (f, 3) in N that the acceleration (f, 3) takes."""
        force = self.mass @ a
        if self.fixed is not None:
            force[self.fixed.mask] = 0.0
        return force

    def pressed(self, stretch: Stretch, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contact forces (f, 3) in N on the way to u, and the contact's stiffness (f,) in N/m at the nodes."""
        force, grip = stretch.force(self.expand(u))
        return self.free(force), grip[self.pattern.free]

    def tangent(
        self,
        u: np.ndarray,
        stiffness: float = 1.0,
        mass: float = 0.0,
        step: np.ndarray | None = None,
        stretch: Stretch | None = None,
    ) -> np.ndarray:
        """Upper-triangle values of stiffness x K(u) + mass x M; with `step` as elasticity.tangent has it.

        stretch: the way to u, on which obstacles press.
        """
        values = mass * self.mass_values if mass else np.zeros(self.pattern.indices.size)
        change = None if step is None else self.expand(step)
        tangent(self.table, self.material, self.pattern, self.expand(u), values, stiffness, change)
        if stretch is not None:
            stretch.add_tangent(self.pattern, self.expand(u), values)
        return self._without_fixed(values)

    def tangent_loaded(
        self,
        u: np.ndarray,
        time: float,
        stiffness: float = 1.0,
        mass: float = 0.0,
        step: np.ndarray | None = None,
        stretch: Stretch | None = None,
    ) -> np.ndarray:
        """`tangent` less stiffness x the derivative of the loads that follow the motion."""
        values, full = self.tangent(u, stiffness, mass, step, stretch), self.expand(u)
        for moment in self.moments:
            couple(self.pattern, moment.slope, -stiffness * moment.at(full, time)[1], values)
        for pressure in self.pressures:
            pressure.subtract_stiffness(self.pattern, full, time, stiffness, values)
        return self._without_fixed(values)

    def _without_fixed(self, values: np.ndarray) -> np.ndarray:
        if self.fixed is not None:
            values[self.fixed.dropped] = 0.0
        return values

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
        rows = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
        acceleration = np.empty_like(force)
        for a in range(3):
            values = upper.data.copy()
            if self.fixed is not None:
                held = self.fixed.mask[:, a]
                values[(held[rows] | held[upper.indices]) & (rows != upper.indices)] = 0.0
            solver.factorise(values)
            acceleration[:, a] = solver.solve(force[:, a])
        solver.close()
        return acceleration

    def memory(self) -> Memory:
        """A fresh factorisation memory for this system's pattern."""
        where = self.pattern
        return Memory(direct_solver(where.indptr, where.indices), diagonal=where.indptr[:-1])


def assemble(
    table: Table,
    material: Material,
    pattern: Pattern,
    mass: csr_matrix | None,
    loads: Callable,
    scale: float,
    held: np.ndarray | None = None,
    moments: tuple[Moment, ...] = (),
    pressures: tuple[FollowerPressure, ...] = (),
) -> System:
    """System from a mesh's table and pattern and its scalar mass (n, n) on all nodes.

    held (n, 3): components without motion; the pattern leaves out the nodes where none moves.
    """
    fixed = None if held is None or not held[pattern.free].any() else _fixed(pattern, held[pattern.free])
    if mass is None:
        return System(table, material, pattern, None, None, loads, scale, fixed, moments, pressures)
    free = csr_matrix(mass[pattern.free][:, pattern.free])
    return System(table, material, pattern, free, mass_values(free, pattern), loads, scale, fixed, moments, pressures)


def _fixed(pattern: Pattern, mask: np.ndarray) -> Fixed:
    """The held components (f, 3) of free nodes in a pattern."""
    held = mask.ravel()
    rows = np.repeat(np.arange(held.size), np.diff(pattern.indptr))
    coupled = (held[rows] | held[pattern.indices]) & (rows != pattern.indices)
    return Fixed(mask, np.flatnonzero(coupled))
