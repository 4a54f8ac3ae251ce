"""Factors of one step of M u'' + C u' + K u = f."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

import numpy as np

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.step_matrix import Banded, StepMatrix
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization


class StepFactorization(Factorization):
    """Factors of the Schur complement D - b/a K, of the size of u."""

    def __init__(self, A: StepMatrix, factorize: Callable[[Any], Factorization]) -> None:
        self._A, self.norm, self.schur = A, A.norm, factorize(A.schur)
        self.name = self.schur.name

    def to(self, rtol: float) -> StepFactorization:
        other = copy(self)
        other.schur = self.schur.to(rtol)
        return other

    @property
    def nbytes(self) -> int:
        return self.schur.nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        A, N = self._A, len(b) // 2
        r, s = b[:N], b[N:]
        if transposed:
            y = self.schur.solve_transposed(s - (A.b / A.a) * r)
            return np.concatenate([(r - A.K.T @ y) / A.a, y])
        v = self.schur.solve(s - (A.K @ r) / A.a)
        return np.concatenate([(r - A.b * v) / A.a, v])


class BandedFactorization(Factorization):
    """L U of a tridiagonal matrix (LAPACK gttrf, real or complex), of three rows or more: SciPy's interface refuses
    less.
    """

    name = "LAPACK tridiagonal L U"

    def __init__(self, A: Banded, who: str) -> None:
        from scipy.linalg.lapack import get_lapack_funcs

        routines: Any = get_lapack_funcs(("gttrf", "gttrs"), (A.main, A.lower))
        factor, self._solve = routines
        *self.lu, info = factor(A.lower, A.main, A.upper)
        if info:
            raise SingularMatrix(f"{who}: R_u of a step: pivot {info} is zero - choose another dt")
        self.norm = A.norm

    @property
    def nbytes(self) -> int:
        return sum(int(part.nbytes) for part in self.lu)

    def substitute(self, b: Array, transposed: bool) -> Array:
        if np.iscomplexobj(b) and not np.iscomplexobj(self.lu[1]):  # R_u need not depend on p
            return self.substitute(b.real, transposed) + 1j * self.substitute(b.imag, transposed)
        x, _ = self._solve(*self.lu, b, trans="T" if transposed else "N")
        return np.asarray(x)
