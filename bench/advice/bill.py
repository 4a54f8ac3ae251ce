"""What every route is predicted to cost and how wrong it is expected to be: its own declared work, priced."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

from gradient_routes.bench.advice import stand_in
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.advice.memory import held, states_kept
from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.case import selector_of
from gradient_routes.bench.execution.cost_model import Prices
from gradient_routes.bench.units import duration, size
from gradient_routes.problems.problem import Problem
from gradient_routes.routes.finite_difference import EPS
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Options, Route
from gradient_routes.routes.tally import Work

VARIANTS: dict[str, tuple[Options, ...]] = {
    "fd-one-sided": ({"start": "chord"},),
    "fd-central": ({"start": "chord"},),
    "adjoint": ({"correct": "yes"}, {"checkpoint": "sqrt"}, {"checkpoint": "revolve"}),
    "implicit-ad": ({"checkpoint": "sqrt"}, {"checkpoint": "revolve"}),
}
OF_THE_SOLUTION = ("tangent", "adjoint", "implicit-ad")  # and not of the iterate


@dataclass(frozen=True)
class Bill:
    """Of one route: the options it is to be taken with, and why it cannot be taken, None where it can.

    work     of one gradient, or Jacobian
    seconds  of all that are wanted
    memory   [byte] that it holds beside the factors and a few vectors, see `memory`
    error    relative, to be expected of the gradient on a well-scaled problem
    """

    route: Route
    options: Options
    work: Work
    seconds: float
    memory: float
    error: float
    objection: str | None

    @property
    def selector(self) -> str:
        return selector_of("route", self.route.name, self.options)

    @property
    def kind(self) -> str:
        """The route and its variant, whatever its numbers: of states kept, of iterations, its step."""
        numbers = ("step", "iterations")
        kept = {key: value.partition("=")[0] for key, value in self.options.items() if key not in numbers}
        return selector_of("route", self.route.name, kept)


@dataclass(frozen=True)
class Asked:
    """What all bills for the same answers share."""

    answers: Answers
    problem: Problem
    model: Model
    prices: Prices

    @classmethod
    def of(cls, answers: Answers) -> Asked:
        model = stand_in.model(answers)
        return cls(answers, model.problem, model, stand_in.prices(answers))

    def bill(self, route: Route, variant: Options) -> Bill | None:
        """None for a variant that the problem does not have."""
        answers = self.answers
        options = self._options(route, variant)
        if options is None:
            return None
        objection = self.problem_says(route, options)
        if objection and variant:
            return None
        if objection:
            return Bill(route, options, Work(), math.inf, math.inf, math.inf, objection)
        full = route.defaults | route.expect(self.model, stand_in.NOWHERE, **route.defaults | options)
        work = work_of(route, full, answers, self.prices.declared)
        seconds = answers.gradients * self.prices.seconds(work)
        tape = None if route.tape is None else route.tape(self.problem, **full)
        memory = held(answers, route, full, tape)
        error = expected_error(route, options, answers)
        return Bill(route, options, work, seconds, memory, error, self._unaffordable(seconds, memory))

    def problem_says(self, route: Route, options: Options) -> str | None:
        if self.answers.iterate and route.name in OF_THE_SOLUTION:
            return f"{route.name} gives the derivative of the solution, not that of the iterate"
        return route.objection(self.problem, **options)

    def _options(self, route: Route, variant: Options) -> Options | None:
        """The variant in numbers: the step that suits the noise, the states that there is memory for."""
        answers, options = self.answers, dict(variant)
        if answers.iterate and "start" in options:
            return None  # another iterate than that of a cold solve
        if options.get("checkpoint") == "revolve":
            kept = states_kept(answers)
            return None if kept is None else options | {"checkpoint": f"revolve={kept}"}
        if route.step is not None and "step" in route.defaults and noise(answers) > 10 * EPS:
            options["step"] = float(f"{noise(answers) ** share(route.step):.0e}")
        if "iterations" in route.defaults and not (answers.linear and self.problem.structure == "spd"):
            options["iterations"] = answers.newton
        return options

    def _unaffordable(self, seconds: float, memory: float) -> str | None:
        answers = self.answers
        if seconds > answers.budget:
            return f"takes {duration(seconds)}, more than {duration(answers.budget)}"
        if memory > answers.memory:
            return f"holds {size(memory)}, more than {size(answers.memory)}"
        return None


def bills(answers: Answers) -> list[Bill]:
    """Of every registered route that is sound, in their order, each with the variants that there are."""
    asked = Asked.of(answers)
    made = (asked.bill(route, variant) for route, variant in candidates())
    return [bill for bill in made if bill is not None]


@cache
def candidates() -> tuple[tuple[Route, dict[str, Any]], ...]:
    routes = [entry.load() for entry in registry.entries("route").values() if entry.sound]
    return tuple((route, variant) for route in routes for variant in ({}, *VARIANTS.get(route.name, ())))


def work_of(route: Route, options: Options, answers: Answers, forward: ForwardWork) -> Work:
    """Declared for the gradient of one J. Of a Jacobian of m data, what grows with n_p is no more; a route that goes
    backwards goes m times: m - 1 times the substitutions, products and steps beyond those of a forward solve again.
    """
    once = route.cost(answers.n_p, forward, **options)
    if answers.outputs == 1 or once != route.cost(answers.n_p + 1, forward, **options):
        return once
    back = once - forward.cold
    again = Work(
        matvecs=max(0, back.matvecs),
        solves=max(0, back.solves),
        transposed_solves=back.transposed_solves,
        steps=max(0, back.steps),
    )
    return once + (answers.outputs - 1) * again


def noise(answers: Answers) -> float:
    """Relative, of J; of the last iterate, which is what is asked for, rounding alone."""
    return EPS if answers.iterate else max(EPS, answers.rtol)


def share(step: float) -> float:
    """a where the step that a route takes is eps^a: 1/2 for one-sided, 1/3 for central differences. With noise eps the
    best step is eps^a and its error eps^(1 - a) (Dennis & Schnabel 1996, sec. 5.4).
    """
    return math.log(step) / math.log(EPS)


def expected_error(route: Route, options: Options, answers: Answers) -> float:
    """About, on a well-scaled problem with a well-conditioned R_u: the noise of J divided by the step; where nothing is
    divided, what solves leave, and its square where that is corrected. A step over a kink: as much as the gradient.
    """
    eps = noise(answers)
    if route.step is not None:
        return float(eps ** (1.0 - share(route.step))) if answers.smooth else 1.0
    if options.get("correct") == "yes" and answers.smooth:
        return max(EPS, eps**2)
    return max(eps, route.accuracy)
