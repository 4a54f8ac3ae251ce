"""Predicted cost of a route: its declared work times the measured time of a forward solve, a solve and a product."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from gradient_routes.bench.cases.machine import available_bytes
from gradient_routes.bench.cases.samples import Elapsed
from gradient_routes.bench.execution.timing import elapsed
from gradient_routes.bench.units import duration, size
from gradient_routes.problems.problem import Array, Offers
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.tally import Work

TRIAL = 1.0  # [s] after the first call: as long as more calls are tried
CALLS = 3  # after the first, on a machine that is idle


@dataclass(frozen=True)
class Prices:
    """A forward solve, seconds of a substitution with its factors and of a product with R_u; its declared work."""

    forward: Elapsed
    solve: float
    matvec: float
    declared: ForwardWork

    def seconds(self, work: Work) -> float:
        """Predicted seconds: factorizations as cold forward solves, plus other substitutions, products and steps.

        A residual is taken to cost as much as a product. Chord steps reuse factors and count as substitutions.
        """
        cold = self.declared.cold
        if cold.steps and not self.declared.linear and work.factorizations >= work.newton_iterations:
            return self._marched(work)
        times = work.factorizations / cold.factorizations if cold.factorizations else work.forward_solves
        substitutions = work.solves + work.transposed_solves - times * cold.solves
        products = work.matvecs + work.residuals - times * (cold.matvecs + cold.residuals)
        again = work.steps / cold.steps - times if cold.steps else 0.0  # marches
        solves = times + max(0.0, again)
        return solves * self.forward.wall + max(0.0, substitutions) * self.solve + max(0.0, products) * self.matvec

    def _marched(self, work: Work) -> float:
        """By Newton's method in every step of time: a factorization beyond those of its steps is one in every step of
        time, for a sweep; without it a transposed solve is that of one Newton step.
        """
        cold, sweeps = self.declared.cold, work.factorizations - work.newton_iterations
        times = (work.newton_iterations + sweeps * cold.steps) / cold.newton_iterations
        back = work.transposed_solves / (1 if sweeps else cold.steps)
        return times * self.forward.wall + (work.solves - work.newton_iterations + back) * self.solve


def prices(model: Model, p: Array) -> tuple[Prices, State | None]:
    """Measure the prices at p; also return the state solved for them (None for a black box)."""
    problem = model.problem
    if Offers.SOLVE not in problem.offers:
        forward, _ = price_of(lambda: model.value(p))
        return Prices(forward, 0.0, 0.0, ForwardWork(Work(forward_solves=1))), None
    forward, state = price_of(lambda: model.solve(p))
    R_u = model.tangent_operator(state)
    declared = ForwardWork(
        state.work, problem.linear, model.solver.rtol, matrix_free=problem.matrix_free, newton=model.newton
    )
    solve, _ = price_of(lambda: state.factors.solve(state.u))
    matvec, _ = price_of(lambda: R_u @ state.u)
    return Prices(forward, solve.wall, matvec.wall, declared), state


def price_of(call: Callable[[], Any]) -> tuple[Elapsed, Any]:
    """The fastest of at least two calls, and the result. The first may include compilation; those after it go on for
    TRIAL s while the machine is busy.
    """
    first, result = elapsed(call)
    found = [elapsed(call)[0]]
    wall = attrgetter("wall")
    while math.fsum(map(wall, found)) < TRIAL and (len(found) < CALLS or min(found, key=wall).busy):
        found.append(elapsed(call)[0])
    return min(first, *found, key=wall), result


def unaffordable(own: Prices, tape: float | None, work: Work, budget: float, times: int = 1) -> str | None:
    """Why a route is skipped for the predicted cost of `times` gradients, in a sentence; None if it is not."""
    seconds = times * own.seconds(work)
    if seconds > budget:
        priced = ", priced on a busy machine" if own.forward.busy else ""
        bill = f"predicted bill {duration(seconds)} ({summary(work)}) > --budget {budget:g} s"
        return f"{bill}{priced}; --budget inf forces it"
    memory = available_bytes()
    if budget != float("inf") and memory is not None and (tape or 0) > memory:
        return f"predicted tape {size(tape or 0)} > {size(memory)} of memory at hand; --budget inf forces it"
    return None


def contained(work: Work, declared: ForwardWork) -> float:
    """How many cold forward solves are in counted work, operation by operation: a gradient cannot cost less."""
    cold = vars(declared.cold)
    return min((vars(work)[kind] / count for kind, count in cold.items() if count), default=0.0)


LEGEND = "fwd forward solves, lin linearized solves, adj transposed solves, mv products with R_u"


def summary(work: Work) -> str:
    """The work in the abbreviations of LEGEND."""
    substitutions = work.solves - work.newton_iterations
    parts = (
        (work.forward_solves, "fwd"),
        (substitutions, "lin"),
        (work.transposed_solves, "adj"),
        (work.matvecs, "mv"),
        (work.steps, "steps"),
    )
    return " + ".join(f"{count if count < 1e6 else f'{count:.2g}'} {name}" for count, name in parts if count > 0)
