"""Systems of a march in time: forward substitution step by step, backward for the transposed system."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gradient_routes.problems.errors import Overflow
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization
from gradient_routes.routes.solvers.step_factorization import BandedFactorization, StepFactorization
from gradient_routes.routes.solvers.step_march import StepMarch


class RecurrenceFactorization(Factorization):
    """Factors of every A_t of A_t z_t + B_t z_{t-1}, one for all where the matrix is constant.

    A march takes as many steps as b (k, n) has rows. They follow step `first`, which is told where they overflow.
    """

    def __init__(self, A: Recurrence, factorize: Callable[[Any], Factorization], who: str) -> None:
        self._matrix, self._who, self.norm = A, who, A.norm
        self._blocks = [factorize(block) for block in A.A]
        self.name = f"{self._blocks[0].name}, step by step"
        self._steps: StepMarch | None = None
        first = self._blocks[0]
        schur = first.schur if isinstance(first, StepFactorization) else None
        if len(A.A) < A.steps and isinstance(schur, BandedFactorization):
            self._steps = StepMarch(A.A[0], A.B[0], schur.lu, A.steps)

    @property
    def nbytes(self) -> int:
        return sum(block.nbytes for block in self._blocks)

    def march(self, b: Array, z: Array, first: int = 0) -> Array:
        """z_t (k, n) of A_t z_t = b_t - B_t z_{t-1}, from z (n,) before them. Raises Overflow."""
        with np.errstate(over="ignore", invalid="ignore"):
            if self._steps is not None and self._steps.takes(b, z):
                rows = self._steps.forward(b, z)
            else:
                each = []
                for t in range(len(b)):
                    z = self._block(t).substitute(b[t] - self._matrix.below(t) @ z, transposed=False)
                    each.append(z)
                rows = np.stack(each)  # of their type: matrices may be complex where b is real
        self._check(rows, first, "state")
        return rows

    def march_back(self, b: Array, mu: Array, first: int = 0) -> tuple[Array, Array]:
        """lam_t (k, n) of A_t^T lam_t = b_t - B_{t+1}^T lam_{t+1}, mu (n,) being the last of these products, and what
        mu is to the steps before. Raises Overflow.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            if self._steps is not None and self._steps.takes(b, mu):
                rows, mu = self._steps.backward(b, mu)
            else:
                each = []
                for t in range(len(b))[::-1]:
                    each.append(self._block(t).substitute(b[t] - mu, transposed=True))
                    mu = self._matrix.below(t).T @ each[-1]
                rows = np.stack(each[::-1])
        self._check(rows, first, "adjoint state")
        return rows, mu

    def substitute(self, b: Array, transposed: bool) -> Array:
        b = b.reshape(self._matrix.steps, -1)
        rest = np.zeros_like(b[0])
        if transposed ^ self._matrix.transposed:
            return self.march_back(b, rest)[0].ravel()
        return self.march(b, rest).ravel()

    def _block(self, t: int) -> Factorization:
        return self._blocks[t if len(self._blocks) > 1 else 0]

    def _check(self, rows: Array, first: int, what: str) -> None:
        bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
        if len(bad):
            t = first + int(bad[0] if what == "state" else bad[-1]) + 1
            raise Overflow(f"{self._who}: the {what} overflows at step {t} - take smaller or fewer steps")
