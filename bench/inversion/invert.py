"""One inversion: J minimized by an optimizer with the gradients of a route, every accepted step recorded."""

from __future__ import annotations

import shlex
import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field, replace

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec, point
from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.confirmation import confirmed
from gradient_routes.bench.inversion.diagnosis import MISLED
from gradient_routes.bench.inversion.fit import fit
from gradient_routes.bench.inversion.history import History, Watch
from gradient_routes.bench.inversion.linear_regime import at_rest
from gradient_routes.bench.inversion.objective import Evaluation, Objective, observed
from gradient_routes.bench.inversion.optimizers import (
    Limits,
    Name,
    Stopped,
    check_noise,
    converged,
    flat,
    optimizer,
    spent,
    stopped_at_noise,
)
from gradient_routes.bench.inversion.result import Inversion, Stop
from gradient_routes.bench.inversion.variables import Positive, Variables
from gradient_routes.problems.errors import OUTSIDE, RoutesError
from gradient_routes.problems.problem import Array, Offers, ParameterView, Problem
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.measured_start import fitted_factor, small_strain_factor
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity

__all__ = ["Engine", "Inversion", "invert"]

BY_DATA = ("gauss-newton", "levenberg-marquardt", "trust")  # optimizers whose gradient is H^T r
FAR = 10.0  # times too soft or too stiff: a start from which an optimizer of size one has far to go


@dataclass(frozen=True)
class Engine:
    """How J is minimized."""

    optimizer: Name = "lbfgs"
    limits: Limits = field(default_factory=Limits)
    solver: Solver = field(default_factory=Solver)
    positive: Positive = "none"


def invert(
    spec: ProblemSpec,
    route: RouteSpec,
    engine: Engine,
    at: str = "start",
    start: Array | None = None,
    watch: Watch = lambda iterate: None,
    made: Problem | None = None,
    run: Callable[..., str] | None = None,
    offset: int = 0,
) -> Inversion:
    """Minimize J of a problem, from `start` if given. After Ctrl-C the result so far is returned.

    made  the problem if it is built already; run: an optimizer in place of the engine's
    Raises InputError, DomainError, and what the first evaluation raises.
    """
    import scipy.optimize  # noqa: F401 - loaded before the clock starts

    problem = made or spec()
    p_0 = point(problem, at)
    says = None
    if start is None:
        problem, p_0, says = of_the_size_of_data(problem, p_0, engine.solver)
    p = p_0 if start is None else problem.parameters.check(start, f"{problem.name}, resumed")
    objection = route.route.objection(problem, **route.options)
    if objection is not None:
        raise RoutesError(f"invert: {objection} - choose another route")
    variables = Variables.of(problem.parameters, p, engine.positive, problem.name)
    objective = Objective(problem, route.route, route.options, engine.solver, variables)
    check_noise(problem, engine.limits)
    history = History(objective, problem.truth(), p_0, watch, offset=offset)
    interrupted = False
    with redirect_stdout(sys.stderr), np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The line search algorithm")  # SciPy's: `end` tells more
        try:
            found = objective.start(p, None if start is None else p_0)
            doubt = objective.doubt()
            history.take(found, "; ".join(filter(None, (says, doubt))) or None)
            if engine.limits.at_noise and history.met:
                end = stopped_at_noise(history)
            elif run is None and objective.slope_0 == 0.0:
                end = "converged: dJ/dp is 0 at the start"
            elif run is None and flat(objective, found, engine.limits):
                end = converged(objective, engine.limits)
            elif engine.limits.iterations == 0:
                end = spent(engine.limits)
            else:
                end = (run or optimizer(engine.optimizer))(objective, history, engine.limits)
        except Stopped as ended:
            end = str(ended)
        except KeyboardInterrupt:
            if not history.iterates:
                raise
            end, interrupted = "interrupted", True
        stop = stopped(objective, end)
        try:
            if not interrupted:
                end = confirmed(objective, history, end, engine.limits.tolerance, doubted=doubt is not None)
        except KeyboardInterrupt:  # what has been found stays
            end, interrupted = f"{end}; not confirmed: interrupted", True
    if end.startswith(MISLED):
        end += f" - see {checked_by(spec, route, at)}"
    seen = observed(problem, p)
    last, ending = history.last, objective.forward_solves - history.iterates[-1].forward_solves
    assert last is not None
    try:
        shown = view(problem, last, engine.solver, not interrupted, engine.optimizer in BY_DATA)
    except KeyboardInterrupt:  # the result does not depend on the view
        shown, interrupted = ParameterView(), True
    return Inversion(
        spec.name,
        spec.options,
        at,
        problem.n_state,
        len(p),
        route.name,
        route.options,
        engine.optimizer,
        problem.alpha,
        f"{spec.selector} by {route.selector}, {engine.optimizer}",
        tuple(history.iterates),
        problem,
        p_0,
        last.p,
        last.gradient,
        history.truth,
        shown,
        end,
        stop,
        ending,
        interrupted,
        variables.warning(None if seen is None or seen.sigma else seen.data),
        f"{variables.described}; J in units of {objective.J_0:.4g}, that of the start",
        None if interrupted else fit(problem, last, engine.solver),
        None if interrupted else at_rest(problem, last, engine.solver),
    )


def of_the_size_of_data(problem: Problem, p: Array, solver: Solver) -> tuple[Problem, Array, str | None]:
    """The problem and p from a start that fits the data best, where p is more than a decade off; and what to say."""
    told = problem.told_by_data(p)
    if told is not None:
        other, off = told
        says = f"the start is what the data tell: the one given is off by a factor of {off:.3g}"
        return (problem, p, None) if off <= FAR else (other, other.parameters.start, says)
    model = Model(problem, solver)
    if Offers.SOLVE not in problem.offers or problem.scaled(p, 1.0) is None:
        return problem, p, None
    about = small_strain_factor(model, p)
    if about is None or 1.0 / FAR <= about <= FAR:
        return problem, p, None
    c = fitted_factor(model, p)
    q = None if c is None else problem.scaled(p, c)
    if c is None or q is None:
        return problem, p, None
    other = problem.stiffened(c)
    other.regularization = problem.regularization  # J stays what it was
    return other, q, f"the start is scaled to fit the data best, by a factor of {max(c, 1.0 / c):.3g}"


def stopped(objective: Objective, says: str) -> Stop:
    vain = [norm2(tried.x - objective.accepted.x) for tried in objective.tried]
    return Stop(says, objective.evaluations, min(vain, default=None))


def checked_by(spec: ProblemSpec, route: RouteSpec, at: str) -> str:
    """The command that judges the gradient."""
    words = ["routes", "check", "--problem", spec.selector, "--route", route.selector]
    return shlex.join(words if at == "start" else [*words, "--at", at])


def view(
    problem: Problem, found: Evaluation, solver: Solver, complete: bool = True, adjoint: bool = False
) -> ParameterView:
    """What the problem shows beside the gradient at the end (for the bar, its strains) and the blind parameters.

    A route that returns no state, such as finite differences, costs one forward solve here, and a problem that does
    not know its blind parameters one factorization and few linearized solves, an `adjoint` that the optimizer has not
    one of each; none of them is counted. Without `complete` only what needs no solve is shown.
    """
    if Offers.SOLVE not in problem.offers or (found.u is None and not complete):
        return ParameterView()
    model, u, lam = Model(problem, solver), found.u, found.lam
    try:
        u = model.solve(found.p).u if u is None else u
        if adjoint and lam is None and complete and Offers.LINEARIZE in problem.offers:
            state = model.state_at(u, found.p)
            lam = LinearizedSolver(model, state, "fresh").solve_transposed(-model.linearize(state).J_u)
    except OUTSIDE:  # a solve from scratch may fail where the route arrived by small steps
        return ParameterView()
    shown = problem.view(found.p, u, lam)
    seen = problem.observation(u, found.p)
    if shown.blind is not None or not complete or seen is None or not len(seen.data):
        return shown
    try:
        natural = problem.parameters.natural(found.p)
        return replace(shown, blind=Sensitivity(model, model.state_at(u, found.p), natural).blind())
    except OUTSIDE:
        return shown
