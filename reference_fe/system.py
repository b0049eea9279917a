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
    from reference_fe.rim import Rim


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
    contact: with obstacles; rim: what holds edges and moves, its components fixed ones but for those that it ties.
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
    rim: Rim | None = None

    @property
    def unknowns(self) -> int:
        """Number of displacement components to find; those that a rim ties are one."""
        tied = 0 if self.rim is None else int(self.rim.tied.sum()) - len(self.rim.free)
        return 3 * self.pattern.free.size - tied - (0 if self.fixed is None else int(self.fixed.mask.sum()))

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
        return self.balanced(force[self.pattern.free])

    def balanced(self, own: np.ndarray) -> np.ndarray:
        """Forces (f, 3) on free nodes without those on held components, a rim's summed."""
        if self.fixed is not None:
            own[self.fixed.mask] = 0.0
        return own if self.rim is None else self.rim.summed(own)

    def acting(self, u: np.ndarray, time: float) -> np.ndarray:
        """All loads (f, 3) in N, dead and following, those on held components included."""
        return (self.loads(time) + self._following(self.expand(u), time))[self.pattern.free]

    def residual(self, u: np.ndarray, time: float) -> np.ndarray:
        """Internal force less all loads (f, 3), on held components too."""
        force, _ = internal_force(self.table, self.material, self.expand(u))
        return force[self.pattern.free] - self.acting(u, time)

    def applied(self, time: float) -> np.ndarray:
        """Dead forces (f, 3) in N at a time (s)."""
        return self.free(self.loads(time))

    def following(self, u: np.ndarray, time: float) -> np.ndarray:
        """Forces (f, 3) in N of what follows the motion: moments turn with their edges, pressures with their faces."""
        return self.free(self._following(self.expand(u), time))

    def _following(self, full: np.ndarray, time: float) -> np.ndarray:
        """The same on all nodes (n, 3)."""
        forces = [moment.at(full, time)[0] for moment in self.moments]
        forces += [pressure.force(full, time) for pressure in self.pressures]
        return sum(forces, np.zeros_like(full))

    def inertia(self, a: np.ndarray) -> np.ndarray:
        """Force (f, 3) in N that the acceleration (f, 3) takes."""
        return self.balanced(self.inertia_everywhere(a))

    def inertia_everywhere(self, a: np.ndarray) -> np.ndarray:
        """The same with that on held components."""
        force = self.mass @ a
        return force if self.rim is None else force + self.rim.inertia(a)

    def kinetic(self, v: np.ndarray) -> float:
        """Kinetic energy (J) of velocities (f, 3)."""
        return 0.5 * float(np.sum(v * (self.mass @ v if self.rim is None else self.inertia_everywhere(v))))

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
        if self.rim is not None:
            return self._solve_tied_mass(force)
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

    def _solve_tied_mass(self, force: np.ndarray) -> np.ndarray:
        """The same where a rim couples the components of nodes."""
        solver = self.memory().solver
        solver.factorise(self._without_fixed(self.mass_values.copy()))
        acceleration = solver.solve(force.ravel()).reshape(-1, 3)
        solver.close()
        return acceleration

    def memory(self) -> Memory:
        """A fresh factorisation memory for this system's pattern."""
        where = self.pattern
        if self.rim is not None and self.rim.free:
            from reference_fe.rim import TiedSolver

            return Memory(TiedSolver(where, self.rim.groups()), diagonal=where.indptr[:-1])
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
    rim: Rim | None = None,
) -> System:
    """System from a mesh's table and pattern and its scalar mass (n, n) on all nodes.

    held (n, 3): components without motion; the pattern leaves out the nodes where none moves.
    """
    mask = np.zeros((pattern.free.size, 3), dtype=bool) if held is None else held[pattern.free]
    mask = mask if rim is None else mask | rim.held
    fixed = _fixed(pattern, mask) if mask.any() else None
    acting = loads, scale, fixed, moments, pressures, None, rim
    if mass is None:
        return System(table, material, pattern, None, None, *acting)
    free = csr_matrix(mass[pattern.free][:, pattern.free])
    values = mass_values(free, pattern)
    if rim is not None and rim.free:
        values[pattern.indptr[[group[0] for group in rim.groups()]]] += rim.mass
    return System(table, material, pattern, free, values, *acting)


def _fixed(pattern: Pattern, mask: np.ndarray) -> Fixed:
    """The held components (f, 3) of free nodes in a pattern."""
    held = mask.ravel()
    rows = np.repeat(np.arange(held.size), np.diff(pattern.indptr))
    coupled = (held[rows] | held[pattern.indices]) & (rows != pattern.indices)
    return Fixed(mask, np.flatnonzero(coupled))
