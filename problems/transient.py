"""A problem in time: R_t(u_t, u_{t-1}, p) = 0 for t = 1..T, J = sum_t J_t(u_t, p) + alpha Phi(p)."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.problem import Array, Linearization, Operator, Problem, Traced
from gradient_routes.problems.step import Step


class Transient(Problem):
    """A march in time as one problem of all its steps.

    Its state is (u_1, .., u_T), (T n,), R the residuals of all steps and R_u block lower bidiagonal (`Recurrence`): a
    solve is a march, a transposed one a march back, so that every law of a steady problem holds as it stands. A step is
    written once, by the methods named step_.. below, v being u_{t-1}; the march follows from these. One whose rows of
    all steps are cheaper together than one by one overrides `residual`, `objective`, `tangent` and `linearize`.

    steps     T
    constant  R_t is affine in u_t and u_{t-1}, with the same R_u and R_v for all t
    """

    constant: bool = False

    # --- one step: what a problem gives

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        """R_t(u, v, p), (n,). t is traced where xp is jax.numpy."""
        raise NotOffered(f"{self.name}: offers no residual of a step")

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        """J_t(u, p), without alpha Phi."""
        raise NotOffered(f"{self.name}: offers no objective of a step")

    def step_tangent(self, t: int, u: Array, v: Array, p: Array) -> Any:
        """R_u of the step, (n, n), see `Problem.tangent`."""
        raise NotOffered(f"{self.name}: offers no R_u of a step")

    def step_coupling(self, t: int, u: Array, v: Array, p: Array) -> Any:
        """R_v of the step, (n, n)."""
        raise NotOffered(f"{self.name}: offers no R_v of a step")

    def step_linearize(self, t: int, u: Array, v: Array, p: Array) -> Linearization:
        """R_p, J_u and J_p of the step, without alpha Phi."""
        raise NotOffered(f"{self.name}: offers no partial derivatives of a step")

    def step_initial(self, t: int, v: Array, p: Array) -> Array:
        """Where Newton's method for u_t starts: v, or a prediction that satisfies the rows that are linear."""
        return v

    def step_active_set(self, t: int, u: Array, p: Array) -> Hashable | None:
        """See `Problem.active_set`."""
        return None

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        """u_0 (n,), of p's dtype: rest."""
        return xp.zeros(self.n_step, dtype=p.dtype)

    def initial_by(self, p: Array) -> Operator | None:
        """du_0/dp (n, n_p); None where u_0 does not depend on p."""
        return None

    def phi(self, p: Any, xp: Any = np) -> Any:
        """alpha Phi(p)."""
        return 0.0

    def phi_by(self, p: Array) -> Array:
        """alpha dPhi/dp (n_p,)."""
        return np.zeros_like(p)

    # --- the march: what follows

    @property
    def n_step(self) -> int:
        """n, the unknowns of a step."""
        return self.n_state // self.steps

    def at(self, t: int) -> Step:
        """Step t = 1..T as a problem: state u_t (n,), parameters q = (u_{t-1}, p), objective J_t, the last with alpha
        Phi; `linearize` gives R_q = [R_v | R_p] and J_q = (0, J_p).
        """
        return Step(self, t)

    def initial(self, p: Array) -> Array:
        """u_0 in every step."""
        return np.tile(self.initial_state(p), self.steps)

    def _pairs(self, U: Array, p: Array) -> list[tuple[int, Array, Array]]:
        """t, u_t, u_{t-1} for t = 1..T."""
        u, v = U.reshape(self.steps, -1), self.initial_state(p)
        return [(t + 1, u[t], u[t - 1] if t else v) for t in range(self.steps)]

    def residual(self, u: Array, p: Array) -> Array:
        return np.concatenate([self.step_residual(t, u_t, v, p) for t, u_t, v in self._pairs(u, p)])

    def objective(self, u: Array, p: Array) -> Any:
        return sum(self.step_objective(t, u_t, p) for t, u_t, _ in self._pairs(u, p)) + self.phi(p)

    def tangent(self, u: Array, p: Array) -> Recurrence:
        pairs = self._pairs(u, p)[: 1 if self.constant else None]
        A = [self.step_tangent(t, u_t, v, p) for t, u_t, v in pairs]
        return Recurrence(A, [self.step_coupling(t, u_t, v, p) for t, u_t, v in pairs], self.steps)

    def linearize(self, u: Array, p: Array) -> Linearization:
        pairs = self._pairs(u, p)
        each = [self.step_linearize(t, u_t, v, p) for t, u_t, v in pairs]
        R_p: list[Operator] = [lin.R_p for lin in each]
        by = self.initial_by(p)
        if by is not None:
            R_p[0] = Sum(R_p[0], Product(self.step_coupling(*pairs[0], p), by))
        J_p = sum((lin.J_p for lin in each), self.phi_by(p))
        return Linearization(Stacked(R_p, self.n_step), np.concatenate([lin.J_u for lin in each]), J_p)

    def traced(self) -> Traced:
        """R and J of all steps by one trace of a step."""
        from gradient_routes.problems.jax64 import jax, jnp

        t = jnp.arange(1, self.steps + 1)

        def residual(U: Any, p: Any) -> Any:
            u = U.reshape(self.steps, -1)
            v = jnp.concatenate([self.initial_state(p, jnp)[None], u[:-1]])
            return jax.vmap(lambda t, u, v: self.step_residual(t, u, v, p, jnp))(t, u, v).ravel()

        def objective(U: Any, p: Any) -> Any:
            J = jax.vmap(lambda t, u: self.step_objective(t, u, p, jnp))(t, U.reshape(self.steps, -1))
            return J.sum() + self.phi(p, jnp)

        return Traced(residual, objective)


class Stacked:
    """Operators (n, n_p) of all steps, one below the other."""

    def __init__(self, rows: Sequence[Operator], n: int, transposed: bool = False) -> None:
        self.rows, self.n, self.transposed = rows, n, transposed

    @property
    def T(self) -> Stacked:
        return Stacked(self.rows, self.n, not self.transposed)

    def __matmul__(self, x: Array) -> Array:
        if self.transposed:
            y = x.reshape(len(self.rows), self.n)
            return np.asarray(sum(row.T @ y_t for row, y_t in zip(self.rows, y, strict=True)))
        return np.concatenate([row @ x for row in self.rows])


class Product:
    """A B, given by its factors."""

    def __init__(self, A: Operator, B: Operator) -> None:
        self.A, self.B = A, B

    @property
    def T(self) -> Product:
        return Product(self.B.T, self.A.T)

    def __matmul__(self, x: Array) -> Any:
        return self.A @ (self.B @ x)


class Sum:
    """A + B, given by its terms."""

    def __init__(self, A: Operator, B: Operator) -> None:
        self.A, self.B = A, B

    @property
    def T(self) -> Sum:
        return Sum(self.A.T, self.B.T)

    def __matmul__(self, x: Array) -> Any:
        return self.A @ x + self.B @ x
