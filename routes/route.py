"""READ SECOND. What a route is: a way from p to (J, dJ/dp), what it needs, and what it says it will cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from problems.problem import OFFERED_AS, Array, Offers, Problem
from routes.model import Model
from routes.newton import ForwardWork
from routes.tally import Work


class Result(NamedTuple):
    """What a route returns; a plain tuple (J, gradient) will do.

    J         objective at p, None where the route never evaluates it there
    gradient  dJ/dp (n_p,)
    u         the state (n_u,) the gradient belongs to
    residual  |R(u, p)|_inf achieved there, relative to |R(u_0, p)|_inf
    lam       adjoint state (n_u,), R_u^T lam = -J_u, where the route has one
    tape      bytes held between the forward and the backward sweep of AD
    """

    J: float | None
    gradient: Array
    u: Array | None = None
    residual: float | None = None
    lam: Array | None = None
    tape: int | None = None


Gradient = Callable[[Array], Result]
Options = dict[str, Any]


def no_objection(problem: Problem, **options: Any) -> str | None:
    return None


def all_well(**options: Any) -> None:
    return None


def as_given(model: Model, p: Array, **options: Any) -> Options:
    return options


def no_tape(problem: Problem, **options: Any) -> int:
    return 0


@dataclass(frozen=True)
class Route:
    """A registered route. Make one with `@route`.

    name      as in selectors
    needs     what a problem must offer
    function  (model, p, **options) -> (J, gradient) or, where staged, -> a function of p returning that;
              its keyword-only parameters are the route's options
    cost      (n_p, forward, **options) -> Work: the declared bill, n_p parameters, ForwardWork of one solve
    check     (**options) raises InputError for values that no problem could take
    objects   (problem, **options) -> a sentence saying what else is missing, or None
    expect    (model, p, **options) -> options, data-dependent defaults filled in by a cheap estimate
    resolve   (model, p, **options) -> options, the same by measurement
    tape      (problem, **options) -> bytes the AD tape is predicted to need
    """

    name: str
    needs: Offers
    function: Callable[..., Any]
    cost: Callable[..., Work]
    staged: bool = False
    check: Callable[..., None] = all_well
    objects: Callable[..., str | None] = no_objection
    expect: Callable[..., Options] = as_given
    resolve: Callable[..., Options] = as_given
    tape: Callable[..., int] = no_tape

    @property
    def summary(self) -> str:
        """The equation it implements."""
        return " ".join((self.function.__doc__ or "").strip().split("\n\n")[0].split())

    def objection(self, problem: Problem, **options: Any) -> str | None:
        """Why this route cannot run on `problem`, in a sentence; None if it can."""
        missing = [o for o in OFFERED_AS if o in self.needs and o not in problem.offers]
        if missing:
            return f"{self.name} needs {OFFERED_AS[missing[-1]]}, which {problem.name} does not offer"
        return self.objects(problem, **options)

    def prepare(self, model: Model, p: Array, **options: Any) -> Gradient:
        """Everything done once for points near p (compilation, say); `options` as resolved."""
        gradient = self.function(model, p, **options) if self.staged else partial(self.function, model, **options)
        return lambda q: Result(*gradient(q))


def route(name: str, *, needs: Offers, cost: Callable[..., Work], **more: Any) -> Callable[[Callable[..., Any]], Route]:
    """Decorator: the function (model, p, *, options) -> (J, gradient) becomes the Route `name`."""
    return lambda function: Route(name, needs, function, cost, **more)


__all__ = ["ForwardWork", "Gradient", "Offers", "Options", "Result", "Route", "Work", "route"]
