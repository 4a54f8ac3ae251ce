"""Implicit differentiation: the forward solve is one node of JAX's graph, an adjoint solve its pullback."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.backward_march import (
    WHOLE,
    Checkpoint,
    check_checkpoint,
    march_back,
    march_objection,
    march_work,
)
from gradient_routes.routes.linearized_solve import Factors, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Gradient, Offers, Result, Work, route

if TYPE_CHECKING:
    from gradient_routes.routes.differentiable import Solved


def cost(n_p: int, forward: ForwardWork, *, factors: str, checkpoint: str = WHOLE) -> Work:
    once = work(forward, 1, transposed=True, factors=factors)
    return once if checkpoint == WHOLE else once + march_work(forward, checkpoint)


def check(*, factors: str, checkpoint: str) -> None:
    check_checkpoint("implicit-ad", checkpoint, {"factors": (factors, "refined")})


def missing(problem: Problem, *, factors: str, checkpoint: str) -> str | None:
    return march_objection("implicit-ad", problem, checkpoint)


@route("implicit-ad", needs=Offers.SOLVE | Offers.TRACE, cost=cost, staged=True, check=check, missing=missing)
def implicit_ad(model: Model, p: Array, *, factors: Factors = "refined", checkpoint: Checkpoint = WHOLE) -> Gradient:
    """dJ/dp = vjp of p -> J(u(p), p), the pullback of u(p) being one adjoint solve (jax.custom_vjp)."""
    if checkpoint != WHOLE:
        return step_by_step(model, checkpoint)
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


def step_by_step(model: Model, checkpoint: str) -> Gradient:
    """The same in every step of a march in time, its pullbacks compiled once for all steps."""
    from gradient_routes.routes.traced_steps import TracedSteps

    assert isinstance(model.problem, Transient)  # see `missing`
    steps = TracedSteps(model.problem)
    return lambda p: march_back(model, p, checkpoint, steps)
