"""Derivatives of the state and of the data by p: H = d(S u)/dp by products or as a whole matrix, du/dp by columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import LinearizedSolver, state_derivatives
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State

FEW = 6  # parameters, for which a whole H costs little
RANK = 1e-9  # of what data see most: what they see less of, they do not see, for solves are no better


class Sensitivity:
    """H = d(S u)/dp diag(scale) at a solved state, (m, n_p); one solve with R_u or its transpose a product.

        R_u du = -R_p dp,         H v = S_u du + S_p dp,  dp = scale v
        R_u^T lam = -S_u^T w,     H^T w = scale (R_p^T lam + S_p^T w)

    Law: <w, H v> = <H^T w, v>, and g = H^T r + alpha dPhi. R_u is factorized at the state itself. The column of a
    parameter that no datum depends on is exactly 0 where substitution preserves zeros, as that of chains of springs.
    Raises InputError where nothing is observed.
    """

    def __init__(self, model: Model, state: State, scale: Array | None = None) -> None:
        name = model.problem.name
        seen = model.problem.observation(state.u, state.p)
        if seen is None:
            raise InputError(
                f"{name}: has no observation S u, which H = d(S u)/dp needs - override its method observation"
            )
        if not len(seen.data):
            raise InputError(f"{name}: no sensors, and m = 0 data do not determine p - place some by sensors=")
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
        """Parameters that no datum depends on, (n_p,): where a random combination of all rows of H is exactly 0; where
        they are FEW, also those that only rounding tells anything of.
        """
        if self.shape[1] <= FEW:
            size = np.linalg.norm(self.dense(), axis=0)
            return np.asarray(size <= RANK * size.max())
        w = np.random.default_rng(seed).standard_normal(self.shape[0])
        return np.asarray(self.T @ w == 0.0)

    def dense(self) -> Array:
        """The whole H, by min(m, n_p) solves."""
        m, n_p = self.shape
        return self.by_columns() if n_p <= m else self.by_rows()

    def by_columns(self) -> Array:
        """The tangent method: one solve for each parameter."""
        return np.stack([self @ e for e in units(self.shape[1])], axis=1)

    def by_rows(self) -> Array:
        """The adjoint method: one transposed solve for each datum."""
        return np.stack([self.T @ e for e in units(self.shape[0])])

    def readings(self, at: Array) -> Array:
        """du/dp diag(scale) of the unknowns `at` (k,), (k, n_p)."""
        return np.stack([self.state(self.scale * e)[at] for e in units(self.shape[1])], axis=1)


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Columns of the derivatives of a solved state, and of what is observed of it, by the parameters.

    components (k,)  numbers i of the parameters p_i, counted from 0
    du_dp (n_u, k)   [unit of u / unit of p_i]
    dSu_dp (m, k)    of the readings S u, without the weights of the misfit [unit of the data / unit of p_i]; None where
                     the problem observes nothing
    """

    components: Array
    du_dp: Array
    dSu_dp: Array | None


def sensitivities(model: Model, state: State, components: Array | None = None) -> Sensitivities:
    """du/dp and d(S u)/dp = S_u du/dp + S_p at a solved state, for some components of p [all], by one solve each:

        R_u du/dp_i = -R_p e_i

    R_u is factorized at the state. All columns together take 8 n_u k bytes.
    """
    n_p = len(state.p)
    at = np.arange(n_p) if components is None else np.asarray(components)
    R_u, R_p = LinearizedSolver(model, state, "fresh"), model.linearize(state).R_p
    du_dp = np.stack([*state_derivatives(R_u, R_p, at)], axis=1)
    seen = model.problem.observation(state.u, state.p)
    if seen is None:
        return Sensitivities(at, du_dp, None)
    dSu_dp = seen.S_u @ du_dp
    if seen.S_p is not None:
        dSu_dp = dSu_dp + np.stack([seen.S_p @ (np.arange(n_p) == i).astype(float) for i in at], axis=1)
    return Sensitivities(at, du_dp, np.asarray(dSu_dp) / np.reshape(seen.weight * seen.relative, (-1, 1)))


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
