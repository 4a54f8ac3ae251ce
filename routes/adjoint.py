"""The adjoint method: one transposed solve gives the whole gradient."""

from __future__ import annotations

from typing import Any

from problems.problem import Array
from routes.model import Model
from routes.route import ForwardWork, Offers, Result, Work, route


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    return forward.cold + forward.factors_at_solution() + Work(transposed_solves=1)


@route("adjoint", needs=Offers.LINEARIZE, cost=cost)
def adjoint(model: Model, p: Array) -> Result:
    """R_u^T lam = -J_u,  dJ/dp = J_p + lam^T R_p."""
    state = model.solve(p)
    lin = model.linearize(state)
    lam = model.solve_transposed(model.factors_at(state), -lin.J_u)
    return Result(state.J, lin.J_p + lin.R_p.T @ lam, state.u, state.residual, lam)
