"""J and its gradient as an optimizer calls them: scaled, counted, and extended where J is not defined."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.variables import Variables
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import OUTSIDE, Overflow, RoutesError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Options, Route

SAME = 1e-5  # relative difference of J that a forward tolerance explains
STEEP = 10.0  # slope of the extension, in slopes of J at the last accepted step


@dataclass(frozen=True)
class Evaluation:
    """J and dJ/dx at x, with p, dJ/dp, and u and lam of routes that have them.

    outside  why J is not defined at x, where it is not: J is then an extension of the last accepted step
    """

    x: Array
    p: Array
    J: float
    by_x: Array
    gradient: Array
    outside: str | None = None
    u: Array | None = None
    lam: Array | None = None


def observed(problem: Problem, p: Array) -> Observation | None:
    """The data term at u_0, the state that solves start from."""
    try:
        return problem.observation(problem.initial(p), p)
    except RoutesError:
        return None


def size_of_data(problem: Problem, p: Array) -> float:
    """1/2 |d - S u_0|^2 where p is a stiffness, 1/2 |d|^2 where data are counted from rest: no start changes either;
    0 elsewhere.

    There d(S u) is about -S u for a natural change of all of p: the slope of a J that explains half of the data.
    Elsewhere data may be large and vary little, and nothing but the start tells a slope.
    """
    seen = None if problem.scaled(p, 1.0) is None and not problem.from_rest else observed(problem, p)
    if seen is None:
        return 0.0
    return 0.5 * float(np.sum((seen.data if problem.from_rest else seen.data - seen.predicted) ** 2))


def noise_level(problem: Problem, p: Array) -> float:
    """1/2 sigma^2 m, the misfit that noise alone leaves, m without what is eliminated; 0 where noise is not known.

    Neither depends on the state.
    """
    seen = observed(problem, p)
    if seen is None:
        return 0.0
    m = len(seen.data) - (0 if seen.modes is None else seen.modes.shape[1])
    return 0.5 * seen.sigma**2 * m


class Objective:
    """x -> (J / J_0, dJ/dx / J_0) by a route, J_0 the value at the start: numbers near one.

    Where p leaves its domain or the forward solve fails, J rises steeply from the last accepted step, so that a line
    search shortens its step.
    """

    def __init__(self, problem: Problem, route: Route, options: Options, solver: Solver, variables: Variables) -> None:
        self.problem, self.route, self.variables = problem, route, variables
        self.model = Model(problem, solver)
        self.begun = time.perf_counter()
        self.tried: list[Evaluation] = []  # since the last accepted step
        self.J_0, self.slope_0 = 1.0, 0.0  # J and |dJ/dx| at the start
        self.slope_scale, self.slope_scale_is = 0.0, ""  # what |dJ/dx| is called small against, for natural changes
        self.evaluations = 0
        self._options = options
        self._gradient: Any = None
        self._accepted: Evaluation | None = None

    def start(self, p: Array, p_0: Array | None = None) -> Evaluation:
        """The first evaluation. Raises what the route raises there.

        p_0  whose slope others are compared with where p, from an inversion before, has hardly any left [p]
        """
        options = self.route.resolve(self.model, p, **self._options)
        self._gradient = self.route.prepare(self.model, p, **options)
        first = self._accepted = self._evaluate(self.variables.x(p))
        self.J_0, self.slope_0 = abs(first.J) or 1.0, norm2(first.by_x)
        self.slope_scale, self.slope_scale_is = size_of_data(self.problem, p), "1/2 |d|^2"
        if not self.slope_scale:
            before = 0.0 if p_0 is None else norm2(self._evaluate(self.variables.x(p_0)).by_x)
            self.slope_scale, self.slope_scale_is = before or self.slope_0, "that at the start"
        return first

    def with_solver(self, solver: Solver) -> Objective:
        """The same J and route by other forward solves; to be started."""
        return Objective(self.problem, self.route, self._options, solver, self.variables)

    @property
    def accepted(self) -> Evaluation:
        """The last accepted step; after `start` only."""
        assert self._accepted is not None
        return self._accepted

    def __call__(self, x: Array) -> tuple[float, Array]:
        found = self.at(np.asarray(x, dtype=np.float64))
        return found.J / self.J_0, found.by_x / self.J_0

    def at(self, x: Array) -> Evaluation:
        """J and its gradient at x, evaluated once."""
        for known in (self.accepted, *reversed(self.tried)):
            if np.array_equal(known.x, x):
                return known
        try:
            found = self._evaluate(x)
        except OUTSIDE as error:
            last = self.accepted
            rise = STEEP * abs(float(last.by_x @ (x - last.x)))
            found = Evaluation(x.copy(), last.p, last.J + rise, -STEEP * last.by_x, last.gradient, str(error))
        self.tried.append(found)
        return found

    def accept(self, x: Array) -> Evaluation:
        """Record the step that the optimizer has taken."""
        self._accepted, self.tried = self.at(x), []
        return self._accepted

    def doubt(self) -> str | None:
        """Whether the route returns another J than the problem at the start; by one or two uncounted solves."""
        model, p, J = Model(self.problem, self.model.solver), self.accepted.p, self.accepted.J
        own = model.value(p)
        if abs(J - own) <= SAME * abs(own) or abs(model.value(p) - own) > 0.1 * abs(J - own):  # the same, or noise
            return None
        return f"J of the route, {J:.6g}, is not that of the problem, {own:.6g}: it has another minimum"

    def misfit(self, found: Evaluation) -> tuple[float, float]:
        """1/2 |S u - d|^2 and alpha Phi."""
        prior = self.problem.prior(found.p)
        regularization = 0.0 if prior is None else float(prior[0].value(np, prior[1]))
        return found.J - regularization, regularization

    @property
    def forward_solves(self) -> int:
        return self.model.tally.work.forward_solves

    @property
    def adjoint_solves(self) -> int:
        """Linearized and transposed solves, without those of Newton steps."""
        work = self.model.tally.work
        return work.transposed_solves + max(0, work.solves - work.newton_iterations)

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self.begun

    def _evaluate(self, x: Array) -> Evaluation:
        p = self.problem.parameters.check(self.variables.p(x), self.problem.name)
        self.evaluations += 1
        with np.errstate(all="ignore"):
            found = self._gradient(p)
            J = self.model.value(p) if found.J is None else float(found.J)
        g = np.asarray(found.gradient, dtype=np.float64)
        if not (np.isfinite(J) and np.isfinite(g).all()):
            raise Overflow(f"{self.problem.name}: J = {J}, |dJ/dp| = {norm2(g)} at a step - choose another start")
        return Evaluation(x.copy(), p, J, g * self.variables.slope(x), g, u=found.u, lam=found.lam)
