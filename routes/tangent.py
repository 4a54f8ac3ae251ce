"""The tangent (direct) method: one linearized solve per parameter, all with the same factors."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.problem import Array
from routes.model import Model
from routes.route import ForwardWork, Offers, Result, Work, route


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    return forward.cold + forward.factors_at_solution() + Work(solves=n_p)


@route("tangent", needs=Offers.LINEARIZE, cost=cost)
def tangent(model: Model, p: Array) -> Result:
    """R_u du_i = -dR/dp_i,  dJ/dp_i = J_p_i + J_u du_i."""
    state = model.solve(p)
    lin, factors = model.linearize(state), model.factors_at(state)
    gradient = lin.J_p.copy()
    e = np.zeros_like(p)
    for i in range(len(p)):
        e[i] = 1.0
        du = model.solve_linear(factors, -(lin.R_p @ e))
        gradient[i] += lin.J_u @ du
        e[i] = 0.0
    return Result(state.J, gradient, state.u, state.residual)
