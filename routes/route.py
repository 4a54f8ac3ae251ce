"""READ SECOND. What a route is: a method that computes (J, dJ/dp) at p, what it needs of a problem, and its cost."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import OFFERED_AS, Array, Offers, Problem
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.model import Model
from gradient_routes.routes.tally import Work


class Result(NamedTuple):
    """What a route returns; a plain tuple (J, gradient) is enough.

    J         objective at p, None where the route never evaluates it there
    gradient  dJ/dp (n_p,)
    u         the state (n_u,) the gradient belongs to
    residual  |R(u, p)|_inf achieved there, relative to |R(u_0, p)|_inf
    lam       adjoint state (n_u,), R_u^T lam = -J_u, where the route has one
    tape      bytes held between the forward and the backward sweep of AD
    du_dp     (n_u, k), columns of du/dp that were asked for
    peer      of another code's gradient: its name and versions, and the seconds and bytes that it measured itself
    initial   (n_p,), what of the gradient of a march is by its initial state, where the route tells it apart
    """

    J: float | None
    gradient: Array
    u: Array | None = None
    residual: float | None = None
    lam: Array | None = None
    tape: int | None = None
    du_dp: Array | None = None
    peer: Mapping[str, Any] | None = None
    initial: Array | None = None


Gradient = Callable[[Array], Result]
Options = dict[str, Any]
Affordable = Callable[[Options], bool]


def nothing_missing(problem: Problem, **options: Any) -> str | None:
    return None


def nothing_wrong(**options: Any) -> None:
    return None


def as_given(model: Model, p: Array, affordable: Affordable | None = None, **options: Any) -> Options:
    return options


@dataclass(frozen=True)
class Route:
    """A registered route. Make one with `@route`.

    name      as in selectors
    needs     what a problem must offer
    function  (model, p, **options) -> (J, gradient) or, where staged, -> a function of p returning that;
              its keyword-only parameters are the route's options
    cost      (n_p, forward, **options) -> Work: the declared work for n_p parameters and the ForwardWork of one solve
    check     (**options) raises InputError for values that are wrong for every problem
    missing   (problem, **options) -> a sentence saying what else `problem` lacks, or None
    resolve   (model, p, affordable, **options) -> options, data-dependent defaults filled in by measurement, which
              ends early where `affordable(options)` is false
    expect    (model, p, **options) -> options, the same by an inexpensive estimate
    tape      (problem, **options) -> bytes the AD tape is predicted to need for its iterations; None if unknown
    sound     False for one that `all` does not include: wrong on purpose, another code's, or of one problem alone
    accuracy  relative error its gradients have by nature on well-scaled problems; 0: that of the solver
    step      of differences of J, relative to max(|p_i|, scale_i): noise of J is divided by it; None: it takes none
    """

    name: str
    needs: Offers
    function: Callable[..., Any]
    cost: Callable[..., Work]
    staged: bool = False
    check: Callable[..., None] = nothing_wrong
    missing: Callable[..., str | None] = nothing_missing
    resolve: Callable[..., Options] = as_given
    expect: Callable[..., Options] = as_given
    tape: Callable[..., int | None] | None = None
    sound: bool = True
    accuracy: float = 0.0
    step: float | None = None

    @property
    def summary(self) -> str:
        """The equation it implements."""
        return " ".join((self.function.__doc__ or "").strip().split("\n\n")[0].split())

    @cached_property
    def defaults(self) -> Options:
        """Its options with their defaults."""
        parameters = inspect.signature(self.function).parameters.values()
        return {q.name: q.default for q in parameters if q.kind is q.KEYWORD_ONLY}

    def objection(self, problem: Problem, **options: Any) -> str | None:
        """Why this route cannot run on `problem`, as a sentence; None if it can."""
        missing = [o for o in OFFERED_AS if o in self.needs and o not in problem.offers]
        if missing:
            return f"{self.name} needs {OFFERED_AS[missing[-1]]}, which {problem.name} does not offer"
        return self.missing(problem, **self.defaults | options)

    def prepare(self, model: Model, p: Array, **options: Any) -> Gradient:
        """What is done once for points near p, compilation for instance. Raises InputError for unknown options."""
        unknown = options.keys() - self.defaults.keys()
        if unknown:
            raise InputError(f"{self.name}: no option '{min(unknown)}' - choose from {', '.join(self.defaults)}")
        options = self.defaults | options
        self.check(**options)
        options = self.resolve(model, p, **options)
        gradient = self.function(model, p, **options) if self.staged else partial(self.function, model, **options)
        return lambda q: Result(*gradient(q))


def route(name: str, *, needs: Offers, cost: Callable[..., Work], **more: Any) -> Callable[[Callable[..., Any]], Route]:
    """Decorator: the function (model, p, *, options) -> (J, gradient) becomes the Route `name`."""
    return lambda function: Route(name, needs, function, cost, **more)


__all__ = ["Affordable", "ForwardWork", "Gradient", "Offers", "Options", "Result", "Route", "Work", "route"]
