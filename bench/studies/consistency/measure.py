"""What an inconsistent gradient costs: the same inversion with each, compared at its end with the true gradient.

A gradient whose adjoint equation has a discretization of its own is zero elsewhere than dJ/dp. On the way there a line
search meets points where J does not fall as promised, and stalls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.study import Found, Kept, Say
from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.optimizers import Limits, Name
from gradient_routes.bench.studies.consistency.columns import CONSISTENCY
from gradient_routes.bench.studies.judged import said
from gradient_routes.bench.studies.options import one_problem
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

TRUE = "adjoint"  # of the discretized equations: the gradient of J
INCONSISTENT = tuple(f"faulty-adjoint[fault={fault}]" for fault in ("otd", "quadrature", "stabilization", "mesh"))
MINIMUM = Limits(1000, 1e-12)  # of the run that J - J_min is measured from
EMPTY: Row = dict.fromkeys((column.name for column in CONSISTENCY), None)


@dataclass(frozen=True)
class Consistency:
    """Rows of the tables, in the order of the routes."""

    problem: str
    runs: list[Row]
    steps: list[Row]


def run(
    say: Say,
    *,
    selector: str,
    routes: Sequence[str],
    at: str,
    optimizer: Name,
    iterations: int,
    tolerance: float,
    solver: Solver,
    kept: Path | None = None,
) -> int:
    if iterations < 1 or not 0.0 <= tolerance < 1.0:
        raise InputError(
            f"--iterations {iterations} --tolerance {tolerance:g} - give at least one iteration, a tolerance below 1"
        )
    engine = Engine(optimizer, Limits(iterations, tolerance), solver)
    found = consistency(one_problem(selector), case.routes(routes or (TRUE, *INCONSISTENT)), engine, at)
    for row in found.runs:
        say(Kept("consistency", row))
    for row in found.steps:
        say(Kept("consistency_steps", row))
    say(Found(found))
    return 0 if any(row["status"] == "ok" for row in found.runs) else 1


def consistency(spec: ProblemSpec, routes: Sequence[RouteSpec], engine: Engine, at: str = "start") -> Consistency:
    """J minimized with the gradient of every route.

    Raises InputError where the problem has no adjoint to compare with, and what the first evaluation of J raises.
    """
    problem, (true,) = spec(), case.routes([TRUE])
    objection = true.route.objection(problem)
    if objection is not None:
        raise InputError(f"consistency: {objection} - choose another problem")
    best = invert(spec, true, Engine("lbfgs", MINIMUM, engine.solver), at, made=problem)
    runs = [(route, _inverted(spec, route, engine, at, problem)) for route in routes]
    ended = [best, *(run for _, run in runs if isinstance(run, Inversion))]
    J_min = min(step.objective for run in ended for step in run.iterates)
    compared = Compared(true, engine.solver, problem, J_min)
    shared = {"problem": spec.selector, "at": at, "optimizer": engine.optimizer}
    rows = [EMPTY | shared | {"route": route.selector} | compared.row(route, found) for route, found in runs]
    steps = [
        shared | {"route": route.selector} | step
        for route, found in runs
        if isinstance(found, Inversion)
        for step in compared.steps(found)
    ]
    return Consistency(spec.selector, rows, steps)


def _inverted(spec: ProblemSpec, route: RouteSpec, engine: Engine, at: str, made: Problem) -> Inversion | Row:
    """The inversion, or why there is none."""
    objection = route.route.objection(made, **route.options)
    if objection is not None:
        return {"status": "skipped", "reason": objection}
    try:
        return invert(spec, route, engine, at, made=made)
    except Exception as failure:  # the code of a plug-in may raise anything
        return {"status": "failed", "reason": said(failure)}


@dataclass(frozen=True)
class Compared:
    """Inversions against the true gradient and the least J."""

    true: RouteSpec
    solver: Solver
    problem: Problem
    J_min: float

    def row(self, route: RouteSpec, found: Inversion | Row) -> Row:
        if not isinstance(found, Inversion):
            return found
        first, last = found.iterates[0], found.iterates[-1]
        start, end = (self._gradient(self.true, p) for p in (found.start, found.p))
        return {
            "n_state": found.n_state,
            "n_param": found.n_param,
            "status": "ok",
            "error_start": _error(self._gradient(route, found.start), start),
            "error_end": _error(found.gradient, end),
            "iterations": last.iteration,
            "evaluations": found.stop.evaluations,
            "objective_start": first.objective,
            "objective": last.objective,
            "objective_minimum": self.J_min,
            "above_minimum": last.objective - self.J_min,
            "gradient_norm_start": norm2(start),
            "gradient_norm": norm2(end),
            "own_gradient_norm": last.gradient_norm,
            "step_length": last.step_length,
            "shortest_step": _shortest(found),
            "outcome": outcome(found),
            "ended": found.end,
        }

    def steps(self, found: Inversion) -> Iterator[dict[str, Any]]:
        for step in found.iterates:
            yield {
                "iteration": step.iteration,
                "forward_solves": step.forward_solves,
                "objective": step.objective,
                "above_minimum": step.objective - self.J_min,
                "own_gradient_norm": step.gradient_norm,
                "step_length": step.step_length,
            }

    def _gradient(self, by: RouteSpec, p: Array) -> Array:
        return by.route.prepare(Model(self.problem, self.solver), p, **by.options)(p).gradient


def _error(g: Array, true: Array) -> float | None:
    size = norm2(true)
    return norm2(g - true) / size if size else None


def outcome(found: Inversion) -> str:
    """What the optimizer believes; where rounding ends it at a minimum, it has converged."""
    says = found.stop.says
    if says.startswith("converged"):
        return "converged"
    return "not converged" if says.startswith("not converged") else "stalled"


def _shortest(found: Inversion) -> float | None:
    """The shortest step of a line search that has stalled, the last accepted one where it tried none in vain."""
    if outcome(found) != "stalled":
        return None
    tried = found.stop.shortest_step
    return found.iterates[-1].step_length if tried is None else tried
