"""Direct solution of K x = b for the sparse matrices of one symmetric pattern, positive definite or not.

The node numbering of a mesh keeps the band narrow, and within it LAPACK keeps up with sparse codes and
solves faster, which is what reused factors need. Measured on one core of an EPYC with the tangents of n x n
plates (factorise, solve; the first row with enriched elements, the last on a busy machine):

    n =  3,    267 unknowns    banded Cholesky 0.20 ms, 0.016 ms    dense Cholesky 0.27 ms, 0.044 ms
    n = 16, 3,264 unknowns     banded Cholesky 9 ms, 0.3 ms    Pardiso 8 ms, 1.6 ms     SuperLU 29 ms, 0.7 ms
    n = 64, 49,920 unknowns    banded Cholesky 1.9 s, 91 ms    Pardiso 1.0 s, 171 ms    SuperLU 3.8 s, 57 ms

So: banded Cholesky (pbtrf); banded LU (gbtrf) where it meets an indefinite matrix, or one that is not symmetric;
SuperLU for bands too wide to store.

Unknowns are positions, gradients and twists: for elements of side a (m) the stiffness of a twist r_xy is about a^4
times that of a position r. So pivots are judged, and rows chosen in LU, as in the matrix scaled to a diagonal of ones,
s_i K_ij s_j with s_i = 1 / sqrt |K_ii|, which is the same for a plate of any size. Cholesky's factors need no scaling:
its pivots are those of the scaled matrix times K_ii, and round-off in each is relative.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse.linalg as spl
from scipy.linalg import lapack

from ancf.assembly import Pattern

WIDEST_BAND = 1000
ROUND_OFF = 1e-14  # of the largest pivot of the scaled matrix; a plate 1e-6 of its side thick has 1e-12
Solve = Callable[[np.ndarray], np.ndarray]


class SingularMatrix(ArithmeticError):
    """The matrix has no inverse to working precision, or is not finite."""


@dataclass(frozen=True, eq=False)
class LinearSolver:
    """Factorises matrices of a fixed symmetric pattern."""

    pattern: Pattern

    @cached_property
    def bandwidth(self) -> int:
        """Number of subdiagonals."""
        return int((self.pattern.indices - self._columns).max(initial=0))

    @cached_property
    def _columns(self) -> np.ndarray:
        return np.repeat(np.arange(self.pattern.n, dtype=np.int32), np.diff(self.pattern.indptr))

    @cached_property
    def _places(self) -> np.ndarray:
        """Place of each value in the band stored column by column."""
        return self._columns.astype(np.intp) * (self.bandwidth + 1) + (self.pattern.indices - self._columns)

    @property
    def _diagonal(self) -> np.ndarray:
        """Place of each column's diagonal value, its first one."""
        return self.pattern.indptr[:-1]

    def factorise(self, data: np.ndarray, upper: np.ndarray | None = None) -> Solve:
        """Function that solves K x = b (n,) for the lower triangle `data`. Raises SingularMatrix.

        upper: the lower triangle of the transposed matrix, where K is not symmetric.
        """
        if not np.all(np.isfinite(data)):
            raise SingularMatrix("the matrix is not finite")
        if self.bandwidth > WIDEST_BAND:
            return self._scaled(self._sparse, data, upper)
        found = self._cholesky(data) if upper is None else None
        return found or self._scaled(self._banded_lu, data, upper)

    def _scaled(self, way: Callable[..., Solve], data: np.ndarray, upper: np.ndarray | None) -> Solve:
        """Solution by a way that factorises the matrix scaled to a diagonal of +-1; zeros there are left."""
        sizes = np.abs(data[self._diagonal])
        scale = 1 / np.sqrt(np.where(sizes > 0, sizes, 1.0))
        by = scale[self.pattern.indices] * scale[self._columns]
        solve = way(data * by, None if upper is None else upper * by)
        return lambda b: (scale * solve((scale * b.T).T).T).T

    def _cholesky(self, data: np.ndarray) -> Solve | None:
        """None where the matrix is not positive definite."""
        band = np.zeros((self.bandwidth + 1) * self.pattern.n)
        band[self._places] = data
        band = band.reshape(self.bandwidth + 1, self.pattern.n, order="F")
        factor, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if info:
            return None
        _require_pivots(factor[0] ** 2 / data[self._diagonal])
        return lambda b: lapack.dpbtrs(factor, b, lower=1)[0]

    def _banded_lu(self, data: np.ndarray, upper: np.ndarray | None = None) -> Solve:
        k = self.bandwidth
        band = np.zeros((3 * k + 1, self.pattern.n), order="F")
        rows, columns = self.pattern.indices, self._columns
        band[2 * k + rows - columns, columns] = data
        band[2 * k + columns - rows, rows] = data if upper is None else upper
        factor, pivots, _ = lapack.dgbtrf(band, k, k, overwrite_ab=1)
        _require_pivots(np.abs(factor[2 * k]))
        return lambda b: lapack.dgbtrs(factor, k, k, b, pivots)[0]

    def _sparse(self, data: np.ndarray, upper: np.ndarray | None = None) -> Solve:
        try:
            matrix = self.pattern.full(data, upper)
            solve = spl.splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from error
        _require_inverse(solve, self.pattern.n)
        return solve


def _require_pivots(pivots: np.ndarray) -> None:
    """Raises SingularMatrix where a pivot is round-off of the largest one; a matrix without rows has none."""
    if len(pivots) and not pivots.min() > ROUND_OFF * pivots.max():
        raise SingularMatrix(f"smallest pivot {pivots.min():.3g} of {pivots.max():.3g}")


def _require_inverse(solve: Solve, n: int) -> None:
    """Raises SingularMatrix where a solution is round-off: pivots of SuperLU are shown with a copy of its factors only.

    An arbitrary right side has its part in every direction, so that its solution is as long as the inverse is large.
    """
    b = np.random.default_rng(0).standard_normal(n)
    growth = np.linalg.norm(solve(b)) / np.linalg.norm(b)
    if not growth < 1 / ROUND_OFF:
        raise SingularMatrix(f"a solution is {growth:.3g} times as large as its right side")
