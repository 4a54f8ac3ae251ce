"""Finite differences of J. They need J only; the step balances truncation against rounding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.errors import DomainError, InputError
from gradient_routes.problems.problem import Array, Offers, Parameters, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Result, Work, route

Start = Annotated[
    Literal["cold", "warm", "chord"],
    "perturbed solves from the initial state; from the base state; from it with its factors",
]
StepOption = Annotated[float | None, "h_i / max(|p_i|, s_i) [sqrt(eps) one-sided, cbrt(eps) central]"]
EPS = float(np.finfo(np.float64).eps)
ONE_SIDED, CENTRAL = EPS ** (1 / 2), EPS ** (1 / 3)  # truncation and rounding are equal there
SCATTER = 1e3  # by which second derivatives and rounding of J exceed that balance on a well-scaled problem


def check(*, step: float | None, start: str) -> None:
    if step is not None and not (step > 0 and np.isfinite(step)):
        raise InputError(f"finite differences: step={step:g} - a step is finite and > 0")


def missing(problem: Problem, *, start: str, **options: Any) -> str | None:
    if start != "cold" and Offers.SOLVE not in problem.offers:
        return f"start={start} needs R(u, p) and R_u as numbers, which {problem.name} does not offer"
    if start != "cold" and problem.steps and not problem.linear:
        return f"start={start} needs one solve for the whole state, {problem.name} is solved step by step from rest"
    return None


def cost_one_sided(n_p: int, forward: ForwardWork, *, step: float | None, start: str) -> Work:
    return cold(forward, n_p + 1) if start == "cold" else near(forward, start)(n_p, step or ONE_SIDED)


def cost_central(n_p: int, forward: ForwardWork, *, step: float | None, start: str) -> Work:
    return cold(forward, 2 * n_p) if start == "cold" else near(forward, start)(2 * n_p, step or CENTRAL)


def cold(forward: ForwardWork, times: int) -> Work:
    return forward.full(times, polish=0) if forward.newton == "auto" else forward.solves(times)


def near(forward: ForwardWork, start: str) -> Callable[[int, float], Work]:
    return forward.warm if start == "warm" else forward.chord


@route(
    "fd-one-sided",
    needs=Offers.VALUE,
    cost=cost_one_sided,
    check=check,
    missing=missing,
    accuracy=SCATTER * ONE_SIDED,
    step=ONE_SIDED,
)
def fd_one_sided(model: Model, p: Array, *, step: StepOption = None, start: Start = "cold") -> Result:
    """(J(p + h_i e_i) - J(p)) / h_i,  h_i = sqrt(eps) max(|p_i|, s_i)."""
    h = steps(model.parameters, p, ONE_SIDED if step is None else step, "fd-one-sided", sides=(1,))
    J_near, J_base = objective_near(model, p, start)
    J = J_near(p) if J_base is None else J_base
    gradient = np.array([(J_near(shifted(p, i, h[i])) - J) / h[i] for i in range(len(p))])
    return Result(J, gradient)


@route(
    "fd-central",
    needs=Offers.VALUE,
    cost=cost_central,
    check=check,
    missing=missing,
    accuracy=SCATTER * CENTRAL**2,
    step=CENTRAL,
)
def fd_central(model: Model, p: Array, *, step: StepOption = None, start: Start = "cold") -> Result:
    """(J(p + h_i e_i) - J(p - h_i e_i)) / 2 h_i,  h_i = cbrt(eps) max(|p_i|, s_i)."""
    h = steps(model.parameters, p, CENTRAL if step is None else step, "fd-central", sides=(1, -1))
    J_near, J = objective_near(model, p, start)
    gradient = np.array(
        [(J_near(shifted(p, i, h[i])) - J_near(shifted(p, i, -h[i]))) / (2 * h[i]) for i in range(len(p))]
    )
    return Result(J, gradient)


def steps(parameters: Parameters, p: Array, relative: float, who: str, sides: tuple[int, ...]) -> Array:
    """h (n_p,), rounded so that (p + h) - p == h exactly.

    Raises DomainError for a step that leaves the domain or vanishes.
    """
    h: Array = (p + relative * parameters.natural(p)) - p
    for side in sides:
        q = p + side * h
        bad = np.flatnonzero((q <= parameters.lower) | (q >= parameters.upper))
        if bad.size:
            i = int(bad[0])
            name, (lower, upper) = parameters.label(i), parameters.bounds(i)
            bound = lower if q[i] <= lower else upper
            raise DomainError(
                f"{who}: the step {side * h[i]:g} from {name} = {p[i]:g} passes its bound {bound:g}"
                f" - choose step= below {abs(bound - p[i]) / abs(h[i]) * relative:.3g}"
            )
    if not h.all():
        i = int(np.flatnonzero(h == 0)[0])
        raise DomainError(
            f"{who}: step={relative:g} does not change {parameters.label(i)} = {p[i]:g} - choose step= above {EPS:.1e}"
        )
    return h


def shifted(p: Array, i: int, h: float) -> Array:
    q = p.copy()
    q[i] += h
    return q


def by_full_steps(model: Model) -> Model:
    """Where steps are chosen for us: the noise that inexact ones leave in J, below rtol, would be divided by h."""
    if model.solver.newton != "auto":
        return model
    return Model(model.problem, replace(model.solver, newton="full"), model.tally)


def objective_near(model: Model, p: Array, start: str) -> tuple[Callable[[Array], float], float | None]:
    """J as a function of points near p, and J(p) where making that function took a solve at p."""
    if start == "cold":
        return by_full_steps(model).value, None
    base = model.solve(p, polish=1)  # else the remaining residual, 1e-12, would be divided by h = 1e-8
    factors = base.factors if start == "chord" else None
    return lambda q: float(model.solve(q, base, factors).J), float(base.J)
