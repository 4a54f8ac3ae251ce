"""A registered problem and route as the subject of a check."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.bench.execution.slopes import complex_slopes
from gradient_routes.bench.verification.factors import Factors, assembly
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Options, Result, Route
from gradient_routes.routes.synthetic_data import with_synthetic_data

LARGEST = 30_000  # unknowns of a finer mesh: some tens of forward solves there take a minute
LEAST_RTOL = 1e-15  # below, residuals are rounding
TIGHT = Solver(rtol=1e-14)  # of complex steps: a judge is no fellow of the judged


def subject(problem: Problem, route: Route, options: Options, p: Array, solver: Solver) -> Subject:
    """J by forward solves from scratch, dJ/dp by the route. Raises InputError where the route cannot run on it."""
    objection = route.objection(problem, **options)
    if objection is not None:
        raise InputError(f"check: {objection} - choose another route or problem")
    parameters, model = problem.parameters, Model(problem, solver)
    returned: list[Result] = []
    lower, upper = (np.broadcast_to(bound, p.shape) for bound in (parameters.lower, parameters.upper))
    offers = problem.offers

    def gradient(p: Array) -> Array:
        returned[:] = [route.prepare(model, p, **options)(p)]
        return returned[0].gradient

    return Subject(
        name=f"{route.name} on {problem.name}",
        objective=model.value,
        gradient=gradient,
        p=p,
        scale=parameters.scale,
        lower=lower,
        upper=upper,
        closed=False,
        label=parameters.label,
        tighten=lambda factor: subject(problem, route, _more(options, factor), p, _tighter(solver, factor)),
        active_set=_active_set(problem, solver),
        refine=_refined(problem, route, options, p, solver),
        exact=(lambda: exact(problem, p)) if Offers.LINEARIZE in offers else None,
        slopes=(lambda V: complex_slopes(Model(problem, TIGHT), p, V)) if Offers.COMPLEX in offers else None,
        explain=(lambda g: explain(model, returned[0], p, g)) if Offers.LINEARIZE in offers else None,
        accuracy=route.accuracy,
    )


def _tighter(solver: Solver, factor: float) -> Solver:
    """Tolerances times the factor, and a Newton step more: where steps square |R|, a tolerance may change nothing."""

    def tight(rtol: float, least: float) -> float:
        return max(min(rtol, least), rtol * factor)

    adjoint_rtol = tight(solver.adjoint_rtol, Solver.adjoint_rtol)
    return replace(solver, rtol=tight(solver.rtol, LEAST_RTOL), adjoint_rtol=adjoint_rtol, polish=1)


def _more(options: Options, factor: float) -> Options:
    """An iterate's gradient comes nearer the solution's with more iterations, not with a tolerance."""
    k = options.get("iterations")
    return options if k is None else options | {"iterations": round(k * factor**-0.3)}


def _active_set(problem: Problem, solver: Solver) -> Callable[[Array], Hashable] | None:
    """Of the state at p; None where the problem has none."""
    if Offers.SOLVE | Offers.ACTIVE_SET not in problem.offers:
        return None
    model = Model(problem, solver)

    def active_set(q: Array) -> Hashable:
        try:
            return problem.active_set(model.solve(q).u, q)
        except RoutesError:
            return None

    return active_set


def _refined(
    problem: Problem, route: Route, options: Options, p: Array, solver: Solver
) -> Callable[[], Subject | None] | None:
    """The route on the problem with half the mesh size. Raises InputError where that has too many unknowns."""
    if Offers.REFINED not in problem.offers:
        return None

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

    return refine


def exact(problem: Problem, p: Array) -> Array:
    """dJ/dp by the adjoint method, solved tightly and with new factors."""
    model = Model(problem, TIGHT)
    state = model.solve(p, polish=1)
    lin = model.linearize(state)
    lam = LinearizedSolver(model, state, "fresh").solve_transposed(-lin.J_u)
    return np.asarray(lin.J_p + lin.R_p.T @ lam)


def explain(model: Model, result: Result, p: Array, gradient: Array) -> list[Finding]:
    """The error budget, at the state the route returned, or at one solved for."""
    problem = model.problem
    u: Any = result.u
    try:
        if u is None:
            u = model.solve(p).u
        return [*assembly(model, result, p, gradient), *Factors(problem, np.asarray(u), p).findings()]
    except RoutesError as failure:
        return [Finding("error budget", float("nan"), 0.0, str(failure))]
