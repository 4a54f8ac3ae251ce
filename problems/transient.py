"""A problem in time: R_t(u_t, u_{t-1}, p) = 0 for t = 1..T, J = sum_t J_t(u_t, p) + alpha Phi(p)."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from itertools import groupby
from typing import Any

import numpy as np

from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.global_step import GlobalStep
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.problem import (
    Array,
    Linearization,
    Offers,
    Operator,
    ParameterView,
    Problem,
    Traced,
)
from gradient_routes.problems.rates import Rates, Stacked
from gradient_routes.problems.step import Step

CACHED = 16384  # numbers of an array of states that stay in a cache with a dozen others like it


class Transient(Problem):
    """A march in time as one problem of all its steps.

    Its state is (u_1, .., u_T), (T n,), R the residuals of all steps and R_u block lower bidiagonal (`Recurrence`): a
    solve is a march, a transposed one a march back, so that every law of a steady problem holds as it stands. A step is
    written once, by the methods named step_.. below, v being u_{t-1}; the march follows from these.

    steps     T
    constant  R_t is affine in u_t and u_{t-1}, with the same R_u and R_v for all t
    projective   it has a `global_step`, whose states are (u, v)
    of_velocity  du/dv in a step of these, at rows of u that stay satisfied: h/2
    """

    constant: bool = False
    projective: bool = False
    of_velocity: float = 0.0

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if cls.step_active_set is Transient.step_active_set:
            cls.offers &= ~Offers.ACTIVE_SET

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

    def step_initial(self, t: Any, v: Any, p: Any, xp: Any = np) -> Any:
        """Where Newton's method for u_t starts: v, or a prediction that satisfies the rows that are linear."""
        return v

    def step_active_set(self, t: int, u: Array, p: Array) -> Hashable | None:
        """See `Problem.active_set`."""
        return None

    def global_step(self, p: Array) -> GlobalStep:
        """A constant matrix in place of D - b/a K of the step's R_u = [[a I, b I], [K, D]]."""
        raise NotOffered(f"{self.name}: offers no constant matrix for its steps")

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        """u_0 (n,), of p's dtype: rest."""
        return xp.zeros(self.n_step, dtype=p.dtype)

    def initial_by(self, p: Array) -> Operator | None:
        """du_0/dp (n, n_p); None where u_0 does not depend on p."""
        return None

    def pulled_to_initial(self, mu: Array, p: Array) -> Array:
        """(du_0/dp)^T mu, (n_p,)."""
        by = self.initial_by(p)
        return np.zeros_like(p) if by is None else np.asarray(by.T @ mu)

    def phi(self, p: Any, xp: Any = np) -> Any:
        """alpha Phi(p)."""
        return 0.0

    def phi_by(self, p: Array) -> Array:
        """alpha dPhi/dp (n_p,)."""
        return np.zeros_like(p)

    # --- some steps: what one overrides whose rows are cheaper together, as arrays, than one by one

    def rows(self, t_0: int, states: Array, p: Array) -> Array:
        """R (k, n) of steps t_0 + 1..t_0 + k, from states (k + 1, n): u_{t_0}, .., u_{t_0 + k}."""
        return np.stack([self.step_residual(t, u, v, p) for t, u, v in stepwise(t_0, states)])

    def loads(self, t_0: int, k: int, p: Array) -> Array:
        """b (k, n) of steps t_0 + 1..t_0 + k where R_t = R_u u + R_v v - b_t."""
        return -self.rows(t_0, np.zeros((k + 1, self.n_step), p.dtype), p)

    def rates(self, t_0: int, states: Array, p: Array) -> Rates:
        """J and the partial derivatives of these steps, without alpha Phi."""
        each = [self.step_linearize(t, u, v, p) for t, u, v in stepwise(t_0, states)]
        J = np.array([self.step_objective(t, u, p) for t, u, _ in stepwise(t_0, states)])
        R_p, J_u, J_p = zip(*((lin.R_p, lin.J_u, lin.J_p) for lin in each), strict=True)
        rows = Stacked(R_p, states.shape[1])
        return Rates(J, np.stack(J_u), np.stack(J_p), rows.each_transposed, rows)

    # --- the march: what follows

    @property
    def n_step(self) -> int:
        """n, the unknowns of a step."""
        return self.n_state // self.steps

    @property
    def together(self) -> int:
        """Steps that are evaluated together, so that their arrays stay in a cache."""
        return max(1, CACHED // self.n_step)

    def at(self, t: int) -> Step:
        """Step t = 1..T as a problem: state u_t (n,), parameters q = (u_{t-1}, p), objective J_t, the last with alpha
        Phi; `linearize` gives R_q = [R_v | R_p] and J_q = (0, J_p).
        """
        return Step(self, t)

    def initial(self, p: Array) -> Array:
        """u_0 in every step."""
        return np.tile(self.initial_state(p), self.steps)

    def stretches(self, U: Array, p: Array) -> Iterator[tuple[int, Array]]:
        """t_0 and states (k + 1, n) of a few steps each."""
        u, k = U.reshape(self.steps, -1), self.together
        yield 0, np.concatenate([self.initial_state(p)[None], u[:k]])
        for t_0 in range(k, self.steps, k):
            yield t_0, u[t_0 - 1 : t_0 + k]

    def residual(self, u: Array, p: Array) -> Array:
        return np.concatenate([self.rows(t_0, states, p).ravel() for t_0, states in self.stretches(u, p)])

    def objective(self, u: Array, p: Array) -> Any:
        J = self.phi(p)
        for t_0, states in self.stretches(u, p):
            for t, u_t, _ in stepwise(t_0, states):
                J = J + self.step_objective(t, u_t, p)
        return J

    def tangent(self, u: Array, p: Array) -> Recurrence:
        steps = [step for t_0, states in self.stretches(u, p) for step in stepwise(t_0, states)]
        steps = steps[: 1 if self.constant else None]
        A = [self.step_tangent(*step, p) for step in steps]
        return Recurrence(A, [self.step_coupling(*step, p) for step in steps], self.steps)

    def linearize(self, u: Array, p: Array) -> Linearization:
        each = [self.rates(t_0, states, p) for t_0, states in self.stretches(u, p)]
        R_p = Stacked([one.R_p for one in each if one.R_p is not None], self.n_step * self.together)
        J_p = sum((one.J_p.sum(axis=0) for one in each), self.phi_by(p))
        J_u = np.concatenate([one.J_u.ravel() for one in each])
        return Linearization(self._with_initial(R_p, u, p), J_u, J_p)

    def _with_initial(self, R_p: Operator, u: Array, p: Array) -> Operator:
        """R_p, to whose first step R_v du_0/dp is added."""
        by, n = self.initial_by(p), self.n_step
        if by is None:
            return R_p
        R_v = self.step_coupling(1, u[:n], self.initial_state(p), p)

        def forward(dp: Array) -> Array:
            y = np.asarray(R_p @ dp)
            y[:n] += R_v @ (by @ dp)
            return y

        return ByProducts(forward, lambda lam: R_p.T @ lam + self.pulled_to_initial(R_v.T @ lam[:n], p))

    def initial_share(self, p: Array, u: Array, lam: Array) -> Array | None:
        """What dJ/dp owes to the initial state, mu_0 . du_0/dp with mu_0 = R_v^T lam_1 (n_p,); None where u_0 does not
        depend on p. The rest is that of the rates.
        """
        n = self.n_step
        if self.initial_by(p) is None:
            return None
        R_v = self.step_coupling(1, u[:n], self.initial_state(p), p)
        return self.pulled_to_initial(R_v.T @ lam[:n], p)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        """The shares of the initial state and of the rates, where u_0 depends on p and lam is known."""
        initial = None if lam is None else self.initial_share(p, u, lam)
        if lam is None or initial is None:
            return ParameterView()
        lin = self.linearize(u, p)
        return ParameterView({"by u_0": initial, "by rates": lin.J_p + lin.R_p.T @ lam - initial})

    def energy_growth(self, u: Array, p: Array) -> float | None:
        """By which part the largest energy exceeds that at the end of the load; None where there is none to tell."""
        return None

    def halved(self) -> Transient | None:
        """The same march to the same data in steps half as long; None where it cannot be made."""
        return None

    def active_set(self, u: Array, p: Array) -> ActiveSteps | None:
        sets = [self.step_active_set(t, u_t, p) for t, u_t in enumerate(u.reshape(self.steps, -1), start=1)]
        return None if sets[0] is None else ActiveSteps(sets)

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


class ActiveSteps(tuple[Hashable, ...]):
    """The active set after every step."""

    def flips(self, other: ActiveSteps) -> list[int]:
        """The steps, counted from 1, after which it is another."""
        return [t for t, (a, b) in enumerate(zip(self, other, strict=True), start=1) if a != b]

    def __str__(self) -> str:
        """Such as `open to 4, 1,2 to 7, open to 20`."""
        runs, t = [], 0
        for one, several in groupby(self):
            t += len(list(several))
            runs.append(f"{one} to {t}")
        return ", ".join(runs)


def stepwise(t_0: int, states: Array) -> Iterator[tuple[int, Array, Array]]:
    """t, u_t and u_{t-1} of steps t_0 + 1..t_0 + k, from states (k + 1, n)."""
    for i in range(1, len(states)):
        yield t_0 + i, states[i], states[i - 1]
