"""The adjoint method: one transposed solve gives the whole gradient."""

from __future__ import annotations

from typing import Annotated, Literal

from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.backward_march import (
    WHOLE,
    Checkpoint,
    check_checkpoint,
    march_back,
    march_objection,
    march_work,
)
from gradient_routes.routes.corrected import corrected, correction
from gradient_routes.routes.linearized_solve import Factors, LinearizedSolver, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route

Correct = Annotated[Literal["no", "yes"], "one Newton step and one adjoint correction more: errors of second order"]


def cost(n_p: int, forward: ForwardWork, *, factors: str, correct: str = "no", checkpoint: str = WHOLE) -> Work:
    once = work(forward, 1, transposed=True, factors=factors)
    if checkpoint != WHOLE:
        return once + march_work(forward, checkpoint)
    return once if correct == "no" else once + correction(forward, factors)


def check(*, factors: str, correct: str, checkpoint: str) -> None:
    check_checkpoint("adjoint", checkpoint, {"factors": (factors, "refined"), "correct": (correct, "no")})


def missing(problem: Problem, *, factors: str, correct: str, checkpoint: str) -> str | None:
    return march_objection("adjoint", problem, checkpoint)


@route("adjoint", needs=Offers.LINEARIZE, cost=cost, check=check, missing=missing)
def adjoint(
    model: Model,
    p: Array,
    *,
    factors: Factors = "refined",
    correct: Correct = "no",
    checkpoint: Checkpoint = WHOLE,
) -> Result:
    """R_u^T lam = -J_u,  dJ/dp = J_p + lam^T R_p."""
    if checkpoint != WHOLE:
        return march_back(model, p, checkpoint)
    state = model.solve(p)
    lin = model.linearize(state)
    R_u = LinearizedSolver(model, state, factors)
    lam = R_u.solve_transposed(-lin.J_u)
    if correct == "no":
        return Result(state.J, lin.J_p + lin.R_p.T @ lam, state.u, state.residual, lam)
    better = corrected(model, state, R_u, lam)
    residual = norm(model.residual(better.v, p)) / (state.scale or 1.0)
    return Result(better.J, better.gradient, better.v, residual, better.lam)
