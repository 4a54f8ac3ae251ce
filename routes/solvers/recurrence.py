"""Systems of a march in time: forward substitution step by step, backward for the transposed system."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.matrices.step_matrix import StepMatrix
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization


class RecurrenceFactorization(Factorization):
    """Factors of every A_t, one for all where the matrix is constant: A_t z_t = b_t - B_t z_{t-1}."""

    def __init__(self, A: Recurrence, factorize: Callable[[Any], Factorization]) -> None:
        self._matrix, self.norm = A, A.norm
        self._blocks = [factorize(block) for block in A.A]
        self.name = f"{self._blocks[0].name}, step by step"

    @property
    def nbytes(self) -> int:
        return sum(block.nbytes for block in self._blocks)

    def substitute(self, b: Array, transposed: bool) -> Array:
        M, steps = self._matrix, self._matrix.steps
        b = b.reshape(steps, -1)
        z: list[Any] = [None] * steps
        last = len(self._blocks) - 1
        transposed ^= M.transposed
        for t in range(steps)[:: -1 if transposed else 1]:
            r = b[t]
            if transposed and t + 1 < steps:
                r = r - M.below(t + 1).T @ z[t + 1]
            elif not transposed and t:
                r = r - M.below(t) @ z[t - 1]
            z[t] = self._blocks[min(t, last)].substitute(r, transposed)
        return np.concatenate(z)


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
        *self._lu, info = factor(S.lower, S.main, S.upper)
        if info:
            raise SingularMatrix(f"{who}: R_u of a step: pivot {info} is zero - choose another dt")
        self._A, self.norm = A, A.norm

    @property
    def nbytes(self) -> int:
        return sum(int(part.nbytes) for part in self._lu)

    def substitute(self, b: Array, transposed: bool) -> Array:
        A, N = self._A, len(b) // 2
        r, s = b[:N], b[N:]
        if transposed:
            y, _ = self._solve(*self._lu, s - (A.b / A.a) * r, trans="T")
            return np.concatenate([(r - A.K.T @ y) / A.a, y])
        v, _ = self._solve(*self._lu, s - (A.K @ r) / A.a)
        return np.concatenate([(r - A.b * v) / A.a, v])
