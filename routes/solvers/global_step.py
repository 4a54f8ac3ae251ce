"""Systems with the constant matrix of a global step: one factorization for all components, and a small one for k."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.matrices.global_step import GlobalStep
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization


class GlobalFactors:
    """S^{-1} of S = A x I_d + E diag(k) E^T = S^T, given factors of A (Woodbury 1950).

    (A + E diag(k) E^T)^{-1} r = x - Y (k y),    (I + E^T Y diag(k)) y = E^T x,    x = A^{-1} r,    Y = A^{-1} E
    """

    def __init__(self, step: GlobalStep, factors: Factorization) -> None:
        self.step, self._factors = step, factors
        self.nodes, self.components = np.divmod(step.at, step.d)
        units = np.eye(step.A.shape[0])[:, self.nodes]
        self.Y = np.stack([factors.solve(e) for e in units.T], axis=1) if len(step.at) else units
        same = self.components[:, None] == self.components
        self.C = np.where(same, self.Y[self.nodes], 0.0)

    def solve(self, r: Array, k: Array) -> Array:
        """S^{-1} r, (n,)."""
        x: Any = np.stack([self._factors.solve(column) for column in r.reshape(-1, self.step.d).T], axis=1)
        if k.any():
            y = k * np.linalg.solve(np.eye(len(k)) + self.C * k, x[self.nodes, self.components])
            for c in range(self.step.d):
                x[:, c] -= self.Y @ np.where(self.components == c, y, 0.0)
        return np.asarray(x.ravel())
