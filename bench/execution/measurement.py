"""A route on a workbench, measured phase by phase: prepared, called, judged, weighed, and timed in turns."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from statistics import median
from typing import Any

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import environment
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.outcome import Outcome, failed, note
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.status import FOREIGN, Failure, NonFinite
from gradient_routes.bench.execution.case_context import Workbench
from gradient_routes.bench.execution.cost_model import summary
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.execution.isolation.messages import Ready, Turn, Turned
from gradient_routes.bench.execution.memory import peak_of
from gradient_routes.bench.execution.references import Judge, norm2
from gradient_routes.bench.execution.timing import Rounds, seconds_of
from gradient_routes.bench.units import duration, now
from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Options, Result, Route

KEEP_GRADIENT = 64  # parameters; longer gradients are kept on demand
SMALL = 1e-6  # relative residual of a state that deserves to be called converged
WRONG = 1e-2  # relative error of a gradient at a converged state that deserves a warning

Report = Callable[[str, Row], None]  # the phase that begins, and what is known of the row


def quiet(phase: str, row: Row) -> None:
    """Nobody listens."""


def begun_row(spec: ProblemSpec, route: RouteSpec, settings: Settings) -> Row:
    """A row that says what is run, when and where."""
    return empty_row() | {
        "problem": spec.name,
        "problem_options": spec.options,
        "route": route.name,
        "route_options": route.options,
        "at": settings.at,
        "started": now(),
        "host": socket.gethostname(),
    }


def measure(bench: Workbench, spec: RouteSpec, row: Row, report: Report = quiet) -> Measurement | Outcome:
    """One route up to its timing, which comes in turns; an Outcome where there is nothing to time."""
    row |= {"n_param": bench.n_p, "partial": bench.partial}
    try:
        row |= {"n_state": bench.problem.n_state, "note": "; ".join(bench.problem.notes) or None}
        with undisturbed():
            return Measurement.begun(bench, spec, row, report)
    except FOREIGN as failure:
        return Outcome(failed(row, spec.route.name, failure), environment=environment())


class Measurement:
    """A route on a Workbench, prepared, called, judged and weighed; its timing comes in turns."""

    def __init__(self, bench: Workbench, row: Row, result: Result, rounds: Rounds | None, route: Route) -> None:
        self.bench, self.row, self.result, self.rounds, self.route = bench, row, result, rounds, route

    @classmethod
    def begun(cls, bench: Workbench, spec: RouteSpec, row: Row, report: Report) -> Measurement | Outcome:
        """All but the timing, or the outcome of what does not run or is not paid for."""
        route, p, model = spec.route, bench.p, bench.model()
        objection = route.objection(bench.problem, **spec.options)
        if objection is not None:
            return _skipped(row, objection)
        report("its first forward solve", row)
        options = route.expect(model, p, **spec.options)
        reason = bench.predict(len(p), route, options, row)
        if reason is None:
            report("the choice of its options", row)
            resolve_s, options = seconds_of(
                lambda: route.resolve(model, p, lambda o: bench.predict(len(p), route, o, {}) is None, **spec.options)
            )
            reason = bench.predict(len(p), route, options, row)
            row["route_options"] = options
        _note_whole(bench, route, options, row)
        if reason is not None:
            return _skipped(row, reason)
        report("preparation", row)
        prepare_s, gradient = seconds_of(lambda: route.prepare(model, p, **options))
        row["prepare_s"] = (row["prepare_s"] or 0.0) + bench.build_s + resolve_s + prepare_s
        report("its first call", row)
        row["first_s"], result = seconds_of(lambda: gradient(p))
        _check(bench, route, result, row)
        report("judgement", row)
        _judge(bench, route, row, np.asarray(result.gradient))
        report("the counting of its work", row)
        _weigh(bench, route, options, lambda: gradient(p), model, row)
        rounds = Rounds(lambda: gradient(p), bench.forward(), row["first_s"], bench.settings.min_time)
        report("timing", row)
        return cls(bench, row, result, rounds if bench.settings.timed else None, route)

    @property
    def long(self) -> bool:
        """Whether one call takes so long that nobody should wait for it."""
        return self.rounds is None or self.rounds.long

    def turn(self) -> bool:
        """Time it for a while; whether that is not enough yet."""
        with undisturbed():
            return self.rounds is not None and self.rounds.turn()

    def in_turns(self, channel: Channel) -> Outcome:
        """Timed when told to."""
        channel.say(Ready(self.long, self.bench.judges.found))
        order = channel.hear()
        while isinstance(order, Turn):
            channel.say(Turned(self.turn()))
            order = channel.hear()
        return self.outcome(order.interleaved)

    def outcome(self, interleaved: int) -> Outcome:
        """The row with its timings, taken beside those of so many cases."""
        samples = None
        if self.rounds is not None:
            samples = self.rounds.samples
            lower, upper = samples.quartiles
            self.row |= {
                "seconds": median(samples.gradient),
                "seconds_min": min(samples.gradient),
                "seconds_q1": lower,
                "seconds_q3": upper,
                "unstable": None if samples.unstable is None else int(samples.unstable),
                "n_samples": len(samples.gradient),
                "calls_per_sample": samples.calls,
                "interleaved": interleaved,
                "forward_s": median(samples.forward),
                "forward_ratio": samples.ratio,
            }
        with undisturbed():
            view, fields = self.bench.view(self.route, self.result), self.bench.fields(self.result)
            columns = self.bench.sensitivities()
        return Outcome(self.row | {"status": "ok"}, samples, view, fields, columns, environment())


@contextmanager
def undisturbed() -> Iterator[None]:
    """Every number that is kept is checked to be finite; stdout belongs to the results."""
    with np.errstate(all="ignore"), stdout_to_stderr():
        yield


def _skipped(row: Row, reason: str) -> Outcome:
    return Outcome(row | {"status": "skipped", "reason": reason}, environment=environment())


def _note_whole(bench: Workbench, route: Route, options: Options, row: Row) -> None:
    """What a partial run would have cost in full."""
    if bench.partial is not None:
        work = route.cost(bench.n_p, bench.prices.declared, **options)
        note(row, f"{route.name}: whole gradient: predicted {duration(bench.prices.seconds(work))} ({summary(work)})")


def _check(bench: Workbench, route: Route, result: Result, row: Row) -> None:
    """Fill in J and the gradient; raise Failure for numbers that are none."""
    if np.iscomplexobj(result.gradient):
        raise Failure(f"{route.name}: gradient of complex numbers - return the real dJ/dp")
    g = np.asarray(result.gradient, dtype=np.float64)
    if g.shape != bench.p.shape:
        raise Failure(f"{route.name}: gradient of shape {g.shape} for {len(bench.p)} parameters - mend the route")
    bad = np.flatnonzero(~np.isfinite(g))
    if bad.size:
        first = f"{bench.problem.parameters.label(int(bad[0]))} = {g[bad[0]]}"
        raise NonFinite(f"{route.name}: {bad.size} of {g.size} gradient components not finite, first {first} - check p")
    J = bench.objective() if result.J is None else result.J
    if not np.isfinite(J):
        raise NonFinite(f"{route.name}: J = {J} - check p and the data")
    row |= {
        "objective": float(J),
        "gradient": g.tolist() if g.size <= KEEP_GRADIENT or bench.settings.gradient else None,
        "gradient_norm": norm2(g),
        "residual": None if result.residual is None else float(result.residual),
        "tape_bytes": None if result.tape is None else int(result.tape),
    }


def _judge(bench: Workbench, route: Route, row: Row, g: Array) -> None:
    """Fill in the error of the gradient, and a warning where it is wrong at a converged state."""
    judge = bench.judges.judge(route)
    if not isinstance(judge, Judge):
        note(row, f"{route.name}: error unknown, nobody judges: {judge}")
        return
    row["gradient_error"], row["reference"] = judge.error(g)
    converged = row["residual"] is not None and row["residual"] <= min(10.0 * bench.settings.solver.rtol, SMALL)
    if converged and row["gradient_error"] > WRONG:
        note(row, f"{route.name}: the state has converged, yet the gradient is wrong: do not use it")


def _weigh(
    bench: Workbench, route: Route, options: Options, gradient: Callable[[], Any], model: Model, row: Row
) -> None:
    """Count the work of one call and read its memory, apart from timing."""
    before = model.tally.work
    row["peak_bytes"], row["memory_method"] = peak_of(gradient)
    work = model.tally.work - before
    declared = route.cost(len(bench.p), replace(bench.prices.declared, counted=work), **options)
    row |= {"work": asdict(work), "predicted_work": asdict(declared)}
    if work != declared:
        note(row, f"{route.name}: counted work differs from the declared")
    if row["tape_bytes"] is not None and options.get("iterations"):
        iterations = options["iterations"] * (options.get("newton") or 1)
        row["tape_bytes_per_iteration"] = None if options.get("checkpoint") else row["tape_bytes"] / iterations
    state = bench.price()[1]
    if state is not None:
        row |= {"linear_solver": state.factors.name, "factor_bytes": int(state.factors.nbytes)}
        if bench.problem.structure == "spd" and "L D L^T" in state.factors.name:
            note(row, "R_u is not positive definite at u: factorized as L D L^T (an unstable state, buckled say)")
