"""A linear solver in one file: Cholesky factors of a dense, symmetric positive definite R_u by LAPACK."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization, Factorize, LinearSolver


class DenseCholesky(Factorization):
    """A = L L^T."""

    name = "LAPACK L L^T"

    def __init__(self, A: Array, who: str) -> None:
        try:
            self.factor = cho_factor(A, lower=True)
        except LinAlgError as error:
            raise SingularMatrix(f"{who}: R_u ({len(A)} x {len(A)}): {error} - check p") from error
        self.norm = float(np.abs(A).sum(axis=1).max())

    @property
    def nbytes(self) -> int:
        return self.factor[0].nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        return cho_solve(self.factor, b)

    @property
    def negative_eigenvalues(self) -> int:
        return 0


def start(rtol: float) -> Factorize:
    return DenseCholesky


def takes(A: object) -> bool:
    return isinstance(A, np.ndarray) and not np.iscomplexobj(A)


dense_cholesky = LinearSolver("dense-cholesky", start, takes)
