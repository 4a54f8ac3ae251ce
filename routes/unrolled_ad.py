"""Unrolled differentiation: reverse-mode AD through every solver iteration, the gradient of the k-th iterate."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np

from problems.errors import InputError, Overflow
from problems.problem import Array, Problem
from routes.model import Model
from routes.route import Affordable, ForwardWork, Gradient, Offers, Options, Result, Work, route

Inner = Annotated[Literal["cg", "richardson", "jacobi"], "the iteration on the tape"]
Iterations = Annotated[int | None, "k [what the forward tolerance needs at p]"]
KEPT = {"cg": (3, 73), "richardson": (2, 0), "jacobi": (2, 0)}  # per iteration: (n_u,) arrays, bytes of scalars
NEVER = 10**15  # where an estimate of k ends: no machine iterates longer


def cost(n_p: int, forward: ForwardWork, *, inner: str, iterations: int) -> Work:
    return Work(forward_solves=1, residuals=2, matvecs=2 * iterations)


def check(*, inner: str, iterations: int | None) -> None:
    if iterations is not None and iterations < 1:
        raise InputError(f"unrolled-ad: iterations={iterations} - choose at least 1")


def missing(problem: Problem, *, inner: str, iterations: int | None) -> str | None:
    if not problem.linear:
        return f"unrolled-ad[inner={inner}] iterates on linear problems, {problem.name} is nonlinear"
    if inner == "cg" and problem.structure != "spd":
        return f"unrolled-ad[inner=cg] needs a symmetric positive definite R_u, {problem.name} is {problem.structure}"
    knows = {"cg": True, "richardson": "spectral_bound", "jacobi": "diagonal"}[inner]
    if knows is not True and getattr(problem.traced(), str(knows)) is None:
        return f"unrolled-ad[inner={inner}] needs the {knows} of R_u, which {problem.name} does not offer"
    return None


def expect(model: Model, p: Array, *, inner: str, iterations: int | None) -> Options:
    """k from the condition number: sqrt(cond) / 2 log(2 / rtol) for CG, cond log(1 / rtol) for the stationary ones."""
    if iterations is None:
        n_u, rtol, condition = model.problem.n_state, model.solver.rtol, model.problem.condition(p)
        condition = n_u**2 if condition is None else condition
        cg = min(n_u, math.sqrt(condition) / 2 * math.log(2 / rtol))
        iterations = math.ceil(min(NEVER, cg if inner == "cg" else condition * math.log(1 / rtol)))
    return {"inner": inner, "iterations": iterations}


def resolve(
    model: Model, p: Array, affordable: Affordable = lambda options: True, *, inner: str, iterations: int | None
) -> Options:
    """k as counted by iterating until the forward tolerance is met, or until that is no longer affordable."""
    if iterations is None:
        from routes.iterations import iteration

        iterate, at_most = iteration(inner, model.traced, model.problem.n_state), 256
        iterations = iterate.iterations_to(p, model.solver.rtol, at_most)
        while iterations == at_most and affordable({"inner": inner, "iterations": iterations}):
            at_most *= 4
            iterations = iterate.iterations_to(p, model.solver.rtol, at_most)
    return {"inner": inner, "iterations": iterations}


def tape(problem: Problem, *, inner: str, iterations: int) -> int:
    vectors, scalars = KEPT[inner]
    return iterations * (8 * problem.n_state * vectors + scalars)


@route(
    "unrolled-ad",
    needs=Offers.SOLVE | Offers.TRACE,
    cost=cost,
    staged=True,
    check=check,
    missing=missing,
    expect=expect,
    resolve=resolve,
    tape=tape,
)
def unrolled_ad(model: Model, p: Array, *, inner: Inner = "cg", iterations: Iterations = None) -> Gradient:
    """dJ(u_k(p), p)/dp by backprop through all k iterations (jax.lax.scan): the gradient of the k-th iterate."""
    from problems.jax64 import jax
    from routes.differentiable import held_bytes
    from routes.iterations import count_products, iteration

    assert iterations is not None  # Route.prepare resolves it
    iterate = iteration(inner, model.traced, model.problem.n_state)

    def objective(p: Any) -> tuple[Any, Any]:
        u = iterate.iterate(p, iterations)
        return model.traced.objective(u, p), u

    forward = jax.jit(lambda p: jax.vjp(objective, p, has_aux=True)).trace(p)
    backward = jax.jit(lambda pullback: pullback(1.0)[0]).trace(forward.out_info[1])
    sweep, sweep_back = forward.lower().compile(), backward.lower().compile()
    products = count_products(forward.jaxpr) + count_products(backward.jaxpr)

    def gradient(p: Array) -> Result:
        J, pullback, u = sweep(p)
        model.tally.count("forward_solves")
        model.tally.count("matvecs", products)
        residual = model.relative_residual(np.asarray(u), p)
        dJ_dp = np.asarray(sweep_back(pullback))
        if np.isfinite(J) and not np.isfinite(dJ_dp).all():
            raise Overflow(
                f"unrolled-ad: J = {J:g}, but the backward sweep of {iterations} {inner} iterations overflowed: it"
                " amplifies rounding where R_u is ill-conditioned - iterate less, or take implicit-ad or adjoint"
            )
        return Result(float(J), dJ_dp, np.asarray(u), residual, tape=held_bytes(pullback))

    return gradient
