"""Direct solution of K x = b for the sparse matrices of one symmetric pattern, positive definite or not.

The node numbering of a mesh keeps the band narrow, and within it LAPACK keeps up with sparse codes and
solves faster, which is what reused factors need. Measured on one core of an EPYC with the tangents of n x n
plates (factorise, solve; the first row with enriched elements, the last on a busy machine):

    n =  3,    267 unknowns    banded Cholesky 0.20 ms, 0.016 ms    dense Cholesky 0.27 ms, 0.044 ms
    n = 16, 3,264 unknowns     banded Cholesky 9 ms, 0.3 ms    Pardiso 8 ms, 1.6 ms     SuperLU 29 ms, 0.7 ms
    n = 64, 49,920 unknowns    banded Cholesky 1.9 s, 91 ms    Pardiso 1.0 s, 171 ms    SuperLU 3.8 s, 57 ms

So: banded Cholesky (pbtrf); banded LU (gbtrf) where it meets an indefinite matrix, or one that is not symmetric;
SuperLU for bands too wide to store.
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
ROUND_OFF = 1e-15
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

    def factorise(self, data: np.ndarray, upper: np.ndarray | None = None) -> Solve:
        """Function that solves K x = b (n,) for the lower triangle `data`. Raises SingularMatrix.

        upper: the lower triangle of the transposed matrix, where K is not symmetric.
        """
        if not np.all(np.isfinite(data)):
            raise SingularMatrix("the matrix is not finite")
        if self.bandwidth > WIDEST_BAND:
            return self._sparse(data, upper)
        if upper is not None:
            return self._banded_lu(data, upper)
        return self._cholesky(data) or self._banded_lu(data)

    def _cholesky(self, data: np.ndarray) -> Solve | None:
        """None where the matrix is not positive definite."""
        band = np.zeros((self.bandwidth + 1) * self.pattern.n)
        band[self._places] = data
        band = band.reshape(self.bandwidth + 1, self.pattern.n, order="F")
        factor, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if info:
            return None
        _require_pivots(factor[0] ** 2)
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
            return spl.splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from error


def _require_pivots(pivots: np.ndarray) -> None:
    """Raises SingularMatrix where a pivot is round-off of the largest one."""
    if not pivots.min() > ROUND_OFF * pivots.max():
        raise SingularMatrix(f"smallest pivot {pivots.min():.3g} of {pivots.max():.3g}")
