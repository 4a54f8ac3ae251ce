"""A linear solver without factors: conjugate gradients preconditioned by smoothed-aggregation multigrid."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError, NotConverged, SingularMatrix
from gradient_routes.problems.matrices.sparse import SymmetricSparse
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.krylov import conjugate_gradients
from gradient_routes.routes.solvers.solver import Factorization, Factorize, LinearSolver
from gradient_routes.routes.solvers.superlu import is_sparse

RTOL = 1e-13  # |b - A x|_inf / |b|_inf: a tenth of the tolerance of Newton's method and of refined adjoints
AT_MOST = 500  # products


class MultigridFactorization(Factorization):
    """Solves A x = b, A symmetric positive definite, to |b - A x|_inf <= rtol |b|_inf, 1e-13 unless told otherwise.

    The hierarchy (Vanek, Mandel & Brezina 1996; by pyamg) uses the near-kernel of the matrix pattern. A solve raises
    NotConverged where the iteration stalls, SingularMatrix where A turns out not to be positive definite.
    """

    name = "multigrid CG"

    def __init__(self, A: Any, who: str) -> None:
        import pyamg

        if not isinstance(A, SymmetricSparse) or np.iscomplexobj(A.data):
            kind = "complex" if isinstance(A, SymmetricSparse) else "not known to be symmetric"
            raise InputError(f"{who}: cg-amg solves real symmetric systems, R_u is {kind} - take pardiso or superlu")
        self._who, self.rtol = who, RTOL
        bad = np.flatnonzero(~(A.diagonal > 0.0))
        if bad.size:
            raise SingularMatrix(self._indefinite(f"its diagonal has {A.diagonal[bad[0]]:.3g}"))
        self._A = A.full().tocsr()
        levels = pyamg.smoothed_aggregation_solver(
            _blocked(self._A, A.pattern.near_nullspace),
            B=A.pattern.near_nullspace,
            symmetry="symmetric",
            improve_candidates=None,  # these sweeps take longer than the solve and do not shorten it
        )
        self._cycle = levels.aspreconditioner()
        self.norm = A.norm
        self._nbytes = int(levels.operator_complexity() * self._A.nnz * (self._A.dtype.itemsize + 4))

    @property
    def nbytes(self) -> int:
        return self._nbytes

    def to(self, rtol: float) -> MultigridFactorization:
        """The last correction relies on the mean contraction of those before it: a digit more is aimed at."""
        other = copy(self)
        other.rtol = max(RTOL, rtol / 10.0)
        return other

    def substitute(self, b: Array, transposed: bool) -> Array:
        wanted = self.rtol * float(np.abs(b).max(initial=0.0))
        done = conjugate_gradients(
            self._A.__matmul__, self._cycle.__matmul__, b, wanted, at_most=AT_MOST, definite=True, tried=AT_MOST
        )
        if done.breakdown is not None:
            raise SingularMatrix(self._indefinite(done.breakdown))
        if not done.converged:
            stalled = f"{self._who}: multigrid CG stalls: {done.products} products, each |r| x {done.rate:.3g}"
            raise NotConverged(f"{stalled} - take --linear-solver pardiso or superlu", ())
        return done.x

    def _indefinite(self, why: str) -> str:
        return f"{self._who}: R_u is not positive definite ({why}) - take --linear-solver pardiso or superlu"


def _blocked(A: Any, near_nullspace: Array | None) -> Any:
    """A in blocks of the unknowns of a node, where the near-kernel begins with translations along 3 axes, or 2."""
    from scipy.sparse import csr_matrix

    n = A.shape[0]
    A = csr_matrix((A.data, A.indices.astype(np.int32), A.indptr.astype(np.int32)), shape=A.shape)
    d = 0 if near_nullspace is None else {6: 3, 3: 2}.get(near_nullspace.shape[1], 0)  # by rigid-body modes
    if near_nullspace is None or not d or n % d or (near_nullspace[:, :d] != np.tile(np.eye(d), (n // d, 1))).any():
        return A
    return A.tobsr((d, d))


def start(rtol: float) -> Factorize:
    return MultigridFactorization


cg_amg = LinearSolver("cg-amg", start, takes=is_sparse, iterates=True)
