"""The adjoint method: one transposed solve gives the whole gradient."""

from __future__ import annotations

from typing import Annotated, Literal

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.backward_march import march_back
from gradient_routes.routes.checkpointing import Schedule
from gradient_routes.routes.corrected import corrected, correction
from gradient_routes.routes.linearized_solve import Factors, LinearizedSolver, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route

Correct = Annotated[Literal["no", "yes"], "one Newton step and one adjoint correction more: errors of second order"]


WHOLE = "whole"
MOST = 10**9  # steps, of any problem
Checkpoint = Annotated[
    str, "states that a march in time keeps: all, none, sqrt, every=K, revolve=S; whole: all steps as one system"
]


def cost(n_p: int, forward: ForwardWork, *, factors: str, correct: str = "no", checkpoint: str = WHOLE) -> Work:
    once = work(forward, 1, transposed=True, factors=factors)
    if checkpoint != WHOLE:
        again = Schedule.of(checkpoint, forward.cold.steps, "adjoint").recomputed(forward.cold.steps)
        return once + Work(residuals=1, steps=again) + forward.marched_again(again)
    return once if correct == "no" else once + correction(forward, factors)


def check(*, factors: str, correct: str, checkpoint: str) -> None:
    if checkpoint == WHOLE:
        return
    Schedule.of(checkpoint, MOST, "adjoint")
    if (factors, correct) != ("refined", "no"):
        raise InputError(f"adjoint: checkpoint={checkpoint} takes neither factors={factors} nor correct={correct}")


def missing(problem: Problem, *, factors: str, correct: str, checkpoint: str) -> str | None:
    if checkpoint == WHOLE:
        return None
    if not isinstance(problem, Transient):
        return f"adjoint[checkpoint={checkpoint}] marches back in time, {problem.name} has no steps"
    Schedule.of(checkpoint, problem.steps, f"adjoint on {problem.name}")
    return None


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
        assert isinstance(model.problem, Transient)  # see `missing`
        return march_back(model, p, Schedule.of(checkpoint, model.problem.steps, "adjoint"))
    state = model.solve(p)
    lin = model.linearize(state)
    R_u = LinearizedSolver(model, state, factors)
    lam = R_u.solve_transposed(-lin.J_u)
    if correct == "no":
        return Result(state.J, lin.J_p + lin.R_p.T @ lam, state.u, state.residual, lam)
    better = corrected(model, state, R_u, lam)
    residual = norm(model.residual(better.v, p)) / (state.scale or 1.0)
    return Result(better.J, better.gradient, better.v, residual, better.lam)
