"""Unrolled differentiation: reverse-mode AD through every solver iteration, the gradient of the k-th iterate."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError, Overflow
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.march import marched_again, most_newton_steps
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Affordable, ForwardWork, Gradient, Offers, Options, Result, Work, route

Inner = Annotated[
    Literal["cg", "richardson", "jacobi", "direct"] | None,
    "the iteration on the tape; direct: Newton steps with their factors [cg on the linear bar, direct on others]",
]
Iterations = Annotated[
    int | None, "k, in each Newton step; direct: Newton steps [what the forward tolerance needs at p]"
]
NewtonSteps = Annotated[int | None, "Newton steps around them [1 on linear problems, else as the forward solve]"]
Checkpoint = Annotated[int | None, "keep the iterates 0, c, 2 c, ... on the tape and recompute the others [all]"]
KEPT = {
    "cg": (3, 73),
    "richardson": (2, 0),
    "jacobi": (2, 0),
}  # on the tape, an iteration: (n_u,) arrays, bytes of scalars
CARRIED = {"cg": (2, 24), "richardson": (1, 8), "jacobi": (2, 0)}  # the same for a checkpoint
TYPICAL = 5  # number of Newton steps where it is not known yet
NEVER = 10**15  # largest estimate of k: more than any machine can do


def cost(
    n_p: int, forward: ForwardWork, *, inner: str | None, iterations: int, newton: int | None, checkpoint: int | None
) -> Work:
    if inner == "direct" and marches(forward.cold.steps, forward.linear, checkpoint):
        again = marched_again(forward.cold.steps, checkpoint)
        return forward.marched_iterates(iterations, forward.cold.steps, again)
    if inner == "direct":
        k, known = iterations, forward.counted
        residuals = 1 + k + forward.halvings() if known is None else known.residuals
        return Work(
            1, k, residuals, assemblies=k, factorizations=k, solves=k, transposed_solves=k, steps=forward.cold.steps
        )
    again = 0 if checkpoint is None else iterations - iterations % checkpoint
    return Work(forward_solves=1, residuals=2, matvecs=(newton or 1) * (2 * iterations + again))


def check(*, inner: str | None, iterations: int | None, newton: int | None, checkpoint: int | None) -> None:
    for name, count in (("iterations", iterations), ("newton", newton), ("checkpoint", checkpoint)):
        if count is not None and count < 1:
            raise InputError(f"unrolled-ad: {name}={count} - choose at least 1")
    if inner == "direct" and newton is not None:
        raise InputError("unrolled-ad: inner=direct counts its Newton steps by iterations= - leave newton= out")


def chosen(problem: Problem, inner: str | None) -> str:
    by_cg = problem.linear and problem.structure == "spd" and not problem.matrix_free
    return inner or ("cg" if by_cg else "direct")


def marches(steps: int, linear: bool, checkpoint: int | None) -> bool:
    """Whether a problem's steps in time are unrolled one by one: a linear march is one Newton step of all of them."""
    return bool(steps) and not (linear and checkpoint is None)


def missing(
    problem: Problem, *, inner: str | None, iterations: int | None, newton: int | None, checkpoint: int | None
) -> str | None:
    inner = chosen(problem, inner)
    if inner == "direct" and checkpoint is not None:
        if problem.steps >= checkpoint:
            return None
        steps = f"{problem.steps} in time" if problem.steps else "none in time"
        return f"unrolled-ad[inner=direct,checkpoint={checkpoint}] keeps states of so many steps, there are {steps}"
    if inner == "direct":
        return None
    if inner == "cg" and problem.structure != "spd":
        return f"unrolled-ad[inner=cg] needs a symmetric positive definite R_u, {problem.name} is {problem.structure}"
    if inner != "cg" and not problem.linear:
        return f"unrolled-ad[inner={inner}] iterates on linear problems, {problem.name} is nonlinear - take inner=cg"
    knows = {"cg": None, "richardson": "spectral_bound", "jacobi": "diagonal"}[inner]
    if knows is not None and getattr(problem.traced(), knows) is None:
        return f"unrolled-ad[inner={inner}] needs the {knows} of R_u, which {problem.name} does not offer"
    return None


def expect(
    model: Model,
    p: Array,
    *,
    inner: str | None,
    iterations: int | None,
    newton: int | None,
    checkpoint: int | None,
) -> Options:
    """k from the condition number: sqrt(cond) / 2 log(2 / rtol) for CG, cond log(1 / rtol) for the stationary ones."""
    inner = chosen(model.problem, inner)
    steps = 1 if model.problem.linear else TYPICAL
    if iterations is None and inner == "direct":
        iterations = steps
    elif iterations is None:
        n_u, rtol, condition = model.problem.n_state, model.solver.rtol, model.problem.condition(p)
        condition = n_u**2 if condition is None else condition
        cg = min(n_u, math.sqrt(condition) / 2 * math.log(2 / rtol))
        iterations = math.ceil(min(NEVER, cg if inner == "cg" else condition * math.log(1 / rtol)))
    newton = newton if inner == "direct" or model.problem.linear else newton or steps
    return {"inner": inner, "iterations": iterations, "newton": newton, "checkpoint": checkpoint}


def resolve(
    model: Model,
    p: Array,
    affordable: Affordable = lambda options: True,
    *,
    inner: str | None,
    iterations: int | None,
    newton: int | None,
    checkpoint: int | None,
) -> Options:
    """k from iterating until the forward tolerance is met, or until the gradient is no longer affordable.

    On nonlinear problems k is the larger number of the linear systems at the first and the last Newton step.
    """
    problem, inner = model.problem, chosen(model.problem, inner)
    if inner == "direct" and problem.steps and not problem.linear and iterations is None:
        iterations = most_newton_steps(model, p)
    state = None if problem.linear else Model(problem, replace(model.solver, newton="full")).solve(p)
    steps = 1 if state is None else state.work.newton_iterations
    if inner != "direct" and not problem.linear:
        newton = newton or steps
    options = {"inner": inner, "newton": newton, "checkpoint": checkpoint}
    if iterations is None and inner == "direct":
        iterations = steps
    elif iterations is None:
        iterate = model.compiled.iteration(inner)
        points = [model.initial(p)] + ([] if state is None else [near(problem, state.u)])
        at_most, iterations = 64, 0
        while True:
            at_most *= 4
            iterations = max(iterate.iterations_to((u, p), model.solver.rtol, at_most) for u in points)
            if iterations < at_most or not affordable(options | {"iterations": iterations}):
                break
    return options | {"iterations": iterations}


def near(problem: Problem, u: Array) -> Array:
    """A state near u whose residual is not rounding but of the size that the last Newton steps correct."""
    return u * (1.0 + 1e-4 * np.sin(np.arange(len(u))))


def tape(
    problem: Problem, *, inner: str | None, iterations: int, newton: int | None, checkpoint: int | None
) -> int | None:
    """None where factors are kept, whose fill is not known in advance."""
    inner = chosen(problem, inner)
    if inner == "direct":
        return None
    vectors, scalars = KEPT[inner]
    each, kept = 8 * problem.n_state * vectors + scalars, iterations
    if checkpoint is not None:
        vectors, scalars = CARRIED[inner]
        checkpoints, kept = divmod(iterations, checkpoint)
        return (newton or 1) * (checkpoints * (8 * problem.n_state * vectors + scalars) + kept * each)
    return (newton or 1) * kept * each


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
def unrolled_ad(
    model: Model,
    p: Array,
    *,
    inner: Inner = None,
    iterations: Iterations = None,
    newton: NewtonSteps = None,
    checkpoint: Checkpoint = None,
) -> Gradient:
    """dJ(u_k(p), p)/dp by backprop through all k solver iterations: the gradient of the k-th iterate."""
    assert iterations is not None  # Route.prepare resolves it
    if inner == "direct" and marches(model.problem.steps, model.problem.linear, checkpoint):
        return through_march(model, iterations, checkpoint)
    if inner == "direct":
        return through_newton(model, iterations)
    return through_iterations(model, p, str(inner), iterations, newton or 1, checkpoint)


def through_iterations(model: Model, p: Array, inner: str, k: int, newton: int, checkpoint: int | None) -> Gradient:
    """Every linear iteration of every Newton step compiled."""
    from gradient_routes.routes.differentiable import held_bytes

    u_0, made = model.initial(p), model.compiled.unrolled(inner, k, newton, checkpoint)
    what = f"{k} {inner} iterations" + (f" in each of {newton} Newton steps" if newton > 1 else "")

    def gradient(p: Array) -> Result:
        J, pullback, u = made.sweep(u_0, p)
        model.tally.count("forward_solves")
        model.tally.count("matvecs", made.products)
        dJ_dp, residual = made.sweep_back(pullback), model.relative_residual(np.asarray(u), p)
        return finished(u, J, dJ_dp, residual, held_bytes(pullback), what)

    return gradient


def through_newton(model: Model, k: int) -> Gradient:
    """The steps of a forward solve on the tape, the factors of each kept for its own transposed solve."""
    from gradient_routes.problems.jax64 import jax
    from gradient_routes.routes.differentiable import held_bytes
    from gradient_routes.routes.unrolled_newton import UnrolledNewton

    u_k = UnrolledNewton(model)
    objective = model.compiled.objective

    def gradient(p: Array) -> Result:
        steps, residual = model.newton_iterates(p, k)

        def with_state(p: Any) -> tuple[Any, Any]:
            u = u_k(steps, p)
            return objective(u, p), u

        J, pullback, u = jax.vjp(with_state, p, has_aux=True)
        tape = held_bytes(pullback) + sum(step.factors.nbytes for step in steps)
        return finished(u, J, pullback(1.0)[0], residual, tape, f"{k} Newton steps")

    return gradient


def through_march(model: Model, k: int, checkpoint: int | None) -> Gradient:
    """The same in every step in time, one after another."""
    from gradient_routes.routes.unrolled_march import UnrolledMarch

    sweep = UnrolledMarch(model, k, checkpoint)

    def gradient(p: Array) -> Result:
        found = sweep(p)
        left, tape = found.residual or 0.0, found.tape or 0
        return finished(found.u, found.J, found.gradient, left, tape, f"{k} Newton steps in every step")

    return gradient


def finished(u: Any, J: Any, dJ_dp: Any, residual: float, tape: int, what: str) -> Result:
    """The result. Raises Overflow where a sweep exceeded the range of float64."""
    dJ_dp = np.asarray(dJ_dp)
    if not np.isfinite(J):
        raise Overflow(
            f"unrolled-ad: J = {J:g} after {what}: the iteration diverges from the initial state - take implicit-ad"
        )
    if not np.isfinite(dJ_dp).all():
        raise Overflow(
            f"unrolled-ad: J = {J:g}, but the backward sweep of {what} overflowed: it amplifies rounding where R_u is"
            " ill-conditioned - iterate less, or take implicit-ad or adjoint"
        )
    return Result(float(J), dJ_dp, np.asarray(u), residual, tape=tape)
