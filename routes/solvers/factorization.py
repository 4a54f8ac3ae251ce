"""Factorizations of R_u: by the linear solver that was chosen, or by the structure of the matrix."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.matrices.sparse import BlockDiagonal
from gradient_routes.problems.matrices.step_matrix import Banded, StepMatrix
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.recurrence import RecurrenceFactorization
from gradient_routes.routes.solvers.registry import DEFAULT, linear_solver
from gradient_routes.routes.solvers.solver import Factorization
from gradient_routes.routes.solvers.step_factorization import BandedFactorization, StepFactorization
from gradient_routes.routes.solvers.superlu import SparseFactorization
from gradient_routes.routes.solvers.tridiagonal import BorderedFactorization, TridiagonalFactorization


class Factorizer:
    """Makes factorizations: of each block of a block-diagonal matrix, by the solver named where it takes the matrix,
    else by the matrix's structure. Solvers that iterate end at `rtol`.
    """

    def __init__(self, name: str = DEFAULT, rtol: float = 1e-12) -> None:
        self.solver = linear_solver(name)
        self._factorize = self.solver.start(rtol)

    def __call__(self, A: Any, who: str) -> Factorization:
        """Factorize A: tridiagonal, bordered or not, SymmetricSparse or GeneralSparse, BlockDiagonal of such, a dense
        array or a SciPy sparse matrix. Raises SingularMatrix, and InputError for what the solver cannot solve."""
        if isinstance(A, BlockDiagonal):
            return BlockFactorization(A, lambda block: self(block, who))
        if isinstance(A, Recurrence):
            return RecurrenceFactorization(A, lambda block: self(block, who), who)
        if isinstance(A, StepMatrix):
            return StepFactorization(A, lambda block: self(block, who))
        if isinstance(A, Banded):
            return BandedFactorization(A, who) if len(A.main) > 2 else DenseFactorization(A.dense, who)
        if self.solver.takes(A):
            return self._factorize(A, who)
        if isinstance(A, Tridiagonal):
            return TridiagonalFactorization(A, who)
        if isinstance(A, BorderedTridiagonal):
            return BorderedFactorization(A, who)
        return DenseFactorization(A, who) if isinstance(A, np.ndarray) else SparseFactorization(A, who)


class DenseFactorization(Factorization):
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
        self.norm, self._A = float(np.abs(A).sum(axis=1).max()), A

    @property
    def nbytes(self) -> int:
        return self._A.nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self.lu, b, trans=1 if transposed else 0, check_finite=False))

    @property
    def negative_eigenvalues(self) -> int | None:
        """By L D L^T of Bunch & Kaufman, D being block diagonal with blocks up to 2 x 2: pivots of L U do not tell."""
        from scipy.linalg import eigvalsh_tridiagonal, ldl

        A = self._A
        if np.iscomplexobj(A) or not np.allclose(A, A.T, rtol=1e-12, atol=0.0):
            return None
        D = ldl(A)[1]
        return int((eigvalsh_tridiagonal(np.diag(D), np.diag(D, -1)) < 0.0).sum())


class BlockFactorization(Factorization):
    """Factors of diag(A_1, ..., A_c), one factorization a block."""

    def __init__(self, A: BlockDiagonal, factorize: Callable[[Any], Factorization]) -> None:
        self._split = A.split
        self.blocks = tuple(factorize(block) for block in A.blocks)
        self.name = " + ".join(dict.fromkeys(block.name for block in self.blocks))
        self.norm = max(block.norm for block in self.blocks)

    def to(self, rtol: float) -> BlockFactorization:
        other = copy(self)
        other.blocks = tuple(block.to(rtol) for block in self.blocks)
        return other

    @property
    def nbytes(self) -> int:
        return sum(block.nbytes for block in self.blocks)

    def substitute(self, b: Array, transposed: bool) -> Array:
        parts = zip(self.blocks, self._split(b), strict=True)
        return np.concatenate([block.substitute(part, transposed) for block, part in parts])

    @property
    def negative_eigenvalues(self) -> int | None:
        counts = [block.negative_eigenvalues for block in self.blocks]
        return None if None in counts else sum(count for count in counts if count is not None)


class Deferred(Factorization):
    """Factors that are made when they are first asked for."""

    def __init__(self, norm: float, make: Callable[[], Factorization]) -> None:
        self.norm, self._make = norm, make

    @cached_property
    def _made(self) -> Factorization:
        return self._make()

    @property
    def name(self) -> str:  # type: ignore[override]
        return self._made.name

    @property
    def nbytes(self) -> int:
        return self._made.nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        return self._made.substitute(b, transposed)
