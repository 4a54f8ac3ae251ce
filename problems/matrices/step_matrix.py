"""The matrices of a step of M u'' + C u' + K u = f as a system of first order, by its state z = (u, v)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class Banded:
    """A tridiagonal matrix: lower (N - 1,), main (N,) and upper (N - 1,) diagonal."""

    lower: Array
    main: Array
    upper: Array

    @property
    def T(self) -> Banded:
        return Banded(self.upper, self.main, self.lower)

    def __matmul__(self, v: Array) -> Array:
        return self.rows(v)

    def rows(self, v: Array) -> Array:
        """This matrix times every row of v (.., N)."""
        y = np.asarray(self.main * v)
        y[..., 1:] += self.lower * v[..., :-1]
        y[..., :-1] += self.upper * v[..., 1:]
        return y

    def plus(self, c: Any, B: Banded) -> Banded:
        """A + c B."""
        return Banded(self.lower + c * B.lower, self.main + c * B.main, self.upper + c * B.upper)

    @property
    def dense(self) -> Array:
        """(N, N)."""
        return np.asarray(np.diag(self.main) + np.diag(self.lower, -1) + np.diag(self.upper, 1))

    @property
    def norm(self) -> float:
        sums = np.abs(self.main).astype(float)
        sums[1:] += np.abs(self.lower)
        sums[:-1] += np.abs(self.upper)
        return float(sums.max())


@dataclass(frozen=True)
class StepMatrix:
    """[[a I, b I], [K, D]] of (u, v), each (N,): K the stiffness, D mass and damping, as a step weighs them.

    K and D are of one kind, which has @, T, norm and plus: Banded or SymmetricSparse.
    """

    a: float
    b: float
    K: Any
    D: Any
    transposed: bool = False

    @property
    def T(self) -> StepMatrix:
        return StepMatrix(self.a, self.b, self.K, self.D, not self.transposed)

    def __matmul__(self, z: Array) -> Array:
        N = len(z) // 2
        u, v = z[:N], z[N:]
        if self.transposed:
            return np.concatenate([self.a * u + self.K.T @ v, self.b * u + self.D.T @ v])
        return np.concatenate([self.a * u + self.b * v, self.K @ u + self.D @ v])

    @cached_property
    def schur(self) -> Any:
        """D - b/a K: what is left for v after u = (r - b v)/a."""
        return self.D.plus(-self.b / self.a, self.K)

    @property
    def norm(self) -> float:
        return max(abs(self.a) + abs(self.b), float(self.K.norm + self.D.norm))
