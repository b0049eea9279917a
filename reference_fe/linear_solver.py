"""Sparse symmetric indefinite systems, factorised again and again on one pattern.

`direct_solver` chooses MKL Pardiso where pypardiso is installed and SuperLU on a METIS order
elsewhere. Both take the upper triangle in CSR form (sorted columns, diagonal present), analyse the
pattern once, and offer the same three calls: factorise(values), solve(right_hand_side), close().
"""

from __future__ import annotations

import ctypes
import os
from importlib.metadata import PackageNotFoundError, files

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

WORST_CONDITION = 1e14  # plates of slenderness 1000 stay below 1e12, free bodies lie above 1e16


class SingularTangent(RuntimeError):
    """A matrix without an inverse in double precision."""


def direct_solver(indptr: np.ndarray, indices: np.ndarray) -> Pardiso | SuperLU:
    """The fastest solver at hand for matrices whose upper triangle has this CSR pattern."""
    try:
        return Pardiso(indptr, indices)
    except (ImportError, OSError):
        return SuperLU(indptr, indices)


class Pardiso:
    """MKL Pardiso, symmetric indefinite (matrix type -2); needs pypardiso for the library alone.

    pypardiso's own calls analyse anew with every matrix; here the phases 11 (once), 22 and 33 are
    called apart through the function pointer that it loads.
    """

    _analysed = False

    def __init__(self, indptr: np.ndarray, indices: np.ndarray):
        from pypardiso.pardiso_wrapper import PyPardisoSolver

        _tell_where_mkl_is()
        self._handle = PyPardisoSolver(mtype=-2)
        self._rows = np.ascontiguousarray(indptr + 1, dtype=np.int32)
        self._columns = np.ascontiguousarray(indices + 1, dtype=np.int32)
        self._size = indptr.size - 1
        # iparm, counted from 0: own values, METIS, 2 refinement steps where a pivot was perturbed,
        # perturbation below 1e-13 of the norm, Bunch-Kaufman pivots, one-based CSR.
        self._handle.iparm[[0, 1, 7, 9, 20]] = 1, 2, 0, 13, 1

    def _call(self, phase: int, values: np.ndarray, right: np.ndarray, left: np.ndarray) -> int:
        """One Pardiso phase; returns its error code."""
        handle, error = self._handle, ctypes.c_int32(0)
        integer = ctypes.POINTER(ctypes.c_int32)
        real = ctypes.POINTER(ctypes.c_double)

        def one(number: int) -> ctypes.c_int32:
            return ctypes.byref(ctypes.c_int32(number))

        handle._mkl_pardiso(
            handle.pt.ctypes.data_as(ctypes.POINTER(handle._pt_type[0])), one(1), one(1), one(-2), one(phase),
            one(self._size), values.ctypes.data_as(real), self._rows.ctypes.data_as(integer),
            self._columns.ctypes.data_as(integer), handle.perm.ctypes.data_as(integer), one(1),
            handle.iparm.ctypes.data_as(integer), one(0), right.ctypes.data_as(real), left.ctypes.data_as(real),
            ctypes.byref(error),
        )  # fmt: skip
        return error.value

    def factorise(self, values: np.ndarray) -> None:
        """Factorise the matrix with these upper-triangle values (nnz,). Raises SingularTangent."""
        if not np.isfinite(values).all():
            raise SingularTangent("the tangent holds values that are not finite")
        self._values = np.array(values)
        nothing = np.empty(0)
        for phase in (22,) if self._analysed else (11, 22):
            error = self._call(phase, self._values, nothing, nothing)
            if error == -4:
                raise SingularTangent("Pardiso met a zero pivot")
            if error:
                raise MemoryError(f"Pardiso phase {phase} failed with code {error}")
            self._analysed = True
        _refuse_singular(self, self._values, self._size)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (n,) of the last factorised matrix for the right-hand side (n,)."""
        left = np.empty(self._size)
        error = self._call(33, self._values, np.ascontiguousarray(right, dtype=float), left)
        if error or not np.isfinite(left).all():
            raise SingularTangent(f"Pardiso solution failed with code {error}")
        return left

    def close(self) -> None:
        """Give the factor's memory back."""
        if self._analysed:
            self._call(-1, np.empty(0), np.empty(0), np.empty(0))
            self._analysed = False

    __del__ = close


def _tell_where_mkl_is() -> None:
    """Name MKL's library by its own package, unless the environment names one.

    pypardiso would search all installed files for it, 0.14 s of CPU for each solver that is made.
    """
    try:
        found = next((file.locate() for file in files("mkl") or () if "mkl_rt" in file.name), None)
    except PackageNotFoundError:
        return
    if found is not None:
        os.environ.setdefault("PYPARDISO_MKL_RT", str(found))


class SuperLU:
    """SciPy's SuperLU without pivoting on a METIS order that is found once; one refinement step."""

    def __init__(self, indptr: np.ndarray, indices: np.ndarray):
        import pymetis

        size = indptr.size - 1
        upper = csr_matrix((np.arange(1, indices.size + 1), indices, indptr), shape=(size, size))
        full = (upper + upper.T - _diagonal(upper)).tocsr()  # values: where each entry lies in the upper triangle
        graph = (full - _diagonal(full)).tocsr()
        graph.eliminate_zeros()
        order, _ = pymetis.nested_dissection(pymetis.CSRAdjacency(graph.indptr, graph.indices))
        self._order = np.asarray(order)
        ordered = full[self._order][:, self._order].tocsc()
        ordered.sort_indices()
        self._source = ordered.data.astype(np.int64) - 1
        self._matrix = csc_matrix((np.zeros(ordered.nnz), ordered.indices, ordered.indptr), shape=(size, size))
        self._factor = None

    def factorise(self, values: np.ndarray) -> None:
        """Factorise the matrix with these upper-triangle values (nnz,). Raises SingularTangent."""
        if not np.isfinite(values).all():
            raise SingularTangent("the tangent holds values that are not finite")
        self._matrix.data = values[self._source]
        options = {"SymmetricMode": True}
        try:
            self._factor = splu(self._matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options)
        except RuntimeError as error:
            raise SingularTangent(f"SuperLU: {error}") from error
        _refuse_singular(self, values, self._order.size)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution (n,) of the last factorised matrix for the right-hand side (n,)."""
        ordered = right[self._order]
        solution = self._factor.solve(ordered)
        solution += self._factor.solve(ordered - self._matrix @ solution)
        left = np.empty_like(solution)
        left[self._order] = solution
        return left

    def close(self) -> None:
        """Give the factor's memory back."""
        self._factor = None


def _refuse_singular(solver: Pardiso | SuperLU, values: np.ndarray, size: int) -> None:
    """Raise SingularTangent where one solution shows a condition number above WORST_CONDITION."""
    right = np.random.default_rng(0).standard_normal(size)
    condition = np.abs(values).max() * np.abs(solver.solve(right)).max() / np.abs(right).max()
    if not condition < WORST_CONDITION:
        raise SingularTangent(f"the tangent is singular: its condition number is above {condition:.1g}")


def _diagonal(matrix: csr_matrix) -> csr_matrix:
    """The diagonal part of a sparse matrix."""
    size = matrix.shape[0]
    return csr_matrix((matrix.diagonal(), np.arange(size), np.arange(size + 1)), shape=matrix.shape)
