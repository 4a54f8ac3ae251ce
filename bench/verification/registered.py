"""A registered problem and route as the subject of a check."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import replace

import numpy as np

from gradient_routes.bench.execution.error_estimate import error_estimate
from gradient_routes.bench.execution.slopes import complex_slopes
from gradient_routes.bench.verification.factors import SOLVED, Factors, assembly
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.result import BY_SOLVE
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.corrected import adjoint_at
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.route import Options, Result, Route
from gradient_routes.routes.synthetic_data import with_synthetic_data

LARGEST = 30_000  # unknowns of a finer mesh: some tens of forward solves there take a minute
LEAST_RTOL = 1e-15  # below, residuals are rounding
TIGHT = Solver(rtol=1e-14)  # of reference gradients, whatever the solver under test


def subject(problem: Problem, route: Route, options: Options, p: Array, solver: Solver) -> Subject:
    """J by forward solves from scratch, dJ/dp by the route. Raises InputError where the route cannot run on it."""
    objection = route.objection(problem, **options)
    if objection is not None:
        raise InputError(f"check: {objection} - choose another route or problem")
    parameters, model, offers = problem.parameters, Model(problem, solver), problem.offers
    lower, upper = (np.broadcast_to(bound, p.shape) for bound in (parameters.lower, parameters.upper))
    last: list[Result] = []

    def gradient(p: Array) -> Array:
        last[:] = [route.prepare(model, p, **options)(p)]
        return last[0].gradient

    def tighten(factor: float) -> Subject:
        return subject(problem, route, _iterated(options, factor), p, tighter(solver, factor))

    def refine() -> Subject | None:
        found = problem.refined(p)
        if found is None:
            return None
        finer, q = found
        if finer.n_state > LARGEST:
            raise InputError(
                f"{finer.n_state} unknowns on the finer mesh, {LARGEST} at most - start from a coarser one"
            )
        return subject(with_synthetic_data(finer), route, options, q, solver)

    made = Subject(
        name=f"{route.name} on {problem.name}",
        objective=model.value,
        gradient=gradient,
        p=p,
        scale=parameters.scale,
        lower=lower,
        upper=upper,
        closed=False,
        label=parameters.label,
        tighten=tighten,
        refine=refine if Offers.REFINED in problem.offers else None,
        active_set=_active_set(problem, solver),
        again=lambda q: subject(problem, route, options, q, solver),
        accuracy=route.accuracy,
    )
    if Offers.COMPLEX in offers:
        made = replace(made, slopes=lambda V: complex_slopes(Model(problem, TIGHT), p, V))
    if Offers.LINEARIZE in offers:
        made = replace(made, exact=lambda: exact(problem, p), explain=lambda g: explain(model, last[0], p, g))
    return made


def tighter(solver: Solver, factor: float) -> Solver:
    """Tolerances times the factor, and one Newton step more: near the solution a tolerance alone may change nothing."""

    def tight(rtol: float, least: float) -> float:
        return max(min(rtol, least), rtol * factor)

    adjoint_rtol = tight(solver.adjoint_rtol, Solver.adjoint_rtol)
    return replace(solver, rtol=tight(solver.rtol, LEAST_RTOL), adjoint_rtol=adjoint_rtol, polish=1)


def _iterated(options: Options, factor: float) -> Options:
    """More iterations for routes that differentiate iterates: no tolerance makes their gradient more accurate."""
    k = options.get("iterations")
    return options if k is None else options | {"iterations": round(k * factor**-0.3)}


def _active_set(problem: Problem, solver: Solver) -> Callable[[Array], Hashable] | None:
    """p -> active set of the solved state; None where the problem has none."""
    if Offers.SOLVE | Offers.ACTIVE_SET not in problem.offers:
        return None
    model = Model(problem, solver)

    def active_set(q: Array) -> Hashable:
        try:
            return problem.active_set(model.solve(q).u, q)
        except RoutesError:
            return None

    return active_set


def exact(problem: Problem, p: Array) -> Array:
    """dJ/dp by the adjoint method, solved to a tight tolerance with new factors."""
    model = Model(problem, TIGHT)
    state = model.solve(p, polish=1)
    lin = model.linearize(state)
    lam = LinearizedSolver(model, state, "fresh").solve_transposed(-lin.J_u)
    return np.asarray(lin.J_p + lin.R_p.T @ lam)


def by_solve(model: Model, state: State, u: Array) -> Finding:
    """What the state u leaves in the gradient of an exact adjoint: no mistake of the route, whose own is not used."""
    gradient, lam = adjoint_at(model, state, u)
    left = error_estimate(model, state, adjoint, Result(None, gradient, u, lam=lam))
    return Finding(BY_SOLVE, math.nan if left is None else left, SOLVED)


def explain(model: Model, result: Result, p: Array, gradient: Array) -> list[Finding]:
    """The factors of the gradient, tested at the state that the route returned, or at a solved one."""
    problem = model.problem
    try:
        state = model.solve(p)
        u = state.u if result.u is None else np.asarray(result.u)
        return [*assembly(model, result, p, gradient), by_solve(model, state, u), *Factors(problem, u, p).findings()]
    except RoutesError as failure:
        return [Finding("factors of the gradient", float("nan"), 0.0, str(failure))]
