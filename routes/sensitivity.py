"""What the data see of p: H = d(S u)/dp, by products, and whole by as few solves as it takes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State


class Sensitivity:
    """H = d(S u)/dp diag(scale) at a solved state, (m, n_p); one solve with R_u or its transpose a product.

        R_u du = -R_p dp,         H v = S_u du + S_p dp,  dp = scale v
        R_u^T lam = -S_u^T w,     H^T w = scale (R_p^T lam + S_p^T w)

    Law: <w, H v> = <H^T w, v>, and g = H^T r + alpha dPhi. R_u is factorized at the state itself. A column of a
    parameter that no datum depends on is exactly 0 where the factors add nothing to zeros, as those of chains do.
    Raises InputError where nothing is observed.
    """

    def __init__(self, model: Model, state: State, scale: Array | None = None) -> None:
        name = model.problem.name
        seen = model.problem.observation(state.u, state.p)
        if seen is None:
            raise InputError(f"{name}: states no observation S u, which H = d(S u)/dp needs - override its observation")
        if not len(seen.data):
            raise InputError(f"{name}: no sensors, m = 0 data say nothing of p - place some, sensors= names them")
        self.seen, self.R_p = seen, model.linearize(state).R_p
        self.R_u = LinearizedSolver(model, state, "fresh")
        self.scale = np.ones_like(state.p) if scale is None else scale

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.seen.data), len(self.scale)

    @property
    def T(self) -> Transposed:
        return Transposed(self)

    def state(self, dp: Array) -> Array:
        """du = -R_u^{-1} R_p dp, (n_u,)."""
        return self.R_u.solve(-(self.R_p @ dp))

    def __matmul__(self, v: Array) -> Array:
        dp = self.scale * v
        H_v = self.seen.S_u @ self.state(dp)
        return np.asarray(H_v if self.seen.S_p is None else H_v + self.seen.S_p @ dp)

    def blind(self, seed: int = 0) -> Array:
        """Parameters that no datum depends on, (n_p,): columns of zeros, exact ones under weights of all rows, too."""
        w = np.random.default_rng(seed).standard_normal(self.shape[0])
        return np.asarray(self.T @ w == 0.0)

    def dense(self) -> Array:
        """H whole, by min(m, n_p) solves."""
        m, n_p = self.shape
        return self.by_columns() if n_p <= m else self.by_rows()

    def by_columns(self) -> Array:
        """The tangent method: a solve a parameter."""
        return np.stack([self @ e for e in units(self.shape[1])], axis=1)

    def by_rows(self) -> Array:
        """The adjoint method: a transposed solve a datum."""
        return np.stack([self.T @ e for e in units(self.shape[0])])

    def readings(self, at: Array) -> Array:
        """du/dp diag(scale) of the unknowns `at` (k,), (k, n_p)."""
        return np.stack([self.state(self.scale * e)[at] for e in units(self.shape[1])], axis=1)


@dataclass(frozen=True)
class Transposed:
    """H^T of a Sensitivity."""

    T: Sensitivity

    def __matmul__(self, w: Array) -> Array:
        H = self.T
        lam = H.R_u.solve_transposed(-np.asarray(H.seen.S_u.T @ w))
        by_p = H.R_p.T @ lam
        return np.asarray(H.scale * (by_p if H.seen.S_p is None else by_p + H.seen.S_p.T @ w))


def state_sensitivity(model: Model, state: State, columns: Sequence[int] | None = None) -> Array:
    """du/dp (n_u, k) at a solved state, R_u du/dp_i = -R_p e_i: of the parameters `columns`, all by default."""
    R_p = model.linearize(state).R_p
    R_u = LinearizedSolver(model, state, "fresh")
    chosen = range(len(state.p)) if columns is None else columns
    du_dp = np.empty((len(state.u), len(chosen)))
    for k, i in enumerate(chosen):
        e = np.zeros_like(state.p)
        e[i] = 1.0
        du_dp[:, k] = R_u.solve(-(R_p @ e))
    return du_dp


def units(n: int) -> Iterator[Array]:
    """The columns of the identity (n, n), one array that changes."""
    e = np.zeros(n)
    for i in range(n):
        e[i] = 1.0
        yield e
        e[i] = 0.0
