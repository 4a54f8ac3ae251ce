"""A code of somebody else as a route: an adapter is told the case, and asked for J and dJ/dp."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.foreign.command import Command, command_of, words_of
from gradient_routes.routes.foreign.manifest import Manifest
from gradient_routes.routes.foreign.peer import AdapterError, Peer, shown
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import ForwardWork, Gradient, Result, Route, Work, route

PHASES = ("forward_s", "backward_s", "compile_s")  # wall time [s] that an adapter measures itself
MOST = 1e300  # of a number: JSON has integers of any size


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    """None of ours."""
    return Work()


class Foreign:
    """A started adapter that has loaded a problem's case. Raises what Peer does, and the adapter's own errors."""

    def __init__(self, command: Command, who: str, problem: Problem) -> None:
        self.who, self.options = who, command.options
        self.peer = Peer(command.words, who)
        self.peer.ask("load", case=problem.case())

    @property
    def tightens(self) -> bool:
        """Whether its forward solve heeds rtol."""
        return self.peer.about.get("tighten") is True

    def value(self, p: Array, solver: Solver) -> float:
        """J(p)."""
        rtol = {"rtol": solver.rtol} if self.tightens else {}
        return objective(self.peer.ask("value", p=p, **rtol), f"{self.who}: value()")

    def gradient(self, p: Array, solver: Solver) -> Result:
        """J and dJ/dp, with what the adapter says of its solve."""
        tolerances = {"rtol": solver.rtol, "adjoint_rtol": solver.adjoint_rtol}
        return _result(self.peer.ask("gradient", p=p, **tolerances, options=self.options), self.peer, self.who)


def gradients(command: Command, who: str, model: Model) -> Gradient:
    """Starts the adapter and loads the case; every call asks it for the gradient at p."""
    foreign = Foreign(command, who, model.problem)
    return lambda p: foreign.gradient(p, model.solver)


def objective(answer: Mapping[str, Any], what: str) -> float:
    """The J of an answer. Raises AdapterError where it is no number; NaN is one."""
    J = answer.get("J")
    if isinstance(J, bool) or not isinstance(J, int | float) or (isinstance(J, int) and abs(J) > MOST):
        raise AdapterError(f"{what}: J = {shown(J)} - give a number")
    return float(J)


def _result(answer: Mapping[str, Any], peer: Peer, who: str) -> Result:
    what = f"{who}: gradient()"
    J, g = objective(answer, what), answer.get("gradient")
    if not isinstance(g, np.ndarray) or g.dtype != np.float64:
        raise AdapterError(f"{what}: the gradient is {shown(g)} - give an array of float64")
    numbers = {name: answer.get(name) for name in ("residual", "tape_bytes", "peak_bytes", *PHASES)}
    for name, number in numbers.items():
        real = isinstance(number, int | float) and not isinstance(number, bool)
        if number is not None and not (real and 0 <= number < MOST):
            raise AdapterError(f"{what}: {name} = {shown(number)} - give a number >= 0, or leave it out")
    told = {"name": peer.name or who, "versions": peer.versions}
    measured = {name: numbers[name] for name in (*PHASES, "peak_bytes") if numbers[name] is not None}
    tape = numbers["tape_bytes"]
    return Result(J, g, residual=numbers["residual"], tape=None if tape is None else int(tape), peer=told | measured)


def undescribed(problem: Problem, **options: Any) -> str | None:
    """What of a problem cannot be told to other codes, in a sentence; None where all can."""
    try:
        problem.case()
    except NotOffered as what:
        return str(what)
    return None


def of_manifest(each: Manifest) -> Route:
    """The route of an adapter that has a manifest; its options are those of the manifest."""

    def missing(problem: Problem, **options: Any) -> str | None:
        objection = undescribed(problem) or each.unknown(problem.case())
        if objection is None and not each.ready:
            return f"{each.name} has no environment here - make it: routes environments create {each.name}"
        return objection

    def function(model: Model, p: Array, **options: Any) -> Gradient:
        return gradients(Command(each.command(options), options), each.name, model)

    function.__doc__ = each.summary
    function.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            *(inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in ("model", "p")),
            *(
                inspect.Parameter(
                    name,
                    inspect.Parameter.KEYWORD_ONLY,
                    default=choices[0],
                    annotation=Annotated[Literal[tuple(choices)], f"of {each.name}"],
                )
                for name, choices in each.options.items()
            ),
        ]
    )
    needs = Offers.VALUE | Offers.CASE
    return Route(each.name, needs, function, cost, staged=True, missing=missing, sound=False)


def _check(*, command: str) -> None:
    words_of(command)


@route(
    "adapter",
    needs=Offers.VALUE | Offers.CASE,
    cost=cost,
    staged=True,
    check=_check,
    missing=undescribed,
    sound=False,
)
def adapter(
    model: Model, p: Array, *, command: Annotated[str, "that speaks the adapter protocol, or an adapter's FILE.py"] = ""
) -> Gradient:
    """Any program that speaks the adapter protocol over stdio."""
    return gradients(command_of(command), "adapter", model)
