"""Runs cases one after the other and turns each into a row. A failure is a row, too."""

from __future__ import annotations

import datetime
import traceback
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bench.accuracy import error, reference_for
from bench.bill import Prices, prices, too_dear
from bench.case import ProblemSpec, RouteSpec, point
from bench.memory import peak_of
from bench.rows import Row, empty_row
from bench.timing import Samples, rounds, seconds_of
from problems.errors import RoutesError
from problems.problem import Array, Offers, ParameterView, Reference
from routes.model import Model
from routes.newton import State
from routes.route import Result, Route

KEEP_GRADIENT = 64  # parameters; longer gradients are kept on demand
NO_SILENT_NANS = {"over": "raise", "divide": "raise", "invalid": "raise"}


@dataclass(frozen=True)
class Settings:
    """How cases are run: at which p, up to which bill [s], timed for how long [s], with gradients kept or not."""

    at: str = "start"
    budget: float = 60.0
    min_time: float = 0.1
    gradient: bool = False


@dataclass(frozen=True)
class Outcome:
    """A row, its raw timings, what --gradient shows, and the traceback of an unexpected failure."""

    row: Row
    samples: Samples | None = None
    view: View | None = None
    traceback: str | None = None


@dataclass(frozen=True)
class View:
    """A gradient beside its reference and the problem's own columns."""

    labels: list[str]
    gradient: Array
    reference: Reference | None
    columns: ParameterView


class Failure(RoutesError):
    """A case that cannot give a number that deserves the name."""


def run(problems: list[ProblemSpec], routes: list[RouteSpec], settings: Settings) -> Iterator[Outcome]:
    """All pairs, problem by problem; each outcome as soon as it is known.

    Problems are built first: InputError and DomainError for what cannot be come before anything is measured.
    """
    benches = [Workbench(spec, settings) for spec in problems]
    return (bench.outcome(route) for bench in benches for route in routes)


class Workbench:
    """One problem at one p, with what all its routes share: prices, references."""

    def __init__(self, spec: ProblemSpec, settings: Settings) -> None:
        self.spec, self.settings = spec, settings
        self.build_s, self.problem = seconds_of(spec)
        self.p = point(self.problem, settings.at)
        self._prices: tuple[Prices, State | None] | None = None
        self._references: dict[str, Reference | None] = {}

    def outcome(self, spec: RouteSpec) -> Outcome:
        """Run one route on the problem. Never raises an Exception: what goes wrong becomes a failed row."""
        row = empty_row() | {
            "problem": self.spec.name,
            "problem_options": self.spec.options,
            "route": spec.route.name,
            "route_options": spec.options,
            "at": self.settings.at,
            "n_state": self.problem.n_state,
            "n_param": len(self.p),
            "note": "; ".join(self.problem.notes) or None,
            "started": datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds"),
        }
        try:
            with np.errstate(**NO_SILENT_NANS):  # type: ignore[arg-type]
                return self._run(spec, row)
        except RoutesError as failure:
            return Outcome(row | {"status": "failed", "reason": str(failure)}, traceback=traceback.format_exc())
        except Exception as failure:  # a plug-in may raise anything; the other cases still run
            said = " ".join(str(failure).split()) or "no message"
            reason = f"{spec.route.name}: {type(failure).__name__}: {said} - see --debug"
            return Outcome(row | {"status": "failed", "reason": reason}, traceback=traceback.format_exc())

    def _run(self, spec: RouteSpec, row: Row) -> Outcome:
        route, p = spec.route, self.p
        objection = route.objection(self.problem, **spec.options)
        if objection is not None:
            return Outcome(row | {"status": "skipped", "reason": objection})
        prices = self.prices
        expected = route.expect(Model(self.problem), p, **spec.options)
        work, tape = route.cost(len(p), prices.declared, **expected), route.tape(self.problem, **expected)
        row |= {"predicted_s": prices.seconds(work), "predicted_tape_bytes": tape, "predicted_work": asdict(work)}
        reason = too_dear(row["predicted_s"], tape, work, self.settings.budget)
        if reason is not None:
            return Outcome(row | {"status": "skipped", "reason": reason})
        return self._measure(spec, row)

    def _measure(self, spec: RouteSpec, row: Row) -> Outcome:
        route, p, model = spec.route, self.p, Model(self.problem)
        resolve_s, options = seconds_of(lambda: route.resolve(model, p, **spec.options))
        prepare_s, gradient = seconds_of(lambda: route.prepare(model, p, **options))
        before = model.tally.work
        first_s, result = seconds_of(lambda: gradient(p))
        row |= {
            "route_options": options,
            "prepare_s": self.build_s + resolve_s + prepare_s,
            "first_s": first_s,
            "work": asdict(model.tally.work - before),
            "predicted_work": asdict(route.cost(len(p), self.prices.declared, **options)),
        }
        self._judge(route, result, row)
        row["peak_bytes"], row["memory_method"] = peak_of(lambda: gradient(p))
        samples = rounds(lambda: gradient(p), self._forward(), self.settings.min_time)
        row |= {
            "seconds": float(np.median(samples.gradient)),
            "seconds_min": min(samples.gradient),
            "n_samples": len(samples.gradient),
            "forward_s": float(np.median(samples.forward)),
            "forward_ratio": samples.ratio,
            "status": "ok",
        }
        return Outcome(row, samples, self._view(route, result))

    def _judge(self, route: Route, result: Result, row: Row) -> None:
        """Fill in J, the gradient and its error; raise Failure for numbers that are none."""
        g = np.asarray(result.gradient)
        if g.shape != self.p.shape:
            raise Failure(f"{route.name}: gradient of shape {g.shape} for {len(self.p)} parameters - mend the route")
        bad = np.flatnonzero(~np.isfinite(g))
        if bad.size:
            first = self.problem.parameters.label(int(bad[0]))
            raise Failure(
                f"{route.name}: {bad.size} of {g.size} components are not finite, first {first} = {g[bad[0]]}"
                f" ({row['work']['matvecs']} products) - iterate less, or take implicit-ad or adjoint"
            )
        J = result.J
        if J is None:
            J = self.objective()
            row["note"] = "; ".join(filter(None, [row["note"], "objective from 1 forward solve apart"]))
        row |= {
            "objective": float(J),
            "gradient": g.tolist() if g.size <= KEEP_GRADIENT or self.settings.gradient else None,
            "gradient_norm": float(np.linalg.norm(g)),
            "residual": result.residual,
            "tape_bytes": result.tape,
        }
        reference = self.reference(route)
        if reference is not None:
            row["gradient_error"], row["reference"] = error(g, reference)

    @property
    def prices(self) -> Prices:
        return self._priced()[0]

    def objective(self) -> float:
        """J(p) of the forward solve that set the prices."""
        state = self._priced()[1]
        return Model(self.problem).value(self.p) if state is None else float(state.J)

    def _priced(self) -> tuple[Prices, State | None]:
        if self._prices is None:
            self._prices = prices(self.problem, self.p)
        return self._prices

    def reference(self, route: Route) -> Reference | None:
        if route.name not in self._references:
            self._references[route.name] = reference_for(self.problem, self.p, route)
        return self._references[route.name]

    def _forward(self) -> Any:
        model = Model(self.problem)
        solvable = Offers.SOLVE in self.problem.offers
        return (lambda: model.solve(self.p)) if solvable else (lambda: model.value(self.p))

    def _view(self, route: Route, result: Result) -> View | None:
        if not self.settings.gradient:
            return None
        state = self._priced()[1]
        columns = ParameterView() if state is None else self.problem.view(self.p, state.u, result.lam)
        labels = [self.problem.parameters.label(i) for i in range(len(self.p))]
        return View(labels, np.asarray(result.gradient), self.reference(route), columns)
