"""Factorizations of R_u, by the type of the matrix. Law: A @ solve(b) == b, A.T @ solve_transposed(b) == b."""

from __future__ import annotations

import warnings
from typing import Any, Protocol

import numpy as np

from problems.chain import Chain, cumulative_sum
from problems.errors import SingularMatrix
from problems.problem import Array
from problems.sparse import SymmetricSparse


class Factorization(Protocol):
    """Factors of A. norm is |A|_inf or a bound of it."""

    norm: float

    def solve(self, b: Array) -> Array:
        """A^{-1} b, (n_u,)."""
        ...

    def solve_transposed(self, b: Array) -> Array:
        """A^{-T} b, (n_u,)."""
        ...


def factorize(A: Any, who: str) -> Factorization:
    """Factorize A: a Chain, a dense array or a SciPy sparse matrix. Raises SingularMatrix."""
    if isinstance(A, Chain):
        return ChainFactorization(A, who)
    if isinstance(A, SymmetricSparse):
        return PardisoFactorization(A, who)
    if isinstance(A, np.ndarray):
        return DenseFactorization(A, who)
    return SparseFactorization(A, who)


class ChainFactorization:
    """K = B^T D B is its own factorization: K^{-1} b = B^{-1} D^{-1} B^{-T} b, two cumulative sums."""

    def __init__(self, K: Chain, who: str) -> None:
        bad = np.flatnonzero(~(K.D.real > 0))
        if bad.size:
            e = int(bad[0])
            raise SingularMatrix(f"{who}: stiffness {K.D[e]:g} of element {e + 1} is not positive - check its modulus")
        self.D = K.D
        self.norm = K.norm

    def solve(self, b: Array) -> Array:
        forces = cumulative_sum(b[::-1])[::-1]  # B^{-T} b: what hangs behind each element
        return cumulative_sum(forces / self.D)

    solve_transposed = solve


class DenseFactorization:
    """P A = L U of LAPACK."""

    def __init__(self, A: Array, who: str) -> None:
        from scipy.linalg import LinAlgWarning, lu_factor

        with warnings.catch_warnings():
            warnings.simplefilter("error", LinAlgWarning)
            try:
                self.lu = lu_factor(A)
            except (LinAlgWarning, ValueError) as error:
                raise SingularMatrix(f"{who}: R_u ({len(A)} x {len(A)}): {error} - check the constraints") from error
        self.norm = float(np.abs(A).sum(axis=1).max())

    def solve(self, b: Array) -> Array:
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self.lu, b))

    def solve_transposed(self, b: Array) -> Array:
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self.lu, b, trans=1))


class SparseFactorization:
    """SuperLU's P_r A P_c = L U."""

    def __init__(self, A: Any, who: str) -> None:
        from scipy.sparse.linalg import splu

        try:
            self.lu: Any = splu(A.tocsc())
        except RuntimeError as error:
            raise SingularMatrix(f"{who}: R_u ({A.shape[0]} unknowns): {error} - check the constraints") from error
        self.norm = float(abs(A).sum(axis=1).max())

    def solve(self, b: Array) -> Array:
        return np.asarray(self.lu.solve(b))

    def solve_transposed(self, b: Array) -> Array:
        return np.asarray(self.lu.solve(b, "T"))


class PardisoFactorization:
    """A = L L^T of MKL PARDISO."""

    def __init__(self, A: SymmetricSparse, who: str) -> None:
        import pymklpardiso as pardiso

        mtype = pardiso.MTYPE_COMPLEX_SYM if np.iscomplexobj(A.data) else pardiso.MTYPE_REAL_SYM_POSDEF
        try:
            self.solver = pardiso.PardisoSolver(A.upper, mtype)
        except RuntimeError as error:
            raise SingularMatrix(f"{who}: R_u ({A.shape[0]} unknowns): {error} - check the constraints") from error
        self.norm = A.norm

    def solve(self, b: Array) -> Array:
        return np.asarray(self.solver.solve(b))

    solve_transposed = solve
