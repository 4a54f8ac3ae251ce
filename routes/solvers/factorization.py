"""Factorizations of R_u, by the type of the matrix. Law: A @ solve(b) == b, A.T @ solve_transposed(b) == b."""

from __future__ import annotations

import importlib.util
import warnings
import weakref
from collections.abc import Callable
from copy import copy
from typing import Any, Literal, Protocol

import numpy as np

from gradient_routes.problems.errors import InputError, SingularMatrix
from gradient_routes.problems.matrices.sparse import BlockDiagonal, GeneralSparse, SymmetricSparse
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.iterative import IterativeFactorization, Kind
from gradient_routes.routes.solvers.pardiso import (
    COMPLEX_GENERAL,
    COMPLEX_SYMMETRIC,
    GENERAL,
    POSITIVE_DEFINITE,
    REGULAR,
    SYMMETRIC,
    Idle,
    PardisoFactorization,
    solution_error,
)
from gradient_routes.routes.solvers.tridiagonal import BorderedFactorization, ChainFactorization

LinearSolver = Literal["auto", "pardiso", "superlu", "cg-amg", "krylov", "descent"]


class Factorization(Protocol):
    """Factors of A. name says of which kind, norm is |A|_inf or a bound of it, nbytes what they hold."""

    name: str
    norm: float

    @property
    def nbytes(self) -> int: ...

    def solve(self, b: Array) -> Array:
        """A^{-1} b, (n_u,)."""
        ...

    def solve_transposed(self, b: Array) -> Array:
        """A^{-T} b, (n_u,)."""
        ...


class Factorizer:
    """Makes factorizations; sparse ones by MKL PARDISO where it is installed, else by SuperLU, or by multigrid.

    A pattern is analyzed once: factors that nobody holds any more leave their analysis to the next ones. krylov and
    descent factorize nothing: they iterate, on matrices of every type, until `rtol` is met.
    """

    def __init__(self, linear_solver: LinearSolver = "auto", rtol: float = 1e-12) -> None:
        have_pardiso = importlib.util.find_spec("pymklpardiso") is not None
        if linear_solver == "pardiso" and not have_pardiso:
            raise InputError("linear solver pardiso: py-mkl-pardiso is not installed - pip install it or take superlu")
        self.pardiso = have_pardiso and linear_solver != "superlu"
        self.multigrid = linear_solver == "cg-amg"
        self.iterative: Kind | None = linear_solver if linear_solver in ("krylov", "descent") else None
        self.rtol = rtol
        self._idle: weakref.WeakKeyDictionary[Any, Idle] = weakref.WeakKeyDictionary()

    def __call__(self, A: Any, who: str) -> Factorization:
        """Factorize A: a Chain, Bordered or not, a SymmetricSparse or GeneralSparse, BlockDiagonal of such, a dense
        array or a SciPy sparse matrix. Raises SingularMatrix, and InputError for what cg-amg cannot solve."""
        if isinstance(A, BlockDiagonal):
            return BlockFactorization(A, lambda block: self(block, who))
        if self.iterative is not None:
            return IterativeFactorization(A, who, self.iterative, self.rtol)
        if isinstance(A, Tridiagonal):
            return ChainFactorization(A, who)
        if isinstance(A, BorderedTridiagonal):
            return BorderedFactorization(A, who)
        if isinstance(A, np.ndarray):
            return DenseFactorization(A, who)
        if self.multigrid:
            return self._by_multigrid(A, who)
        if not isinstance(A, SymmetricSparse | GeneralSparse):
            return SparseFactorization(A, who)
        return self._by_pardiso(A, who) if self.pardiso else SparseFactorization(A.full(), who)

    def _by_multigrid(self, A: Any, who: str) -> Factorization:
        from gradient_routes.routes.solvers.multigrid import MultigridFactorization

        if not isinstance(A, SymmetricSparse) or np.iscomplexobj(A.data):
            kind = "complex" if isinstance(A, SymmetricSparse) else "not known to be symmetric"
            raise InputError(f"{who}: cg-amg solves real symmetric systems, R_u is {kind} - take pardiso or superlu")
        return MultigridFactorization(A, who)

    def _by_pardiso(self, A: SymmetricSparse | GeneralSparse, who: str) -> Factorization:
        idle, complex_ = self._idle.setdefault(A.pattern, {}), np.iscomplexobj(A.data)
        if isinstance(A, GeneralSparse):
            return PardisoFactorization(A, who, COMPLEX_GENERAL if complex_ else GENERAL, idle)
        if complex_:
            return PardisoFactorization(A, who, COMPLEX_SYMMETRIC, idle)
        try:
            return PardisoFactorization(A, who, POSITIVE_DEFINITE, idle)
        except SingularMatrix:  # not positive definite: a buckled state, say
            return PardisoFactorization(A, who, SYMMETRIC, idle)


def to_tolerance(factors: Factorization, rtol: float) -> Factorization:
    """The same factors; those that iterate end at rtol |b|_inf."""
    if isinstance(factors, IterativeFactorization):
        return factors.to(rtol)
    return factors.to(rtol) if isinstance(factors, BlockFactorization) else factors


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
                raise SingularMatrix(f"{who}: R_u ({len(A)} x {len(A)}): {error} - check p and the supports") from error
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
            if "SUPERLU_MALLOC" in str(error):
                raise MemoryError(f"factors of R_u ({A.shape[0]} unknowns): {error}") from error
            raise SingularMatrix(f"{who}: R_u ({A.shape[0]} unknowns): {error} - check p and the supports") from error

        self.norm = float(abs(A).sum(axis=1).max())
        missed = solution_error(A, self.solve)
        if not missed < REGULAR:
            raise SingularMatrix(
                f"{who}: R_u ({A.shape[0]} unknowns) is singular: a known solution is missed by {missed:.2g}"
                " - check p and the supports"
            )
        self.nbytes = self.lu.nnz * (A.dtype.itemsize + 4)  # entries and their row numbers

    def solve(self, b: Array) -> Array:
        return np.asarray(self.lu.solve(b))

    def solve_transposed(self, b: Array) -> Array:
        return np.asarray(self.lu.solve(b, "T"))


class BlockFactorization:
    """Factors of diag(A_1, ..., A_c), one factorization a block."""

    def __init__(self, A: BlockDiagonal, factorize: Callable[[Any], Factorization]) -> None:
        self._split = A.split
        self.blocks = tuple(factorize(block) for block in A.blocks)
        self.name = " + ".join(dict.fromkeys(block.name for block in self.blocks))
        self.norm = max(block.norm for block in self.blocks)

    def to(self, rtol: float) -> BlockFactorization:
        """See to_tolerance."""
        other = copy(self)
        other.blocks = tuple(to_tolerance(block, rtol) for block in self.blocks)
        return other

    @property
    def nbytes(self) -> int:
        return sum(block.nbytes for block in self.blocks)

    def solve(self, b: Array) -> Array:
        return np.concatenate([f.solve(part) for f, part in zip(self.blocks, self._split(b), strict=True)])

    def solve_transposed(self, b: Array) -> Array:
        return np.concatenate([f.solve_transposed(part) for f, part in zip(self.blocks, self._split(b), strict=True)])
