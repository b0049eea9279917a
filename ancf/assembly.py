"""Element arrays summed into global arrays; every index is computed once.

The unknowns are the free components of the nodal vectors, in their order. Symmetric matrices keep
their lower triangle, column by column (the CSC layout).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from ancf.packing import SPAN, packing, pairs


def entry_keys(indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Keys column n + row (nnz,) of the entries of a CSC matrix of n columns."""
    n = len(indptr) - 1
    return np.repeat(np.arange(n, dtype=np.int64), np.diff(indptr)) * n + indices


@dataclass(frozen=True, eq=False)
class Pattern:
    """Lower triangle of a symmetric matrix of n unknowns: CSC arrays indptr (n + 1,) and indices (nnz,)."""

    indptr: np.ndarray
    indices: np.ndarray

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.indptr) - 1

    @cached_property
    def keys(self) -> np.ndarray:
        """Keys column n + row (nnz,) of the entries, ascending."""
        return entry_keys(self.indptr, self.indices)

    def lower(self, data: np.ndarray) -> sp.csc_matrix:
        """Sparse lower triangle with the values data (nnz,)."""
        return sp.csc_matrix((data, self.indices, self.indptr), shape=(self.n, self.n))

    def full(self, data: np.ndarray, upper: np.ndarray | None = None) -> sp.csc_matrix:
        """Sparse matrix with the values data (nnz,), symmetric unless `upper` has those of its transpose."""
        lower = self.lower(data)
        other = lower if upper is None else self.lower(upper)
        return (lower + sp.tril(other, -1).T).tocsc()


@dataclass(frozen=True, eq=False)
class Target:
    """Where a span's packed tangents go: `slots` within the range `values` of the pattern's values.

    Entries of held components go to the slot `count`, which is dropped.
    """

    values: slice
    count: int
    slots: np.ndarray


@dataclass(frozen=True, eq=False)
class Assembly:
    """Where the entries of element arrays go.

    connectivity (e, i). unknown_of (3 v,): number of each component, -1 where it is held.
    free (u,): component of each unknown.
    """

    connectivity: np.ndarray
    unknown_of: np.ndarray
    free: np.ndarray
    pattern: Pattern
    targets: tuple[Target, ...]

    def gather(self, q: np.ndarray) -> np.ndarray:
        """Nodal vectors by element (e, i, 3) of the components q (3 v,)."""
        return q.reshape(-1, 3).take(self.connectivity, axis=0)

    def vector(self, force: np.ndarray) -> np.ndarray:
        """Sum of element vectors (e, i, 3) by component (3 v,)."""
        return np.bincount(self._components, force.ravel(), len(self.unknown_of))

    @cached_property
    def _components(self) -> np.ndarray:
        """Component (e i 3,) of each entry of element vectors."""
        return (3 * self.connectivity[..., None] + np.arange(3)).ravel()

    def matrix(self, spans) -> np.ndarray:
        """Values (nnz,) of the sum of packed element tangents, span by span."""
        data = np.zeros(len(self.pattern.indices))
        for packed, target in zip(spans, self.targets, strict=True):
            data[target.values] += np.bincount(target.slots, packed, target.count + 1)[: target.count]
        return data


def couple(sums: Assembly, row: np.ndarray, block: np.ndarray, data: np.ndarray) -> None:
    """Add block (3, 3) x row_i row_j, symmetric, to the values (nnz,); row (v,) is zero beside a set `coupled`."""
    own = np.flatnonzero(row)
    unknown = sums.unknown_of.reshape(-1, 3)[own].ravel()
    values = np.kron(np.outer(row[own], row[own]), block)
    column, line = np.broadcast_arrays(unknown, unknown[:, None])
    lower = (column >= 0) & (line >= column)
    keys, n = sums.pattern.keys, sums.pattern.n
    data[np.searchsorted(keys, column[lower] * n + line[lower])] += values[lower]


@dataclass(frozen=True, eq=False)
class MixedAssembly:
    """Assembly of groups of elements with unequally many functions, on one pattern; see `Assembly`."""

    groups: tuple[Assembly, ...]
    unknown_of: np.ndarray
    free: np.ndarray
    pattern: Pattern

    def gather(self, q: np.ndarray) -> list[np.ndarray]:
        """Nodal vectors of each group (e, i, 3)."""
        return [group.gather(q) for group in self.groups]

    def vector(self, force: Iterable[np.ndarray]) -> np.ndarray:
        """Sum of the groups' element vectors (e, i, 3) by component (3 v,)."""
        return sum(group.vector(own) for group, own in zip(self.groups, force, strict=True))

    def matrix(self, spans: Iterable) -> np.ndarray:
        """Values (nnz,) of the sum of the groups' packed tangents."""
        return sum(group.matrix(own) for group, own in zip(self.groups, spans, strict=True))


def mixed_assembly(
    groups: Sequence[np.ndarray], vectors: int, held: np.ndarray, coupled: Sequence[np.ndarray] = ()
) -> MixedAssembly:
    """Index arrays of groups of elements with the connectivity (e, i) each; else as `assembly`."""
    free, unknown_of = _unknowns(vectors, held)
    keys = np.unique(np.concatenate([_entries(connectivity, unknown_of, coupled) for connectivity in groups]))
    own = tuple(_assembly(connectivity, free, unknown_of, keys) for connectivity in groups)
    return MixedAssembly(own, unknown_of, free, own[0].pattern)


def assembly(connectivity: np.ndarray, vectors: int, held: np.ndarray, coupled: Sequence[np.ndarray] = ()) -> Assembly:
    """Index arrays of a mesh of `vectors` nodal vectors whose components `held` (3 v,) are fixed.

    coupled: sets of nodal vectors that a load couples, each with each.
    """
    free, unknown_of = _unknowns(vectors, held)
    return _assembly(connectivity, free, unknown_of, _entries(connectivity, unknown_of, coupled))


def _unknowns(vectors: int, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Component of each unknown (u,), unknown of each component (3 v,)."""
    free = np.flatnonzero(~held)
    unknown_of = np.full(3 * vectors, -1)
    unknown_of[free] = np.arange(len(free))
    return free, unknown_of


def _assembly(connectivity: np.ndarray, free: np.ndarray, unknown_of: np.ndarray, keys: np.ndarray) -> Assembly:
    """keys: those of the pattern, see `_entries`."""
    n = len(free)
    pattern = Pattern(
        np.searchsorted(keys, np.arange(n + 1, dtype=np.int64) * n).astype(np.int32),
        (keys % max(n, 1)).astype(np.int32),
    )
    starts = range(0, len(connectivity), SPAN)
    targets = tuple(_target(connectivity[start : start + SPAN], unknown_of, keys, n) for start in starts)
    return Assembly(connectivity, unknown_of, free, pattern, targets)


def on_pattern(connectivity: np.ndarray, free: np.ndarray, unknown_of: np.ndarray, pattern: Pattern) -> Assembly:
    """Assembly of further elements on a pattern that has all their entries."""
    return _assembly(connectivity, free, unknown_of, pattern.keys)


def _entries(connectivity: np.ndarray, unknown_of: np.ndarray, coupled: Sequence[np.ndarray]) -> np.ndarray:
    """Sorted distinct keys column n + row of the entries with row >= column."""
    n = int(unknown_of.max()) + 1
    vectors = len(unknown_of) // 3
    pair = pairs(connectivity.shape[1])
    one, other = connectivity[:, pair.first].astype(np.int64), connectivity[:, pair.second]
    both = (np.minimum(one, other) * vectors + np.maximum(one, other)).ravel()
    more = [(np.sort(group)[:, None] * vectors + np.sort(group))[np.triu_indices(len(group))] for group in coupled]
    both = np.sort(np.concatenate([both, *more]))
    both = both[np.diff(both, prepend=-1) > 0]
    first, second = both // vectors, both % vectors
    u = unknown_of.reshape(-1, 3)
    blocks = np.broadcast_arrays(u[first][:, :, None], u[second][:, None, :])
    column, row = (block.ravel().astype(np.int64) for block in blocks)
    keep = (column >= 0) & (row >= column)
    return np.sort(column[keep] * n + row[keep])


def _target(connectivity: np.ndarray, unknown_of: np.ndarray, keys: np.ndarray, n: int) -> Target:
    """Target of one span."""
    e, i = connectivity.shape
    rows, columns, second = packing(i)
    u = unknown_of.reshape(-1, 3)[connectivity].reshape(e, 3 * i)
    places = []
    for part in (slice(0, second), slice(second, None)):
        r, c = u[:, rows[part]], u[:, columns[part]]
        key = np.minimum(r, c).astype(np.int64) * n + np.maximum(r, c)
        places.append(np.where((r < 0) | (c < 0), -1, np.searchsorted(keys, key)).ravel())
    slots = np.concatenate(places)
    inside = slots[slots >= 0]
    first, last = (int(inside.min()), int(inside.max())) if inside.size else (0, -1)
    count = last + 1 - first
    return Target(slice(first, first + count), count, np.where(slots < 0, count, slots - first))
