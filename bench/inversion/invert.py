"""One inversion: J minimized by an optimizer with the gradients of a route, every accepted step recorded."""

from __future__ import annotations

import shlex
import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec, point
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion import fit_rows
from gradient_routes.bench.inversion.columns import RUN
from gradient_routes.bench.inversion.confirmation import confirmed
from gradient_routes.bench.inversion.diagnosis import MISLED
from gradient_routes.bench.inversion.fit import Fit, fit
from gradient_routes.bench.inversion.history import History, Iterate, Watch
from gradient_routes.bench.inversion.linear_regime import LinearRegime, at_rest
from gradient_routes.bench.inversion.objective import Evaluation, Objective, observed
from gradient_routes.bench.inversion.optimizers import (
    Limits,
    Name,
    Stopped,
    check_noise,
    converged,
    flat,
    optimizer,
    stopped_at_noise,
)
from gradient_routes.bench.inversion.variables import Positive, Variables
from gradient_routes.problems.errors import OUTSIDE, RoutesError
from gradient_routes.problems.problem import Array, Offers, ParameterView, Problem
from gradient_routes.routes.measured_start import fitted_factor, small_strain_factor
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Options
from gradient_routes.routes.sensitivity import Sensitivity

FAR = 10.0  # times too soft or too stiff: a start from which an optimizer of size one has far to go
SHARED = tuple(column.name for column in RUN)


@dataclass(frozen=True)
class Engine:
    """How J is minimized."""

    optimizer: Name = "lbfgs"
    limits: Limits = field(default_factory=Limits)
    solver: Solver = field(default_factory=Solver)
    positive: Positive = "none"


@dataclass(frozen=True)
class Stop:
    """How the optimizer itself stopped, before differences of J were asked.

    says           its reason
    evaluations    of J and its gradient
    shortest_step  |x - x_k| of the shortest step tried in vain after the last one, x being p in natural changes
    """

    says: str
    evaluations: int
    shortest_step: float | None


@dataclass(frozen=True)
class Inversion:
    """The result: fields are columns of its table, and the arrays behind them.

    p, gradient (n_p,) at the end; start p_0; truth where known; view: the problem's own columns
    end      why it stopped; stop: why the optimizer itself did; interrupted: by Ctrl-C
    ending_solves  forward solves after the last step, to explain or to confirm the end
    scaled   the units of the optimizer's variables; warning: what is wrong with them
    fit      residuals and error bars, where data were measured
    regime   what the problem linearized at u = 0 reads there, where noise is known and R nonlinear in u
    """

    problem: str
    problem_options: Options
    at: str
    n_state: int
    n_param: int
    route: str
    route_options: Options
    optimizer: str
    alpha: float
    label: str
    iterates: tuple[Iterate, ...] = field(repr=False)
    made: Problem = field(repr=False)
    start: Array = field(repr=False)
    p: Array = field(repr=False)
    gradient: Array = field(repr=False)
    truth: Array | None = field(repr=False)
    view: ParameterView = field(repr=False)
    end: str = field(repr=False)
    stop: Stop = field(repr=False)
    ending_solves: int = field(repr=False)
    interrupted: bool = field(repr=False)
    warning: str | None = field(repr=False)
    scaled: str = field(repr=False)
    fit: Fit | None = field(default=None, repr=False)
    regime: LinearRegime | None = field(default=None, repr=False)

    @property
    def misled(self) -> bool:
        """Whether the gradient has turned out not to be that of J."""
        return self.end.startswith(MISLED)

    @property
    def unexplained(self) -> bool:
        """Whether the model does not explain the data: residuals exceed their noise, or the data themselves."""
        return self.fit is not None and self.fit.residuals.unexplained

    @property
    def linear_regime(self) -> str | None:
        return None if self.regime is None else self.regime.described("the problem linearized at u = 0")

    @property
    def forward_solves(self) -> int:
        """All of them."""
        return self.iterates[-1].forward_solves + self.ending_solves

    @property
    def shared(self) -> Row:
        return {name: getattr(self, name) for name in SHARED}

    @property
    def tables(self) -> dict[str, list[Row]]:
        """Tidy: one row an iterate, one a parameter; where data were measured one of the fit, and one a datum."""
        last = len(self.iterates) - 1
        rows = [self.shared | asdict(iterate) | {"ending_solves": None} for iterate in self.iterates]
        rows[last]["ending_solves"] = self.ending_solves
        doubt = self.fit.residuals.described.replace("\n", "; ") if self.fit is not None and self.unexplained else None
        says = (rows[last]["says"], self.end, self.linear_regime, doubt, *self.view.remarks)
        rows[last]["says"] = "; ".join(filter(None, says))
        found = {"inversion": rows, "estimates": [self.shared | self._estimate(i) for i in range(self.n_param)]}
        if self.fit is None:
            return found
        each = [self.shared | row for row in fit_rows.of_each(self.fit)]
        said = [self.shared | row for row in fit_rows.of_constants(self.fit)]
        return found | {"constants": said, "fit": [self.shared | fit_rows.of_all(self.fit)], "residuals": each}

    def _estimate(self, i: int) -> Row:
        q = self.made.parameters
        x: list[Any] = [None, None, None] if q.position is None else [*q.position[i].tolist(), None, None][:3]
        return {
            "parameter": q.label(i),
            **dict(zip("xyz", x, strict=True)),
            "start": self.start[i],
            "estimate": self.p[i],
            "sd": None if self.fit is None or np.isnan(self.fit.sd[i]) else self.fit.sd[i],
            "truth": None if self.truth is None else self.truth[i],
            "gradient": self.gradient[i],
            "blind": None if self.view.blind is None else int(self.view.blind[i]),
        }


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
        shown = view(problem, last, engine.solver, complete=not interrupted)
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
    """The problem and p from a stiffness that the data fit best, where p is more than a decade off; and what to say."""
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


def view(problem: Problem, found: Evaluation, solver: Solver, complete: bool = True) -> ParameterView:
    """What the problem shows beside the gradient at the end (for the bar, its strains) and the blind parameters.

    A route that returns no state, such as finite differences, costs one forward solve here, and a problem that does
    not know its blind parameters one forward and one adjoint solve; none of them is counted. Without `complete` only
    what needs no solve is shown.
    """
    if Offers.SOLVE not in problem.offers or (found.u is None and not complete):
        return ParameterView()
    model, u = Model(problem, solver), found.u
    try:
        u = model.solve(found.p).u if u is None else u
    except OUTSIDE:  # a solve from scratch may fail where the route arrived by small steps
        return ParameterView()
    shown = problem.view(found.p, u, found.lam)
    seen = problem.observation(u, found.p)
    if shown.blind is not None or not complete or seen is None or not len(seen.data):
        return shown
    try:
        return replace(shown, blind=Sensitivity(model, model.solve(found.p)).blind())
    except OUTSIDE:
        return shown
