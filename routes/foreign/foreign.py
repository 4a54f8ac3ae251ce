"""A code of somebody else as a route: an adapter is told the case, and asked for J and dJ/dp."""

from __future__ import annotations

import inspect
import shlex
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError, NotOffered
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.foreign.manifest import Manifest
from gradient_routes.routes.foreign.peer import AdapterError, Peer
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Gradient, Result, Route, Work, route

PHASES = ("forward_s", "backward_s", "compile_s")  # wall time [s] that an adapter measures itself


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    """None of ours."""
    return Work()


def gradients(command: Sequence[str], who: str, model: Model, options: Mapping[str, Any]) -> Gradient:
    """Starts the adapter and loads the case; every call asks it for the gradient at p."""
    peer = Peer(command, who)
    peer.ask("load", case=model.problem.case())
    solver = model.solver

    def gradient(p: Array) -> Result:
        answer = peer.ask("gradient", p=p, rtol=solver.rtol, adjoint_rtol=solver.adjoint_rtol, options=dict(options))
        return _result(answer, peer, who)

    return gradient


def _result(answer: Mapping[str, Any], peer: Peer, who: str) -> Result:
    J, g = answer.get("J"), answer.get("gradient")
    if not isinstance(J, int | float) or not isinstance(g, np.ndarray) or g.dtype != np.float64:
        raise AdapterError(f"{who}: gradient(): J = {J}, gradient {type(g).__name__} - give a number and float64s")
    numbers = {name: answer.get(name) for name in ("residual", "tape_bytes", "peak_bytes", *PHASES)}
    for name, number in numbers.items():
        if number is not None and (isinstance(number, bool) or not isinstance(number, int | float)):
            raise AdapterError(f"{who}: gradient(): {name} = {number!r} - give a number, or leave it out")
    told = {"name": peer.about.get("name", who), "versions": peer.about.get("versions", {})}
    measured = {name: numbers[name] for name in (*PHASES, "peak_bytes") if numbers[name] is not None}
    tape = numbers["tape_bytes"]
    return Result(
        float(J), g, residual=numbers["residual"], tape=None if tape is None else int(tape), peer=told | measured
    )


def of_manifest(each: Manifest) -> Route:
    """The route of an adapter that has a manifest; its options are those of the manifest."""

    def missing(problem: Problem, **options: Any) -> str | None:
        try:
            objection = each.unknown(problem.case())
        except NotOffered as undescribed:
            return str(undescribed)
        if objection is None and not each.ready:
            return f"{each.name} has no environment here - make it: routes environments create {each.name}"
        return objection

    def function(model: Model, p: Array, **options: Any) -> Gradient:
        return gradients(each.command, each.name, model, options)

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
    return Route(each.name, needs, function, cost, staged=True, missing=missing)


def _needs_command(*, command: str) -> None:
    if not command:
        raise InputError("adapter: no command - give one: --route 'adapter[command=./mine]'")


@route("adapter", needs=Offers.VALUE | Offers.CASE, cost=cost, staged=True, check=_needs_command)
def adapter(
    model: Model, p: Array, *, command: Annotated[str, "that speaks the adapter protocol, in any language"] = ""
) -> Gradient:
    """Any program that speaks the adapter protocol over stdio."""
    return gradients(shlex.split(command), "adapter", model, {})
