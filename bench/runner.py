"""Runs cases one after the other and turns each into a row. A failure is a row, too."""

from __future__ import annotations

import datetime
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from bench.accuracy import Judge, Judges, norm2
from bench.bill import Prices, duration, prices, summary, unaffordable
from bench.case import ProblemSpec, RouteSpec, point
from bench.measure import steady
from bench.partial import Partial
from bench.rows import Row, empty_row
from bench.timing import Samples, seconds_of
from problems.errors import InputError, RoutesError
from problems.problem import Array, Fields, Offers, ParameterView, Problem, Reference
from routes.model import Model
from routes.newton import Solver, State
from routes.route import Options, Result, Route

KEEP_GRADIENT = 64  # parameters; longer gradients are kept on demand
SMALL = 1e-6  # relative residual of a state that deserves to be called converged
WRONG = 1e-2  # relative error of a gradient at a converged state that deserves a warning
FOREIGN = (Exception, SystemExit, GeneratorExit)  # what the code of a plug-in may raise


@dataclass(frozen=True)
class Settings:
    """How cases are run: at which p, up to which bill [s], timed for how long [s], with gradients kept or not, on
    the whole of p or on a part, with fields on the mesh or without.
    """

    at: str = "start"
    budget: float = 60.0
    min_time: float = 0.1
    gradient: bool = False
    solver: Solver = field(default_factory=Solver)
    partial: Partial | None = None
    fields: bool = False


@dataclass(frozen=True)
class Outcome:
    """A row, its raw timings, what --gradient and --vtu show, and the traceback of a failure."""

    row: Row
    samples: Samples | None = None
    view: View | None = None
    fields: Fields | None = None
    traceback: str | None = None


@dataclass(frozen=True)
class View:
    """A gradient at p beside its reference and the problem's own columns; position as in Parameters."""

    labels: list[str]
    units: list[str]
    position: Array | None
    p: Array
    gradient: Array
    reference: Reference | None
    columns: ParameterView


class Failure(RoutesError):
    """A case that cannot give a number that deserves the name."""


def run(problems: list[ProblemSpec], routes: list[RouteSpec], settings: Settings) -> Iterator[Outcome]:
    """All pairs, problem by problem; each outcome as soon as it is known.

    Every problem is built once before: InputError and DomainError for what cannot be come before anything is
    measured. Then one at a time is held.
    """
    for spec in problems:
        workbench(spec, settings)
    return (outcome for spec in problems for outcome in outcomes(spec, routes, settings))


def outcomes(spec: ProblemSpec, routes: list[RouteSpec], settings: Settings) -> Iterator[Outcome]:
    """All routes on one problem; a problem that cannot be built fails on every route."""
    bench = workbench(spec, settings)
    for route in routes:
        yield bench.outcome(route) if isinstance(bench, Workbench) else replace(bench, row=bench.row | _names(route))


def workbench(spec: ProblemSpec, settings: Settings) -> Workbench | Outcome:
    """The problem set up, or the failed outcome of a factory that raised what it should not."""
    try:
        return Workbench(spec, settings)
    except RoutesError:
        raise
    except FOREIGN as failure:
        row = empty_row() | {
            "problem": spec.name,
            "problem_options": spec.options,
            "at": settings.at,
            "status": "failed",
            "reason": f"problem '{spec.name}' cannot be built: {_one_line(failure)} - see --debug",
        }
        return Outcome(row, traceback=traceback.format_exc())


def _names(spec: RouteSpec) -> Row:
    return {"route": spec.route.name, "route_options": spec.options}


class Workbench:
    """One problem at one p, with what all its routes share: prices and references."""

    def __init__(self, spec: ProblemSpec, settings: Settings) -> None:
        self.spec, self.settings = spec, settings
        self.problem: Problem
        self.build_s, self.problem = seconds_of(spec)
        self.p = point(self.problem, settings.at)
        self.n_p = len(self.p)
        if settings.fields and type(self.problem).fields is Problem.fields:
            raise InputError(f"{self.problem.name}: has no mesh to write fields on - drop --vtu")
        self.partial = self._restrict(settings.partial)
        self.p.flags.writeable = False  # shared by all routes
        direct = replace(settings.solver, linear_solver="auto", newton="full")  # a judge is no fellow of the judged
        self.judges = Judges(Model(self.problem, direct), self.p, self._unaffordable_judge)
        self._forward_model = self.model()
        self._priced: tuple[Prices, State | None] | Exception | None = None

    def _restrict(self, partial: Partial | None) -> str | None:
        """From here on the problem is the one in the few parameters asked for; what they are, None for all."""
        few = None if partial is None else partial.restrict(self.problem, self.p)
        if partial is None or few is None:
            return None
        self.problem, self.p = few, few.parameters.start.copy()
        return partial.of(self.n_p)

    def model(self) -> Model:
        return Model(self.problem, self.settings.solver)

    def outcome(self, spec: RouteSpec) -> Outcome:
        """Run one route on the problem. What goes wrong becomes a failed row, and the next case runs."""
        row = empty_row() | {
            "problem": self.spec.name,
            "problem_options": self.spec.options,
            **_names(spec),
            "at": self.settings.at,
            "n_param": self.n_p,
            "partial": self.partial,
            "started": datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds"),
        }
        try:
            row |= {"n_state": self.problem.n_state, "note": "; ".join(self.problem.notes) or None}
            # every number that is kept is checked to be finite; stdout belongs to the results
            with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
                return self._run(spec, row)
        except RoutesError as failure:
            return Outcome(row | {"status": "failed", "reason": str(failure)}, traceback=traceback.format_exc())
        except FOREIGN as failure:
            reason = f"{spec.route.name}: {_one_line(failure)} - see --debug"
            return Outcome(row | {"status": "failed", "reason": reason}, traceback=traceback.format_exc())

    def _run(self, spec: RouteSpec, row: Row) -> Outcome:
        route, p, model = spec.route, self.p, self.model()
        objection = route.objection(self.problem, **spec.options)
        if objection is not None:
            return Outcome(row | {"status": "skipped", "reason": objection})
        expected = route.expect(model, p, **spec.options)
        reason = self._predict(route, expected, row)
        if reason is not None:
            self._note_whole(route, expected, row)
            return Outcome(row | {"status": "skipped", "reason": reason})
        resolve_s, options = seconds_of(lambda: route.resolve(model, p, self._affordable(route), **spec.options))
        reason = self._predict(route, options, row)
        row["route_options"] = options
        self._note_whole(route, options, row)
        if reason is not None:
            return Outcome(row | {"status": "skipped", "reason": reason})
        prepare_s, gradient = seconds_of(lambda: route.prepare(model, p, **options))
        row["prepare_s"] = self.build_s + resolve_s + prepare_s
        return self._measure(route, options, gradient, model, row)

    def _predict(self, route: Route, options: Options, row: Row) -> str | None:
        """Fill in the predicted bill; why it is not paid, or None."""
        return self._predict_for(len(self.p), route, options, row)

    def _predict_for(self, n_p: int, route: Route, options: Options, row: Row) -> str | None:
        work = route.cost(n_p, self.prices.declared, **options)
        tape = None if route.tape is None else route.tape(self.problem, **options)
        row |= {
            "predicted_s": self.prices.seconds(work),
            "predicted_tape_bytes": tape,
            "predicted_work": asdict(work),
        }
        return unaffordable(row["predicted_s"], tape, work, self.settings.budget)

    def _affordable(self, route: Route) -> Callable[[Options], bool]:
        return lambda options: self._predict(route, options, {}) is None

    def _unaffordable_judge(self, route: Route, n_p: int) -> str | None:
        return self._predict_for(n_p, route, route.defaults, {})

    def _note_whole(self, route: Route, options: Options, row: Row) -> None:
        """What a partial run would have cost in full."""
        if self.partial is not None:
            work = route.cost(self.n_p, self.prices.declared, **options)
            bill = f"{duration(self.prices.seconds(work))} ({summary(work)})"
            _note(row, f"{route.name}: whole gradient: predicted {bill}")

    def _measure(self, route: Route, options: Options, gradient: Any, model: Model, row: Row) -> Outcome:
        before = model.tally.work
        row["first_s"], result = seconds_of(lambda: gradient(self.p))
        work = model.tally.work - before
        declared = route.cost(len(self.p), replace(self.prices.declared, counted=work), **options)
        row |= {"work": asdict(work), "predicted_work": asdict(declared)}
        if work != declared:
            _note(row, f"{route.name}: counted work differs from the declared")
        self._judge(route, result, row)
        if row["tape_bytes"] is not None and options.get("iterations"):
            iterations = options["iterations"] * (options.get("newton") or 1)
            row["tape_bytes_per_iteration"] = None if options.get("checkpoint") else row["tape_bytes"] / iterations
        self._note_factors(row)
        samples, peak = steady(lambda: gradient(self.p), self._forward(), row["first_s"], self.settings.min_time)
        row["peak_bytes"], row["memory_method"] = peak
        row |= {
            "seconds": float(np.median(samples.gradient)),
            "seconds_min": min(samples.gradient),
            "n_samples": len(samples.gradient),
            "forward_s": float(np.median(samples.forward)),
            "forward_ratio": samples.ratio,
            "status": "ok",
        }
        return Outcome(row, samples, self._view(route, result), self._fields(result))

    def _note_factors(self, row: Row) -> None:
        state = self._price()[1]
        if state is not None:
            row["linear_solver"] = state.factors.name
            if self.problem.structure == "spd" and "L D L^T" in state.factors.name:
                _note(row, "R_u is not positive definite at u: factorized as L D L^T (an unstable state, buckled say)")

    def _judge(self, route: Route, result: Result, row: Row) -> None:
        """Fill in J, the gradient and its error; raise Failure for numbers that are none."""
        if np.iscomplexobj(result.gradient):
            raise Failure(f"{route.name}: gradient of complex numbers - return the real dJ/dp")
        g = np.asarray(result.gradient, dtype=np.float64)
        if g.shape != self.p.shape:
            raise Failure(f"{route.name}: gradient of shape {g.shape} for {len(self.p)} parameters - mend the route")
        bad = np.flatnonzero(~np.isfinite(g))
        if bad.size:
            first = f"{self.problem.parameters.label(int(bad[0]))} = {g[bad[0]]}"
            raise Failure(
                f"{route.name}: {bad.size} of {g.size} gradient components not finite, first {first} - check p"
            )
        J = result.J
        if J is None:
            J = self.objective()
            _note(row, f"{route.name}: objective from 1 forward solve apart")
        if not np.isfinite(J):
            raise Failure(f"{route.name}: J = {J} - check p and the data")
        row |= {
            "objective": float(J),
            "gradient": g.tolist() if g.size <= KEEP_GRADIENT or self.settings.gradient else None,
            "gradient_norm": norm2(g),
            "residual": None if result.residual is None else float(result.residual),
            "tape_bytes": None if result.tape is None else int(result.tape),
        }
        judge = self.judges.judge(route)
        if not isinstance(judge, Judge):
            _note(row, f"{route.name}: error unknown, nobody judges: {judge}")
            return
        row["gradient_error"], row["reference"] = judge.error(g)
        converged = row["residual"] is not None and row["residual"] <= min(10.0 * self.settings.solver.rtol, SMALL)
        if converged and row["gradient_error"] > WRONG:
            _note(row, f"{route.name}: the state has converged, yet the gradient is wrong: do not use it")

    def _price(self) -> tuple[Prices, State | None]:
        """Prices and the state they were measured on; a forward solve that fails is not tried again."""
        if self._priced is None:
            try:
                self._priced = prices(self._forward_model, self.p)
            except Exception as failure:  # raised again, for every route
                self._priced = failure
        if isinstance(self._priced, Exception):
            raise self._priced
        return self._priced

    @property
    def prices(self) -> Prices:
        return self._price()[0]

    def objective(self) -> float:
        """J(p) of the forward solve that set the prices."""
        state = self._price()[1]
        return self.model().value(self.p) if state is None else float(state.J)

    def _forward(self) -> Callable[[], Any]:
        model = self._forward_model  # has analyzed its matrices, as the route's own has by now
        solvable = Offers.SOLVE in self.problem.offers
        return (lambda: model.solve(self.p)) if solvable else (lambda: model.value(self.p))

    def _view(self, route: Route, result: Result) -> View | None:
        if not self.settings.gradient:
            return None
        u = self._state_of(result)
        columns = ParameterView() if u is None else self.problem.view(self.p, u, result.lam)
        judge = self.judges.judge(route)
        reference = judge.whole if isinstance(judge, Judge) else None
        q = self.problem.parameters
        labels, units = zip(*((q.label(i), q.unit_of(i)) for i in range(len(q))), strict=True)
        return View([*labels], [*units], q.position, self.p, np.asarray(result.gradient), reference, columns)

    def _fields(self, result: Result) -> Fields | None:
        u = self._state_of(result)
        if u is None or not self.settings.fields:
            return None
        return self.problem.fields(self.p, u, result.lam, np.asarray(result.gradient))

    def _state_of(self, result: Result) -> Array | None:
        """u of the route, or of the forward solve that set the prices; None for a black box."""
        state = self._price()[1]
        return result.u if result.u is not None or state is None else state.u


def _note(row: Row, note: str) -> None:
    row["note"] = f"{row['note']}; {note}" if row["note"] else note


def _one_line(error: BaseException) -> str:
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__
