"""The tangent (direct) method: one linearized solve per parameter, all with the same factors."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import Factors, LinearizedSolver, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route


def cost(n_p: int, forward: ForwardWork, *, factors: str) -> Work:
    return work(forward, n_p, transposed=False, factors=factors)


@route("tangent", needs=Offers.LINEARIZE, cost=cost)
def tangent(model: Model, p: Array, *, factors: Factors = "refined") -> Result:
    """R_u du_i = -dR/dp_i,  dJ/dp_i = J_p_i + J_u du_i."""
    state = model.solve(p)
    lin = model.linearize(state)
    R_u = LinearizedSolver(model, state, factors, solves=len(p))
    gradient = lin.J_p.copy()
    e = np.zeros_like(p)
    for i in range(len(p)):
        e[i] = 1.0
        gradient[i] += lin.J_u @ R_u.solve(-(lin.R_p @ e))
        e[i] = 0.0
    return Result(state.J, gradient, state.u, state.residual)
