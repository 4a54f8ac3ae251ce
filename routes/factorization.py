"""Factorizations of R_u, by the type of the matrix. Law: A @ solve(b) == b, A.T @ solve_transposed(b) == b."""

from __future__ import annotations

import importlib.util
import warnings
import weakref
from typing import Any, Literal, Protocol

import numpy as np

from problems.chain import Chain, cumulative_sum
from problems.errors import InputError, SingularMatrix
from problems.problem import Array
from problems.sparse import SymmetricSparse

LinearSolver = Literal["auto", "pardiso", "superlu"]
IDLE = 2  # analyses kept for reuse, a pattern


class Factorization(Protocol):
    """Factors of A. name says of which kind, norm is |A|_inf or a bound of it, nbytes what they hold."""

    name: str
    norm: float
    nbytes: int

    def solve(self, b: Array) -> Array:
        """A^{-1} b, (n_u,)."""
        ...

    def solve_transposed(self, b: Array) -> Array:
        """A^{-T} b, (n_u,)."""
        ...


class Factorizer:
    """Makes factorizations; sparse symmetric ones by MKL PARDISO where it is installed, else by SuperLU.

    A pattern is analyzed once: factors that nobody holds any more leave their analysis to the next ones.
    """

    def __init__(self, linear_solver: LinearSolver = "auto") -> None:
        have_pardiso = importlib.util.find_spec("pymklpardiso") is not None
        if linear_solver == "pardiso" and not have_pardiso:
            raise InputError("linear solver pardiso: py-mkl-pardiso is not installed - pip install it or take superlu")
        self.pardiso = have_pardiso and linear_solver != "superlu"
        self._idle: weakref.WeakKeyDictionary[Any, dict[int, list[Any]]] = weakref.WeakKeyDictionary()

    def __call__(self, A: Any, who: str) -> Factorization:
        """Factorize A: a Chain, a SymmetricSparse, a dense array or a SciPy sparse matrix. Raises SingularMatrix."""
        if isinstance(A, Chain):
            return ChainFactorization(A, who)
        if isinstance(A, SymmetricSparse):
            return self._symmetric(A, who) if self.pardiso else SparseFactorization(A.full(), who)
        if isinstance(A, np.ndarray):
            return DenseFactorization(A, who)
        return SparseFactorization(A, who)

    def _symmetric(self, A: SymmetricSparse, who: str) -> Factorization:
        idle = self._idle.setdefault(A.pattern, {})
        if np.iscomplexobj(A.data):
            return PardisoFactorization(A, who, "complex L D L^T", COMPLEX_SYMMETRIC, idle)
        try:
            return PardisoFactorization(A, who, "L L^T", POSITIVE_DEFINITE, idle)
        except SingularMatrix:  # not positive definite: a buckled state, say
            return PardisoFactorization(A, who, "L D L^T", SYMMETRIC, idle)


class ChainFactorization:
    """K = B^T D B is its own factorization: K^{-1} b = B^{-1} D^{-1} B^{-T} b, two cumulative sums."""

    name = "cumulative sums"

    def __init__(self, K: Chain, who: str) -> None:
        bad = np.flatnonzero(~(K.D.real > 0))
        if bad.size:
            e = int(bad[0])
            raise SingularMatrix(f"{who}: stiffness {K.D[e]:g} of element {e + 1} is not positive - check its modulus")
        self.D = K.D
        self.norm, self.nbytes = K.norm, K.D.nbytes

    def solve(self, b: Array) -> Array:
        forces = cumulative_sum(b[::-1])[::-1]  # B^{-T} b: what hangs behind each element
        return cumulative_sum(forces / self.D)

    solve_transposed = solve


class DenseFactorization:
    """P A = L U of LAPACK."""

    name = "LAPACK L U"

    def __init__(self, A: Array, who: str) -> None:
        from scipy.linalg import LinAlgWarning, lu_factor

        with warnings.catch_warnings():
            warnings.simplefilter("error", LinAlgWarning)
            try:
                self.lu = lu_factor(A)
            except (LinAlgWarning, ValueError) as error:
                raise SingularMatrix(f"{who}: R_u ({len(A)} x {len(A)}): {error} - check the constraints") from error
        self.norm, self.nbytes = float(np.abs(A).sum(axis=1).max()), A.nbytes

    def solve(self, b: Array) -> Array:
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self.lu, b))

    def solve_transposed(self, b: Array) -> Array:
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self.lu, b, trans=1))


class SparseFactorization:
    """SuperLU's P_r A P_c = L U."""

    name = "SuperLU L U"

    def __init__(self, A: Any, who: str) -> None:
        from scipy.sparse.linalg import splu

        try:
            self.lu: Any = splu(A.tocsc())
        except RuntimeError as error:
            raise SingularMatrix(f"{who}: R_u ({A.shape[0]} unknowns): {error} - check the constraints") from error
        self.norm = float(abs(A).sum(axis=1).max())
        self.nbytes = self.lu.nnz * (A.dtype.itemsize + 4)  # entries and their row numbers

    def solve(self, b: Array) -> Array:
        return np.asarray(self.lu.solve(b))

    def solve_transposed(self, b: Array) -> Array:
        return np.asarray(self.lu.solve(b, "T"))


POSITIVE_DEFINITE, SYMMETRIC, COMPLEX_SYMMETRIC = 2, -2, 6  # PARDISO's matrix types


class PardisoFactorization:
    """Sparse factors of a symmetric matrix by MKL PARDISO; not Hermitian where complex."""

    def __init__(self, A: SymmetricSparse, who: str, kind: str, mtype: int, idle: dict[int, list[Any]]) -> None:
        from pymklpardiso import PardisoSolver

        waiting = idle.setdefault(mtype, [])
        try:
            if waiting:
                self.solver = waiting.pop()
                self.solver.refactor(A.data)
            else:
                self.solver = PardisoSolver(A.upper, mtype)
        except RuntimeError as error:
            raise SingularMatrix(f"{who}: R_u ({A.pattern.n} unknowns) has no {kind}: {error} - check p") from error
        self.name = f"PARDISO {kind}"
        self.norm = A.norm
        self.nbytes = 1024 * sum(self.solver.get_iparm_value(i) for i in (15, 16))  # analysis, factors
        weakref.finalize(self, _keep, waiting, self.solver)

    def solve(self, b: Array) -> Array:
        return np.asarray(self.solver.solve(np.ascontiguousarray(b, dtype=self._dtype)))

    solve_transposed = solve

    @property
    def _dtype(self) -> Any:
        return np.complex128 if self.solver.mtype == COMPLEX_SYMMETRIC else np.float64


def _keep(waiting: list[Any], solver: Any) -> None:
    if len(waiting) < IDLE:
        waiting.append(solver)
