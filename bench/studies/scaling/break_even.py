"""The number of parameters from which one route is cheaper than another: fitted, and as the cost model predicts it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import replace

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec, point
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.cost_model import Prices, prices
from gradient_routes.bench.studies.judged import said
from gradient_routes.bench.studies.scaling.climbing import Series
from gradient_routes.bench.studies.scaling.crossing import FEWEST, CostLine, cheaper, crossing, exact, line
from gradient_routes.bench.studies.scaling.race import MOST_PARAMETERS, NUMBERS, ROUNDS, Race, doublings, race
from gradient_routes.bench.studies.scaling.sizes import Sizes
from gradient_routes.bench.units import duration
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model

PAIRS = (
    ("tangent", "adjoint"),
    ("fd-one-sided", "adjoint"),
    ("fd-central", "adjoint"),
    ("fd-one-sided", "tangent"),
    ("fd-central", "tangent"),
)
RUNNERS = tuple(dict.fromkeys(name for pair in PAIRS for name in pair))
# forward solves of a round on the fewest parameters, finite differences among the runners
LEAST = sum(2 * m + 1 for m in doublings(2 ** (NUMBERS - 1))) + sum(doublings(2 ** (NUMBERS - 1))) + 2 * NUMBERS
LONGER = 20.0  # rounds of a race last so many times --min-time


BreakEvens = tuple[list[Row], str | None]  # rows of the table break_even, and why there are none
Racing = Callable[[Sizes, Sequence[Series], Settings], BreakEvens]


def break_even(sizes: Sizes, every: Sequence[Series], settings: Settings) -> BreakEvens:
    """Let the routes of PAIRS among `every` race on the largest problem that is affordable."""
    runners: dict[str, RouteSpec] = {}
    for series in every:
        priced = any(row["predicted_s"] is not None for _, row in series.cases)  # too dear as a whole is no obstacle
        if series.route.name in RUNNERS and priced:
            runners.setdefault(series.route.name, series.route)
    pairs = [pair for pair in PAIRS if runners.keys() >= {*pair}]
    if not pairs:
        return [], f"takes two of {', '.join(RUNNERS)}"
    spec, least = affordable(sizes, every, settings.budget)
    if spec is None:
        return [], f"{ROUNDS} rounds take {duration(least)} at the smallest size > --budget {settings.budget:g} s"
    try:
        with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
            found = _raced(spec, runners, pairs, settings)
    except Exception as failure:  # of a route on fewer parameters; the rest of the study stands
        return [], said(failure)
    return found, None if found else f"{spec.name}: fewer than {FEWEST} numbers of parameters"


def affordable(sizes: Sizes, every: Sequence[Series], budget: float) -> tuple[ProblemSpec | None, float]:
    """The largest problem that is known to be solved and on which a race is predicted to be paid, and its seconds."""
    forward: dict[int, list[float]] = {}
    for series in every:
        for spec, row in series.cases:
            if row["status"] == "ok":
                forward.setdefault(sizes.specs.index(spec), []).append(row["forward_s"])
    bills = {size: ROUNDS * LEAST * min(seconds) for size, seconds in forward.items()}
    paid = [size for size, seconds in bills.items() if seconds <= budget]
    if not paid:
        return None, min(bills.values(), default=np.inf)
    return sizes.specs[max(paid)], bills[max(paid)]


def _raced(
    spec: ProblemSpec, runners: Mapping[str, RouteSpec], pairs: Sequence[tuple[str, str]], settings: Settings
) -> list[Row]:
    problem = spec()
    p = point(problem, settings.at)
    runners = {name: _resolved(problem, p, route, settings) for name, route in runners.items()}
    done = race(problem, p, runners, settings.solver, settings.budget, LONGER * settings.min_time)
    if len(done.m) < FEWEST:
        return []
    own, _ = prices(Model(problem, settings.solver), p)
    where = {"problem": spec.name, "problem_options": spec.options, "at": settings.at}
    sizes = {"n_state": problem.n_state, "n_param": len(p)}
    return [where | sizes | compared((runners[a], runners[b]), done, own) for a, b in pairs]


def _resolved(problem: Problem, p: Array, spec: RouteSpec, settings: Settings) -> RouteSpec:
    return replace(spec, options=spec.route.resolve(Model(problem, settings.solver), p, **spec.options))


def compared(two: tuple[RouteSpec, RouteSpec], done: Race, own: Prices) -> Row:
    """Lines through what was measured beside those of the cost model."""
    first, second = two
    names = (first.route.name, second.route.name)
    fitted = (line(done.m, done.seconds[names[0]]), line(done.m, done.seconds[names[1]]))
    declared = (predicted(first, own), predicted(second, own))
    met = crossing(*fitted)
    return {
        "route": names[0],
        "route_options": first.options,
        "other": names[1],
        "other_options": second.options,
        "fixed_s": fitted[0].fixed,
        "each_s": fitted[0].each,
        "other_fixed_s": fitted[1].fixed,
        "other_each_s": fitted[1].each,
        "points": len(done.m),
        "m_largest": max(done.m),
        "rounds": done.rounds,
        "break_even": met.at,
        "break_even_low": met.low,
        "break_even_high": met.high,
        "says": cheaper(names, fitted, max(done.m)),
        "predicted": crossing(*declared).at,
        "predicted_says": cheaper(names, declared, MOST_PARAMETERS),
    }


def predicted(spec: RouteSpec, own: Prices) -> CostLine:
    """The declared bill over the number of parameters, which is a line."""
    one, many = (own.seconds(spec.route.cost(m, own.declared, **spec.options)) for m in (1, MOST_PARAMETERS))
    each = (many - one) / (MOST_PARAMETERS - 1)
    return exact(one - each, each)
