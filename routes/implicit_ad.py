"""Implicit differentiation: the forward solve is one node of JAX's graph, an adjoint solve its pullback."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import Factors, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Gradient, Offers, Result, Work, route

if TYPE_CHECKING:
    from gradient_routes.routes.differentiable import Solved


def cost(n_p: int, forward: ForwardWork, *, factors: str) -> Work:
    return work(forward, 1, transposed=True, factors=factors)


@route("implicit-ad", needs=Offers.SOLVE | Offers.TRACE, cost=cost, staged=True)
def implicit_ad(model: Model, p: Array, *, factors: Factors = "refined") -> Gradient:
    """dJ/dp = vjp of p -> J(u(p), p), the pullback of u(p) being one adjoint solve (jax.custom_vjp)."""
    from gradient_routes.problems.jax64 import jax
    from gradient_routes.routes.differentiable import differentiable_solve, held_bytes

    solved: list[Solved] = []
    solve = differentiable_solve(model, factors, solved.append)
    objective = model.compiled.objective

    def gradient(p: Array) -> Result:
        J, pullback = jax.vjp(lambda p: objective(solve(p), p), p)
        node, tape = solved.pop(), held_bytes(pullback)
        dJ_dp = np.asarray(pullback(1.0)[0])
        return Result(float(J), dJ_dp, node.state.u, node.state.residual, node.lam, tape)

    return gradient
