"""One step in time as an ordinary problem."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.problem import Array, Linearization, Offers, Operator, Problem

if TYPE_CHECKING:
    from gradient_routes.problems.transient import Transient


class Step(Problem):
    """R_t(u, q) = 0: state u_t (n,), parameters q = (u_{t-1}, p), J_t, the last with alpha Phi."""

    def __init__(self, march: Transient, t: int) -> None:
        self.march, self.t, self.n_state = march, t, march.n_step
        self.offers = march.offers & (Offers.LINEARIZE | Offers.COMPLEX)
        self.name = f"{march.name}, step {t}"
        self.last = t == march.steps
        self.linear, self.structure, self.offset = march.linear, march.structure, march.offset
        self.line_search = march.line_search

    @property
    def parameters(self) -> Any:  # type: ignore[override]
        n, p = self.n_state, self.march.parameters
        lower, upper = (np.broadcast_to(bound, p.start.shape) for bound in (p.lower, p.upper))
        return replace(
            p,
            start=np.concatenate([self.march.initial_state(p.start), p.start]),
            scale=np.concatenate([np.ones(n), p.scale]),
            lower=np.concatenate([np.full(n, -np.inf), lower]),
            upper=np.concatenate([np.full(n, np.inf), upper]),
            label=lambda i: f"u_{i + 1} before" if i < n else p.label(i - n),
            unit="1",
            position=None,
        )

    def split(self, q: Array) -> tuple[Array, Array]:
        """u_{t-1} and p."""
        return q[: self.n_state], q[self.n_state :]

    def initial(self, p: Array) -> Array:
        return np.asarray(self.march.step_initial(self.t, *self.split(p)))

    def residual(self, u: Array, p: Array) -> Array:
        return np.asarray(self.march.step_residual(self.t, u, *self.split(p)))

    def tangent(self, u: Array, p: Array) -> Any:
        return self.march.step_tangent(self.t, u, *self.split(p))

    def active_set(self, u: Array, p: Array) -> Hashable | None:
        return self.march.step_active_set(self.t, u, self.split(p)[1])

    def objective(self, u: Array, p: Array) -> Any:
        p = self.split(p)[1]
        J = self.march.step_objective(self.t, u, p)
        return J + self.march.phi(p) if self.last else J

    def linearize(self, u: Array, p: Array) -> Linearization:
        v, p = self.split(p)
        lin = self.march.step_linearize(self.t, u, v, p)
        J_p = lin.J_p + self.march.phi_by(p) if self.last else lin.J_p
        R_q = Beside(self.march.step_coupling(self.t, u, v, p), lin.R_p, self.n_state)
        return Linearization(R_q, lin.J_u, np.concatenate([np.zeros_like(v), J_p]))


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
