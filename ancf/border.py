"""Direct solution where unknowns are tied in groups, each of which moves as one: a border around a banded matrix.

With x the unknowns that are not tied and y one for each group, the matrix and its factors are

    [ K   B ] [x]   [a]
    [ B'  C ] [y] = [b],    S = C - B' K^-1 B,    S y = b - B' K^-1 a,    K x = a - B y.

K keeps the narrow band of the mesh; a group that is tied all along an edge would fill it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ancf.assembly import Pattern
from ancf.linear_solver import LinearSolver, SingularMatrix, Solve
from ancf.system import System

LEAST = 1e-12  # of the border's own stiffness: what is left of it by round-off where nothing holds the groups


class BorderedSolver:
    """As `LinearSolver`, for a pattern of unknowns (u,) some of which are tied.

    groups: unknowns of each. A right side has a group's sum at any of them; a solution is the same at all of them.
    """

    def __init__(self, pattern: Pattern, groups: Sequence[np.ndarray]):
        self.groups = groups
        self.group_of = np.full(pattern.n, -1)
        for k, group in enumerate(groups):
            self.group_of[group] = k
        self.inner = np.flatnonzero(self.group_of < 0)
        number = np.full(pattern.n, -1)
        number[self.inner] = np.arange(len(self.inner))
        self.row, self.column = pattern.indices, np.repeat(np.arange(pattern.n), np.diff(pattern.indptr))
        self.number, tied = number, self.group_of >= 0
        self.within = np.flatnonzero(~tied[self.row] & ~tied[self.column])
        self.beside = np.flatnonzero(tied[self.row] != tied[self.column])
        self.corner = np.flatnonzero(tied[self.row] & tied[self.column])
        counts = np.bincount(number[self.column[self.within]], minlength=len(self.inner))
        indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        self.solver = LinearSolver(Pattern(indptr, number[self.row[self.within]].astype(np.int32)))

    @property
    def bandwidth(self) -> int:
        """That of the matrix without its border."""
        return self.solver.bandwidth

    def factorise(self, data: np.ndarray, upper: np.ndarray | None = None) -> Solve:
        """As `LinearSolver.factorise`."""
        other = data if upper is None else upper
        solve = self.solver.factorise(data[self.within], None if upper is None else upper[self.within])
        B, B_t = self._border(data, other), self._border(other, data)
        X = np.column_stack([solve(column) for column in B.T])
        C = self._corner(data, other)
        S = C - B_t.T @ X
        if not np.linalg.svd(S, compute_uv=False).min() > LEAST * np.abs(C).max():
            raise SingularMatrix("nothing holds what is tied")
        inverse = np.linalg.inv(S)

        def solved(b: np.ndarray) -> np.ndarray:
            first = solve(b[self.inner])
            y = inverse @ (np.array([b[group].sum() for group in self.groups]) - B_t.T @ first)
            found = np.empty_like(b)
            found[self.inner] = first - X @ y
            for group, value in zip(self.groups, y, strict=True):
                found[group] = value
            return found

        return solved

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the values beside the border: whether the row is the tied one, and where each goes in B."""
        row, column = self.row[self.beside], self.column[self.beside]
        is_row = self.group_of[row] >= 0
        inner, tied = np.where(is_row, column, row), np.where(is_row, row, column)
        return is_row, self.number[inner] * len(self.groups) + self.group_of[tied]

    def _border(self, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """B (x, groups) of the values (nnz,) of a lower triangle and of its transpose's."""
        is_row, place = self._places
        values = np.where(is_row, upper[self.beside], lower[self.beside])
        size = len(self.inner) * len(self.groups)
        return np.bincount(place, values, size).reshape(len(self.inner), len(self.groups))

    def _corner(self, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """C (groups, groups)."""
        row, column = self.row[self.corner], self.column[self.corner]
        C = np.zeros((len(self.groups),) * 2)
        np.add.at(C, (self.group_of[row], self.group_of[column]), lower[self.corner])
        apart = row != column
        np.add.at(C, (self.group_of[column], self.group_of[row]), np.where(apart, upper[self.corner], 0.0))
        return C


def bordered(system: System) -> BorderedSolver:
    """For the tangents of a system whose rim is free."""
    pattern, rim = system.assembly.pattern, system.rim
    tied = [rim.tied & (np.arange(len(rim.tied)) % 3 == a) for a in rim.free]
    return BorderedSolver(pattern, [system.assembly.unknown_of[own] for own in tied])
