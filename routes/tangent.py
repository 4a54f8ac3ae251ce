"""The tangent (direct) method: one linearized solve per parameter, all with the same factors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import Factors, LinearizedSolver, state_derivatives, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route


def cost(n_p: int, forward: ForwardWork, *, factors: str) -> Work:
    return work(forward, n_p, transposed=False, factors=factors)


@route("tangent", needs=Offers.LINEARIZE, cost=cost)
def tangent(model: Model, p: Array, *, factors: Factors = "refined") -> Result:
    """R_u du_i = -dR/dp_i,  dJ/dp_i = J_p_i + J_u du_i."""
    return with_columns(model, p, factors)


def with_columns(model: Model, p: Array, factors: str = "refined", kept: Sequence[int] = ()) -> Result:
    """The tangent method. Its result carries the columns `kept` (k,) of du/dp, counted from 0, as du_dp (n_u, k)."""
    state = model.solve(p)
    lin = model.linearize(state)
    gradient = lin.J_p.copy()
    columns: dict[int, Array] = {}
    R_u = LinearizedSolver(model, state, factors, solves=len(p))
    for i, du in enumerate(state_derivatives(R_u, lin.R_p, range(len(p)))):
        gradient[i] += lin.J_u @ du
        if i in kept:
            columns[i] = du
    du_dp = np.stack([columns[i] for i in kept], axis=1) if kept else None
    return Result(state.J, gradient, state.u, state.residual, du_dp=du_dp)
