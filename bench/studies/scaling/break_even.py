"""The number of parameters from which one route is cheaper than another: fitted, and as the cost model predicts it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec, point
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.cost_model import Prices, prices
from gradient_routes.bench.studies.judged import said
from gradient_routes.bench.studies.scaling.climbing import Series
from gradient_routes.bench.studies.scaling.crossing import FEWEST, CostLine, Crossing, cheaper, crossing, exact, line
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


@dataclass(frozen=True)
class BreakEven:
    """Two routes, seconds = fixed + each m of both, and where they cross. Fields are columns of its table."""

    problem: str
    problem_options: dict[str, object]
    at: str
    n_state: int
    n_param: int
    route: str
    route_options: dict[str, object]
    other: str
    other_options: dict[str, object]
    fixed_s: float
    each_s: float
    other_fixed_s: float
    other_each_s: float
    points: int
    m_largest: int
    rounds: int
    break_even: float | None
    break_even_low: float | None
    break_even_high: float | None
    says: str
    predicted: float | None
    predicted_says: str

    @property
    def row(self) -> Row:
        return dict(vars(self))


BreakEvens = tuple[list[BreakEven], str | None]  # and why there are none
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
) -> list[BreakEven]:
    problem = spec()
    p = point(problem, settings.at)
    runners = {name: _resolved(problem, p, route, settings) for name, route in runners.items()}
    done = race(problem, p, runners, settings.solver, settings.budget, LONGER * settings.min_time)
    if len(done.m) < FEWEST:
        return []
    own, _ = prices(Model(problem, settings.solver), p)
    where = (spec.name, spec.options, settings.at, problem.n_state, len(p))
    return [compared(where, (runners[a], runners[b]), done, own) for a, b in pairs]


def _resolved(problem: Problem, p: Array, spec: RouteSpec, settings: Settings) -> RouteSpec:
    return replace(spec, options=spec.route.resolve(Model(problem, settings.solver), p, **spec.options))


def compared(
    where: tuple[str, dict[str, object], str, int, int], two: tuple[RouteSpec, RouteSpec], done: Race, own: Prices
) -> BreakEven:
    """Lines through what was measured beside those of the cost model."""
    first, second = two
    names = (first.route.name, second.route.name)
    fitted = (line(done.m, done.seconds[names[0]]), line(done.m, done.seconds[names[1]]))
    declared = (predicted(first, own), predicted(second, own))
    met: Crossing = crossing(*fitted)
    return BreakEven(
        *where,
        names[0],
        first.options,
        names[1],
        second.options,
        fitted[0].fixed,
        fitted[0].each,
        fitted[1].fixed,
        fitted[1].each,
        len(done.m),
        max(done.m),
        done.rounds,
        met.at,
        met.low,
        met.high,
        cheaper(names, fitted, max(done.m)),
        crossing(*declared).at,
        cheaper(names, declared, MOST_PARAMETERS),
    )


def predicted(spec: RouteSpec, own: Prices) -> CostLine:
    """The declared bill over the number of parameters, which is a line."""
    one, many = (own.seconds(spec.route.cost(m, own.declared, **spec.options)) for m in (1, MOST_PARAMETERS))
    each = (many - one) / (MOST_PARAMETERS - 1)
    return exact(one - each, each)
