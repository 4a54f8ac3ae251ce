"""Predicted cost of a route: its declared work times the measured time of a forward solve, a solve and a product."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any

from gradient_routes.bench.cases.machine import available_bytes
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.units import duration, size
from gradient_routes.problems.problem import Array, Offers
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.tally import Work

SHORT, LONG = 1.0, 10.0  # [s] a first call includes compilation: 3 more calls are timed, beyond SHORT 1, LONG none


@dataclass(frozen=True)
class Prices:
    """Seconds of a forward solve, of a substitution with its factors and of a product with R_u; its declared work."""

    forward: float
    solve: float
    matvec: float
    declared: ForwardWork

    def seconds(self, work: Work) -> float:
        """Predicted seconds: factorizations as cold forward solves, plus the remaining substitutions and products.

        A residual is taken to cost as much as a product. Chord steps reuse factors and count as substitutions.
        """
        cold = self.declared.cold
        times = work.factorizations / cold.factorizations if cold.factorizations else work.forward_solves
        substitutions = work.solves + work.transposed_solves - times * cold.solves
        products = work.matvecs + work.residuals - times * (cold.matvecs + cold.residuals)
        return times * self.forward + max(0.0, substitutions) * self.solve + max(0.0, products) * self.matvec


def prices(model: Model, p: Array) -> tuple[Prices, State | None]:
    """Measure the prices at p; also return the state solved for them (None for a black box)."""
    problem = model.problem
    if Offers.SOLVE not in problem.offers:
        seconds, _ = price_of(lambda: model.value(p))
        return Prices(seconds, 0.0, 0.0, ForwardWork(Work(forward_solves=1))), None
    forward, state = price_of(lambda: model.solve(p))
    R_u = model.tangent_operator(state)
    declared = ForwardWork(
        state.work, problem.linear, model.solver.rtol, matrix_free=problem.matrix_free, inexact=model.inexact
    )
    solve, _ = price_of(lambda: state.factors.solve(state.u))
    matvec, _ = price_of(lambda: R_u @ state.u)
    return Prices(forward, solve, matvec, declared), state


def price_of(call: Callable[[], Any]) -> tuple[float, Any]:
    """Median seconds of the calls after the first one, unless that is too long, and the result."""
    first, result = seconds_of(call)
    repeats = 3 if first < SHORT else 1 if first < LONG else 0
    return median([seconds_of(call)[0] for _ in range(repeats)] or [first]), result


def unaffordable(seconds: float, tape: float | None, work: Work, budget: float) -> str | None:
    """Why a route is skipped for its predicted cost, in a sentence; None if it is not."""
    if seconds > budget:
        return f"predicted bill {duration(seconds)} ({summary(work)}) > --budget {budget:g} s; --budget inf forces it"
    memory = available_bytes()
    if budget != float("inf") and memory is not None and (tape or 0) > memory:
        return f"predicted tape {size(tape or 0)} > {size(memory)} of memory at hand; --budget inf forces it"
    return None


LEGEND = "fwd forward solves, lin linearized solves, adj transposed solves, mv products with R_u"


def summary(work: Work) -> str:
    """The work in the abbreviations of LEGEND."""
    substitutions = work.solves - work.newton_iterations
    parts = (
        (work.forward_solves, "fwd"),
        (substitutions, "lin"),
        (work.transposed_solves, "adj"),
        (work.matvecs, "mv"),
    )
    return " + ".join(f"{count if count < 1e6 else f'{count:.2g}'} {name}" for count, name in parts if count > 0)
