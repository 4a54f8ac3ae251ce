"""Newton's loop on JAX's tape, factors of every step kept: the direct form of unrolled AD."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.routes.model import Model
from gradient_routes.routes.solvers.solver import Factorization


class Kept:
    """What one Newton step leaves on the tape: arrays u, p, du as leaves, factors of R_u(u, p) as a constant."""

    def __init__(self, u: Any, p: Any, du: Any, factors: Factorization) -> None:
        self.u, self.p, self.du, self.factors = u, p, du, factors


# rebuilding it needs no leaves: they are there to be counted as bytes of the tape
jax.tree_util.register_pytree_node(Kept, lambda kept: ((kept.u, kept.p, kept.du), kept), lambda kept, leaves: kept)


class UnrolledNewton:
    """u_k(p) by k full Newton steps from u_0; differentiable by jax.vjp, eagerly.

    One step is u' = u - du, R_u du = R. Differentiating it, R_u included, gives for an incoming u'_bar

        R_u^T w = -u'_bar,    (u_bar, p_bar) = (u'_bar, 0) + w^T d[R - R_u du]/d(u, p)

    with du held: one transposed solve with the step's own factors, and products with second derivatives of R.
    """

    def __init__(self, model: Model, k: int) -> None:
        self.model, self.k = model, k
        self.factor_bytes = 0
        R = model.traced.residual

        def linearized(u: Any, p: Any, du: Any) -> Any:
            """R(u, p) - R_u(u, p) du."""
            value, along = jax.jvp(lambda u: R(u, p), (u,), (du,))
            return value - along

        self._pullback = jax.jit(lambda u, p, du, w: jax.vjp(lambda u, p: linearized(u, p, du), u, p)[1](w))
        self._step = jax.custom_vjp(lambda u, p: self._forward(u, p)[0])
        self._step.defvjp(self._forward, self._backward)

    def __call__(self, u_0: Any, p: Any) -> Any:
        self.factor_bytes = 0
        u = jnp.asarray(u_0)
        for _ in range(self.k):
            u = self._step(u, p)
        return u

    def _forward(self, u: Any, p: Any) -> tuple[Any, Kept]:
        model, u_, p_ = self.model, np.asarray(u), np.asarray(p)
        factors = model.factorize(model.tangent(u_, p_))
        du = model.newton_correction(factors, model.residual(u_, p_))
        self.factor_bytes += factors.nbytes
        return u - du, Kept(u, p, jnp.asarray(du), factors)

    def _backward(self, kept: Kept, u_bar: Any) -> tuple[Any, Any]:
        w = self.model.solve_transposed(kept.factors, -np.asarray(u_bar))
        by_u, by_p = self._pullback(kept.u, kept.p, kept.du, w)
        return u_bar + by_u, by_p
