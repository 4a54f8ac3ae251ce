"""A problem in time: R_t(u_t, u_{t-1}, p) = 0 for t = 1..T, and what its steps are."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array, Operator, Problem


class Transient(Problem):
    """J = sum_t J_t(u_t, p) + alpha Phi(p), as one problem of all steps.

    Its state is (u_1, .., u_T), (T n,), R the residuals of all steps and R_u block lower bidiagonal (`Recurrence`): a
    solve is a march, a transposed one a march back, so that every law of a steady problem holds as it stands.

    constant  R_t is affine in u_t and u_{t-1}, with the same matrices for all t
    """

    constant: bool = False

    @abstractmethod
    def at(self, t: int) -> Problem:
        """Step t = 1..T as a problem: state u_t (n,), parameters q = (u_{t-1}, p), objective J_t, the last with alpha
        Phi; `linearize` gives R_q = [R_v | R_p] and J_q = (0, J_p).
        """

    def initial_state(self, p: Array) -> Array:
        """u_0 (n,), of p's dtype: rest."""
        return np.zeros(self.n_state // self.steps, dtype=p.dtype)


class Beside:
    """[V | P], (n, n_v + n_p), of two operators that are multiplied by parts of a vector."""

    def __init__(self, V: Operator, P: Operator, n_v: int, transposed: bool = False) -> None:
        self.V, self.P, self.n_v, self.transposed = V, P, n_v, transposed

    @property
    def T(self) -> Beside:
        return Beside(self.V, self.P, self.n_v, not self.transposed)

    def __matmul__(self, x: Array) -> Any:
        if self.transposed:
            return np.concatenate([self.V.T @ x, self.P.T @ x])
        return self.V @ x[: self.n_v] + self.P @ x[self.n_v :]
