"""Factors of one step of M u'' + C u' + K u = f."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.step_matrix import StepMatrix
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization


class StepFactorization(Factorization):
    """L U of the Schur complement D - b/a K (LAPACK gttrf, real or complex), of three nodes or more: SciPy's interface
    refuses less.
    """

    name = "LAPACK tridiagonal L U"

    def __init__(self, A: StepMatrix, who: str) -> None:
        from scipy.linalg.lapack import get_lapack_funcs

        S = A.schur
        routines: Any = get_lapack_funcs(("gttrf", "gttrs"), (S.main, S.lower))
        factor, self._solve = routines
        *self.lu, info = factor(S.lower, S.main, S.upper)
        if info:
            raise SingularMatrix(f"{who}: R_u of a step: pivot {info} is zero - choose another dt")
        self._A, self.norm = A, A.norm

    @property
    def nbytes(self) -> int:
        return sum(int(part.nbytes) for part in self.lu)

    def substitute(self, b: Array, transposed: bool) -> Array:
        A, N = self._A, len(b) // 2
        r, s = b[:N], b[N:]
        if transposed:
            y, _ = self._solve(*self.lu, s - (A.b / A.a) * r, trans="T")
            return np.concatenate([(r - A.K.T @ y) / A.a, y])
        v, _ = self._solve(*self.lu, s - (A.K @ r) / A.a)
        return np.concatenate([(r - A.b * v) / A.a, v])
