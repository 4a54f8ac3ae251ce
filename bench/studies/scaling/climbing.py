"""Routes on larger and larger problems, each until it reaches a cap."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.row import LIMITED, measured
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.studies.scaling.sizes import Sizes
from gradient_routes.bench.units import duration
from gradient_routes.problems.errors import RoutesError

Measure = Callable[[list[ProblemSpec], list[RouteSpec], Settings], Iterator[Outcome]]  # as bench.execution.sweep.run
CAPS = ("skipped", "pruned", *LIMITED)  # statuses that no larger problem will better
NOT_STOPPED = "no larger size asked for"


class Series:
    """One route with its options as asked for, from small to large."""

    def __init__(self, route: RouteSpec) -> None:
        self.route = route
        self.cases: list[tuple[ProblemSpec, Row]] = []
        self.stopped: str | None = None
        self.reason: str | None = None

    @property
    def rows(self) -> list[Row]:
        """What was measured."""
        return [row for _, row in self.cases if measured(row)]

    @property
    def stopped_by(self) -> str:
        """Why there is nothing larger, in words."""
        if self.stopped is None:
            last = self.cases[-1][1] if self.cases else None
            return NOT_STOPPED if last is None or last["status"] == "ok" else f"{last['status']}: {last['reason']}"
        return f"{self.stopped}: {self.reason}"

    def stop(self, how: str, why: str | None) -> None:
        self.stopped, self.reason = how, why

    def take(self, spec: ProblemSpec, row: Row) -> None:
        self.cases.append((spec, row))
        if row["status"] in CAPS:
            self.stop(row["status"], row["reason"])


class Climb:
    """All routes over all sizes. `run` may be cut short by Ctrl-C; what was measured until then is in `series`."""

    def __init__(self, sizes: Sizes, routes: Sequence[RouteSpec], settings: Settings, measure: Measure) -> None:
        self.sizes, self.settings, self.measure = sizes, settings, measure
        self.series = [Series(route) for route in routes]
        self.at: ProblemSpec | None = None  # while it climbs

    @property
    def live(self) -> list[Series]:
        return [series for series in self.series if series.stopped is None]

    def run(self) -> Iterator[Outcome]:
        """Size by size, the routes that are left. Raises InputError, DomainError for the first size."""
        for spec in self.sizes.specs:
            self.at = spec
            self._prune(spec)
            waiting = self.live
            if not waiting:
                return
            try:
                for outcome in self.measure([spec], [series.route for series in waiting], self.settings):
                    series = _asked(waiting, outcome.row)
                    waiting.remove(series)
                    series.take(spec, outcome.row)
                    yield outcome
            except RoutesError as failure:  # a problem that cannot be had so large
                if not any(series.cases for series in self.series):
                    raise
                for series in self.live:
                    series.stop("not built", str(failure))
        self.at = None

    def interrupt(self) -> None:
        """It has been cut short, if it was not through."""
        if self.at is not None:
            for series in self.live:
                series.stop("interrupted", f"at {self.sizes.label(self.at)}")

    def _prune(self, spec: ProblemSpec) -> None:
        """Not tried: what grows as it did between the last two sizes is over the budget here."""
        for series in self.live:
            known = [(self.sizes.magnitude(of), row["seconds_min"]) for of, row in series.cases if measured(row)]
            if len(known) < 2:
                continue
            predicted = extrapolated(known[-2], known[-1], self.sizes.magnitude(spec))
            if predicted > self.settings.budget:
                bill = f"{duration(predicted)} > --budget {self.settings.budget:g} s"
                series.stop("pruned", f"{self.sizes.label(spec)} extrapolates to {bill}")


def extrapolated(before: tuple[float, float], last: tuple[float, float], x: float) -> float:
    """y at x of the power law through two points (x, y)."""
    (x_1, y_1), (x_2, y_2) = before, last
    if x_1 == x_2 or min(y_1, y_2) <= 0.0:
        return y_2
    exponent = math.log(y_2 / y_1) / math.log(x_2 / x_1)
    return float(y_2 * (x / x_2) ** exponent)


def _asked(series: Sequence[Series], row: Row) -> Series:
    """Whose row this is: of its route, with the options given; of several, that with the most of them."""

    def agreeing(options: dict[str, Any]) -> int:
        given = {name: value for name, value in options.items() if value is not None}
        found = row["route_options"]
        return len(given) if all(found.get(name) == value for name, value in given.items()) else -1

    fitting = [one for one in series if one.route.name == row["route"]]
    return max(fitting, key=lambda one: agreeing(one.route.options))
