"""The adjoint method: one transposed solve gives the whole gradient."""

from __future__ import annotations

from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import Factors, LinearizedSolver, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route


def cost(n_p: int, forward: ForwardWork, *, factors: str) -> Work:
    return work(forward, 1, transposed=True, factors=factors)


@route("adjoint", needs=Offers.LINEARIZE, cost=cost)
def adjoint(model: Model, p: Array, *, factors: Factors = "refined") -> Result:
    """R_u^T lam = -J_u,  dJ/dp = J_p + lam^T R_p."""
    state = model.solve(p)
    lin = model.linearize(state)
    lam = LinearizedSolver(model, state, factors).solve_transposed(-lin.J_u)
    return Result(state.J, lin.J_p + lin.R_p.T @ lam, state.u, state.residual, lam)
