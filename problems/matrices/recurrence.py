"""The matrix of a march in time: block lower bidiagonal, one block row a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class Recurrence:
    """A_t z_t + B_t z_{t-1}, t = 1..T, of z = (z_1, .., z_T), (T n,); z_0 = 0.

    A, B        T matrices (n, n) each, or one for all steps: then factorized once
    transposed  A_t^T z_t + B_{t+1}^T z_{t+1} instead, z_{T+1} = 0
    """

    A: Sequence[Any]
    B: Sequence[Any]
    steps: int
    transposed: bool = False

    @property
    def T(self) -> Recurrence:
        return Recurrence(self.A, self.B, self.steps, not self.transposed)

    def diagonal(self, t: int) -> Any:
        """A_t, t counted from 0."""
        return self.A[0 if len(self.A) == 1 else t]

    def below(self, t: int) -> Any:
        """B_t, t counted from 0."""
        return self.B[0 if len(self.B) == 1 else t]

    def __matmul__(self, z: Array) -> Array:
        z = z.reshape(self.steps, -1)
        if self.transposed:
            y = [self.diagonal(t).T @ z[t] for t in range(self.steps)]
            for t in range(self.steps - 1):
                y[t] = y[t] + self.below(t + 1).T @ z[t + 1]
        else:
            y = [self.diagonal(t) @ z[t] for t in range(self.steps)]
            for t in range(1, self.steps):
                y[t] = y[t] + self.below(t) @ z[t - 1]
        return np.concatenate(y)

    @property
    def norm(self) -> float:
        """An upper bound of its largest row sum."""
        return max(map(row_sum, self.A)) + max(map(row_sum, self.B))


def row_sum(A: Any) -> float:
    """|A|_inf of a matrix that knows it, an array or a SciPy sparse matrix."""
    return float(A.norm if hasattr(A, "norm") else abs(A).sum(axis=1).max())
