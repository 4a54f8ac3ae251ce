"""Partial derivatives of steps in time by automatic differentiation, compiled once for all steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Array
from gradient_routes.problems.rates import Rates
from gradient_routes.problems.transient import Transient


class TracedSteps:
    """What the backward march needs of a problem, see `Transient`; t is an argument of what is traced."""

    def __init__(self, problem: Transient) -> None:
        R, J = problem.step_residual, problem.step_objective

        def pulled(t: Any, u: Any, v: Any, p: Any, lam: Any) -> Any:
            return jax.vjp(lambda p: R(t, u, v, p, jnp), p)[1](lam)[0]

        by_state = jax.value_and_grad(lambda u, p, t: J(t, u, p, jnp), (0, 1))
        start, phi = problem.initial_state, problem.phi
        self._initial = jax.jit(lambda p, mu: jax.vjp(lambda p: start(p, jnp), p)[1](mu)[0])
        self._phi_by = jax.jit(jax.grad(lambda p: phi(p, jnp) + 0.0 * p.sum()))  # a sum, as phi may be a constant
        self._objective = jax.jit(jax.vmap(by_state, (0, None, 0)))
        self._pulled = jax.jit(jax.vmap(pulled, (0, 0, 0, None, 0)))

    def rates(self, t_0: int, states: Array, p: Array) -> Rates:
        t = np.arange(t_0 + 1, t_0 + len(states))
        J, (J_u, J_p) = self._objective(states[1:], p, t)

        def by_p(lam: Array) -> Array:
            return np.asarray(self._pulled(t, states[1:], states[:-1], p, lam))

        return Rates(np.asarray(J), np.asarray(J_u), np.asarray(J_p), by_p)

    def phi_by(self, p: Array) -> Array:
        return np.asarray(self._phi_by(p))

    def pulled_to_initial(self, mu: Array, p: Array) -> Array:
        return np.asarray(self._initial(p, mu))
