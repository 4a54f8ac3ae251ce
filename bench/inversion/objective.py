"""J and its gradient as an optimizer asks for them: counted, scaled, and walled where J is not defined."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.variables import Variables
from gradient_routes.problems.errors import DomainError, NotConverged, Overflow, SingularMatrix
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Options, Route

OUTSIDE = (DomainError, NotConverged, SingularMatrix, Overflow, FloatingPointError)
SAME = 1e-5  # of J: no tolerance of a forward solve
STEEP = 10.0  # the wall's slope, in slopes of J at the last accepted step


@dataclass(frozen=True)
class Evaluation:
    """J and dJ/dx at x, with p and dJ/dp, u and lam of routes that have them; `outside` says why where J is not
    defined, and J is a wall.
    """

    x: Array
    p: Array
    J: float
    by_x: Array
    gradient: Array
    outside: str | None = None
    u: Array | None = None
    lam: Array | None = None


class Objective:
    """x -> (J / J_0, dJ/dx / J_0) by a route, J_0 the value at the start: numbers near one.

    Where p leaves its domain or the forward solve fails, J rises like a wall behind the last accepted step, so that a
    line search comes back; `outside` of the evaluation says why.
    """

    def __init__(self, problem: Problem, route: Route, options: Options, solver: Solver, variables: Variables) -> None:
        self.problem, self.route, self.variables = problem, route, variables
        self.model = Model(problem, solver)
        self.begun = time.perf_counter()
        self._solver, self._options = solver, options
        self._gradient: Any = None
        self.accepted: Evaluation | None = None
        self.tried: list[Evaluation] = []  # since the last accepted step
        self.J_0, self.slope_0 = 1.0, 0.0  # J and |dJ/dx| at the start

    def start(self, p: Array) -> Evaluation:
        """The first evaluation; what is raised there is raised."""
        options = self.route.resolve(self.model, p, **self._options)
        self._gradient = self.route.prepare(self.model, p, **options)
        self.accepted = self._evaluate(self.variables.x(p))
        self.J_0 = abs(self.accepted.J) or 1.0
        self.slope_0 = norm2(self.accepted.by_x)
        return self.accepted

    def __call__(self, x: Array) -> tuple[float, Array]:
        found = self.at(np.asarray(x, dtype=np.float64))
        return found.J / self.J_0, found.by_x / self.J_0

    def at(self, x: Array) -> Evaluation:
        """What is known at x, computed once."""
        assert self.accepted is not None
        for known in (self.accepted, *reversed(self.tried)):
            if np.array_equal(known.x, x):
                return known
        try:
            found = self._evaluate(x)
        except OUTSIDE as error:
            found = self._wall(x, str(error))
        self.tried.append(found)
        return found

    def accept(self, x: Array) -> Evaluation:
        """The step the optimizer has taken."""
        self.accepted = self.at(x)
        self.tried = []
        return self.accepted

    def doubt(self) -> str | None:
        """What is odd about the J that the route returns at the start; a forward solve, or two, that nobody counts."""
        assert self.accepted is not None
        model, p, J = Model(self.problem, self._solver), self.accepted.p, self.accepted.J
        own = model.value(p)
        if abs(J - own) <= SAME * abs(own) or abs(model.value(p) - own) > 0.1 * abs(J - own):  # the same, or noise
            return None
        return f"J of the route, {J:.6g}, is not that of the problem, {own:.6g}: what it finds is another minimum"

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
        """Linearized and transposed solves, Newton steps left out."""
        work = self.model.tally.work
        return work.transposed_solves + max(0, work.solves - work.newton_iterations)

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self.begun

    def _evaluate(self, x: Array) -> Evaluation:
        p = self.problem.parameters.check(self.variables.p(x), self.problem.name)
        with np.errstate(all="ignore"):
            J, gradient, u, _, lam, _ = self._gradient(p)
            J = self.model.value(p) if J is None else float(J)
        g = np.asarray(gradient, dtype=np.float64)
        if not (np.isfinite(J) and np.isfinite(g).all()):
            raise Overflow(f"{self.problem.name}: J = {J}, |dJ/dp| = {norm2(g)} at a step - choose another start")
        return Evaluation(x.copy(), p, J, g * self.variables.slope(x), g, u=u, lam=lam)

    def _wall(self, x: Array, why: str) -> Evaluation:
        last = self.accepted
        assert last is not None
        rise = STEEP * abs(float(last.by_x @ (x - last.x)))
        return Evaluation(x.copy(), last.p, last.J + rise, -STEEP * last.by_x, last.gradient, why)
