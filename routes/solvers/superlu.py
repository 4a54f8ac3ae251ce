"""Sparse factors by SuperLU, which SciPy brings along."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.sparse import GeneralSparse, SymmetricSparse
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization, Factorize, LinearSolver

REGULAR = 1e-2  # error of a solution that was known before; a regular matrix leaves eps times its condition number
GROWTH = 1e8  # of entries in L D L^T without pivoting, beyond which signs of D are not trusted


class SparseFactorization(Factorization):
    """P_r A P_c = L U of a SymmetricSparse, a GeneralSparse or a SciPy sparse matrix."""

    name = "SuperLU L U"

    def __init__(self, A: Any, who: str) -> None:
        from scipy.sparse.linalg import splu

        self._symmetric = isinstance(A, SymmetricSparse) and not np.iscomplexobj(A.data)
        A = A.full() if isinstance(A, SymmetricSparse | GeneralSparse) else A.tocsc()
        try:
            self.lu: Any = splu(A)
        except RuntimeError as error:
            if "SUPERLU_MALLOC" in str(error):
                raise MemoryError(f"factors of R_u ({A.shape[0]} unknowns): {error}") from error
            raise SingularMatrix(f"{who}: R_u ({A.shape[0]} unknowns): {error} - check p and the supports") from error
        self.norm, self._A = float(abs(A).sum(axis=1).max()), A
        missed = solution_error(A, self.solve)
        if not missed < REGULAR:
            raise SingularMatrix(
                f"{who}: R_u ({A.shape[0]} unknowns) is singular: a known solution is missed by {missed:.2g}"
                " - check p and the supports"
            )

    @property
    def nbytes(self) -> int:
        return int(self.lu.nnz * (self._A.dtype.itemsize + 4))  # entries and their row numbers

    def substitute(self, b: Array, transposed: bool) -> Array:
        if np.iscomplexobj(b) and not np.iscomplexobj(self._A.data):  # R_u need not depend on p
            return self.substitute(b.real, transposed) + 1j * self.substitute(b.imag, transposed)
        return np.asarray(self.lu.solve(b, "T" if transposed else "N"))

    @property
    def negative_eigenvalues(self) -> int | None:
        """By a second factorization with pivots on the diagonal, P A P^T = L D L^T: the signs of D."""
        from scipy.sparse.linalg import splu

        if not self._symmetric:
            return None
        try:
            lu = splu(self._A, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:  # a zero on the diagonal
            return None
        if not np.array_equal(lu.perm_r, lu.perm_c) or abs(lu.L).max() > GROWTH:
            return None
        return int((lu.U.diagonal() < 0.0).sum())


def solution_error(A: Any, solve: Callable[[Array], Array]) -> float:
    """|x - x_0|_inf for A x = A x_0 with a known x_0, |x_0|_inf = 1."""
    x = np.cos(np.arange(A.shape[0]))
    return float(np.abs(solve(A @ x) - x).max(initial=0.0))


def is_sparse(A: Any) -> bool:
    """Whether A is neither dense nor tridiagonal."""
    return not isinstance(A, Tridiagonal | BorderedTridiagonal | np.ndarray)


def start(rtol: float) -> Factorize:
    return SparseFactorization


superlu = LinearSolver("superlu", start, takes=is_sparse)
