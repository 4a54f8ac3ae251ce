"""A route on a problem, measured phase by phase: prepared, called, judged, its work counted, and timed in turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from statistics import median

import numpy as np

from gradient_routes.bench.cases.case import Case
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import environment
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.outcome import Outcome, Record
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.cases.sources import Stamp, changed
from gradient_routes.bench.cases.status import FOREIGN, Failure, NonFinite, Status
from gradient_routes.bench.execution.case_context import CaseContext
from gradient_routes.bench.execution.cost_model import contained, summary
from gradient_routes.bench.execution.error_estimate import beyond_rounding, error_estimate
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.execution.isolation.messages import Begun, Done, Known, Ready, Turn, Turned
from gradient_routes.bench.execution.memory import peak_of
from gradient_routes.bench.execution.references import Judge, KnownJudges, norm2
from gradient_routes.bench.execution.shares import shares
from gradient_routes.bench.execution.solved import adjoint, other_functional, rounding, unsolved
from gradient_routes.bench.execution.timing import Rounds, seconds_of
from gradient_routes.bench.units import duration
from gradient_routes.problems.errors import DomainError, InputError, RoutesError, Unsupported
from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.precision import HOW
from gradient_routes.routes.route import Options, Result, Route
from gradient_routes.routes.tally import Work

KEEP_GRADIENT = 64  # parameters; longer gradients are kept on demand
SMALL = 1e-6  # relative residual of a state that counts as converged
WARM = ("forward_s", "backward_s", "peak_bytes")  # of another code, whose first call may compile
WRONG = 1e-2  # relative error of a gradient at a converged state that deserves a warning


@dataclass(frozen=True)
class Measure:
    """The job of a case. Says Begun; Known when a phase begins; Ready before it is timed, in turns as told; and Done.

    witnesses  files that the case rests on: where one has changed since, the row must not stand under its key
    checked_s  what the process has spent on other things than the case
    """

    case: Case
    found: KnownJudges
    witnesses: tuple[Stamp, ...] = ()
    checked_s: float = 0.0

    @property
    def name(self) -> str:
        return self.case.route.name

    @property
    def asked(self) -> Row:
        return self.case.asked

    def __call__(self, channel: Channel) -> None:
        """Raises InputError and DomainError for a problem that does not take what it was given."""
        record = Record(self.asked)

        def begin(phase: str) -> None:
            channel.say(Known(phase, record.news()))

        channel.say(Begun(environment()))
        record.add({"prepare_s": age() - self.checked_s})
        begin("the building of its problem")
        try:
            context = CaseContext(self.case.problem, self.case.settings, self.found)
        except (InputError, DomainError):
            raise
        except FOREIGN as failure:
            channel.say(Done(record.unbuilt(failure), {}))
            return
        measured = measure(context, self.case, record, begin)
        outcome = measured if isinstance(measured, Outcome) else in_turns(measured, channel)
        file = changed(self.witnesses)
        if file is None:
            channel.say(Done(outcome, context.judges.found))
        else:
            reason = f"{self.name}: {file} has changed since the run began - run it again"
            channel.say(Done(record.ended(Status.FAILED, reason), {}))


def age() -> float:
    """Seconds since this process was started."""
    import psutil

    return float(time.time() - psutil.Process().create_time())


def in_turns(measured: Measurement, channel: Channel) -> Outcome:
    """Timed when told to."""
    channel.say(Ready(measured.long, measured.context.judges.found))
    order = channel.hear()
    while isinstance(order, Turn):
        channel.say(Turned(measured.turn()))
        order = channel.hear()
    return measured.outcome(order.interleaved)


def measure(
    context: CaseContext, case: Case, record: Record, begin: Callable[[str], None] = lambda phase: None
) -> Measurement | Outcome:
    """A case up to its timing, which comes in turns; an Outcome where there is nothing to time.

    `begin` is told of every phase that begins. Raises InputError for options that the route has, not on this problem.
    """
    record.add({"n_param": context.n_p, "partial": context.partial})
    try:
        record.add({"n_state": context.problem.n_state, "note": "; ".join(context.problem.notes) or None})
        with undisturbed():
            return _measured(context, case, record, begin)
    except Unsupported as unknown:
        return record.ended(Status.SKIPPED, str(unknown), environment=environment())
    except FOREIGN as failure:
        if isinstance(failure, InputError) and "n_state" in record.known and not _takes(context, case):
            raise
        return record.failed(failure, case.route.name, environment=environment())


def _takes(context: CaseContext, case: Case) -> bool:
    """Whether the route's options are right for the problem."""
    try:
        case.route.route.objection(context.problem, **case.route.options)
    except InputError:
        return False
    return True


def _measured(context: CaseContext, case: Case, record: Record, begin: Callable[[str], None]) -> Measurement | Outcome:
    route, p, model = case.route.route, context.p, context.model()

    def skipped(reason: str) -> Outcome:
        return record.ended(Status.SKIPPED, reason, environment=environment())

    def affordable(options: Options) -> bool:
        return context.predict(len(p), route, options).objection is None

    objection = route.objection(context.problem, **case.route.options)
    if objection is not None:
        return skipped(objection)
    begin("its first forward solve")
    options = route.expect(model, p, **case.route.options)
    predicted = context.predict(len(p), route, options)
    record.add(predicted.columns)
    if predicted.objection is None:
        begin("the choice of its options")
        resolve_s, options = seconds_of(lambda: route.resolve(model, p, affordable, **case.route.options))
        predicted = context.predict(len(p), route, options)
        record.add({"route_options": options, **predicted.columns})
    _note_whole(context, route, options, record)
    if predicted.objection is not None:
        return skipped(predicted.objection)
    begin("preparation")
    prepare_s, gradient = seconds_of(lambda: route.prepare(model, p, **options))
    record.add({"prepare_s": (record.known.get("prepare_s") or 0.0) + context.build_s + resolve_s + prepare_s})
    begin("its first call")
    first_s, result = seconds_of(lambda: gradient(p))
    record.add({"first_s": first_s})
    record.add(_checked(context, route, result, record))
    begin("judgement")
    reason = other_functional(context, route, result)
    status = Status.NOT_CONVERGED if reason is None else Status.OTHER_FUNCTIONAL
    reason = reason or unsolved(context, route, result)
    if reason is None and (why := rounding(context, result)) is not None:
        record.note(f"{route.name}: {why}")
    adjoint_residual, why = adjoint(context, result)
    record.add({"adjoint_residual": adjoint_residual})
    if why is not None:
        record.note(f"{route.name}: {why}")
    if status is not Status.OTHER_FUNCTIONAL:
        _judge(context, route, record, np.asarray(result.gradient))
        _estimate(context, route, record, result)
    begin("the counting of its work")
    again_s = _count(context, route, options, lambda: gradient(p), model, record)
    rounds = Rounds(lambda: gradient(p), context.forward(), min(first_s, again_s), context.settings.min_time)
    begin("timing")
    return Measurement(context, route, record, result, rounds if context.settings.timed else None, status, reason)


@dataclass(frozen=True)
class Measurement:
    """A case that has been prepared, called and judged; its timing comes in turns, where it is timed.

    status, reason  how it ends where there is a reason for that; it is ok where there is none
    """

    context: CaseContext
    route: Route
    record: Record
    result: Result
    rounds: Rounds | None
    status: Status
    reason: str | None

    @property
    def long(self) -> bool:
        """Whether one call takes so long that nobody should wait for it."""
        return self.rounds is None or self.rounds.long

    def turn(self) -> bool:
        """Time it for a while; whether that is not enough yet."""
        with undisturbed():
            return self.rounds is not None and self.rounds.turn()

    def outcome(self, interleaved: int) -> Outcome:
        """The outcome with its timings, taken beside those of so many cases."""
        samples = None if self.rounds is None else self.rounds.samples
        if samples is not None:
            self.record.add(timings(samples) | {"interleaved": interleaved})
            self._resolve(samples)
        context = self.context
        with undisturbed():
            return self.record.ended(
                Status.OK if self.reason is None else self.status,
                self.reason,
                samples=samples,
                view=context.view(self.route, self.result),
                fields=context.fields(self.result),
                sensitivities=context.sensitivities(),
                environment=environment(),
            )

    def _resolve(self, samples: Samples) -> None:
        """The cost in forward solves, unless the rounds scatter so that it is less than the work contains."""
        floor = contained(Work(**self.record.known["work"]), self.context.prices.declared)
        resolved = samples.resolved(floor)
        self.record.add({"forward_ratio": resolved, "ratio_floor": floor})
        if resolved is None:
            found = f"{samples.ratio:.3g} in the median of {len(samples.gradient)} rounds, {floor:.3g} by counted work"
            self.record.note(f"{self.route.name}: cost / forward solve unresolved, {found}: raise --min-time")


def timings(samples: Samples) -> Row:
    """The columns of samples."""
    lower, upper = samples.quartiles
    return {
        "seconds": median(samples.gradient),
        "seconds_min": min(samples.gradient),
        "seconds_q1": lower,
        "seconds_q3": upper,
        "unstable": None if samples.unstable is None else int(samples.unstable),
        "n_samples": len(samples.gradient),
        "calls_per_sample": samples.calls,
        "forward_s": median(samples.forward),
    }


@contextmanager
def undisturbed() -> Iterator[None]:
    """Every number that is kept is checked to be finite; stdout belongs to the results."""
    with np.errstate(all="ignore"), stdout_to_stderr():
        yield


def _note_whole(context: CaseContext, route: Route, options: Options, record: Record) -> None:
    """What a partial run would have cost in full."""
    if context.partial is not None:
        work = route.cost(context.n_p, context.prices.declared, **options)
        seconds = context.prices.seconds(work)
        record.note(f"{route.name}: whole gradient: predicted {duration(seconds)} ({summary(work)})")


def _checked(context: CaseContext, route: Route, result: Result, record: Record) -> Row:
    """The columns of J and the gradient. Raises Failure for what is no finite real gradient."""
    if np.iscomplexobj(result.gradient):
        raise Failure(f"{route.name}: gradient of complex numbers - return the real dJ/dp")
    given = np.asarray(result.gradient).dtype
    if given.kind == "f" and given.itemsize < 8:
        record.note(f"{route.name}: gradient in {given}: {HOW}")
    g = np.asarray(result.gradient, dtype=np.float64)
    if g.shape != context.p.shape:
        raise Failure(f"{route.name}: gradient of shape {g.shape} for {len(context.p)} parameters - mend the route")
    bad = np.flatnonzero(~np.isfinite(g))
    if bad.size:
        first = f"{context.problem.parameters.label(int(bad[0]))} = {g[bad[0]]}"
        raise NonFinite(f"{route.name}: {bad.size} of {g.size} gradient components not finite, first {first} - check p")
    J = context.objective() if result.J is None else result.J
    if not np.isfinite(J):
        raise NonFinite(f"{route.name}: J = {J} - check p and the data")
    kept = g.size <= KEEP_GRADIENT or context.settings.gradient
    return (shares(context.problem, context.p, result) if kept else {}) | {
        "objective": float(J),
        "gradient": g.tolist() if kept else None,
        "gradient_norm": norm2(g),
        "residual": None if result.residual is None else float(result.residual),
        "tape_bytes": None if result.tape is None else int(result.tape),
        "peer": None if result.peer is None else dict(result.peer),
    }


def _judge(context: CaseContext, route: Route, record: Record, g: Array) -> None:
    """The error of the gradient, and a warning where it is wrong at a converged state."""
    judge = context.judges.judge(route)
    if not isinstance(judge, Judge):
        record.note(f"{route.name}: error unknown, no reference: {judge}")
        return
    if judge.instead is not None:
        record.note(f"{route.name}: {judge.instead}")
    error, reference = judge.error(g)
    record.add({"gradient_error": error, "reference": reference})
    if _converged(context, record) and error > WRONG:
        solved = "the state has converged" if record.known["peer"] is None else "its J is ours"
        record.note(f"{route.name}: {solved}, yet the gradient is wrong: do not use it")


def _estimate(context: CaseContext, route: Route, record: Record, result: Result) -> None:
    """The estimated error, and a warning where it is large though the error, relative to the terms of J, is not."""
    solved = context.model(), context.price()[1]
    estimate = error_estimate(*solved, route, result)
    record.add({"gradient_error_estimate": estimate})
    unseen = estimate is not None and estimate > WRONG >= (record.known.get("gradient_error") or 0.0)
    if unseen and _converged(context, record) and beyond_rounding(*solved, route, result):
        record.note(f"{route.name}: the estimated error is {estimate:.2g} of the gradient: do not use it")


def _converged(context: CaseContext, record: Record) -> bool:
    """Whether the gradient belongs to a solved state: of another code that tells no residual, its J is ours."""
    residual = record.known["residual"]
    if residual is None:
        return record.known["peer"] is not None
    return bool(residual <= min(10.0 * context.settings.solver.rtol, SMALL))


def _count(
    context: CaseContext, route: Route, options: Options, gradient: Callable[[], Result], model: Model, record: Record
) -> float:
    """Count the work of one call and read its memory, apart from timing. Returns the seconds that it took."""
    before = model.tally.work
    results: list[Result] = []
    again_s, (peak, method) = seconds_of(lambda: peak_of(lambda: results.append(gradient())))
    told = results[0].peer
    if told is not None:
        peak, method = told.get("peak_bytes"), f"by {told['name']} itself"
        record.add({"peer": record.known["peer"] | {name: told[name] for name in WARM if name in told}})
    work = model.tally.work - before
    declared = route.cost(len(context.p), replace(context.prices.declared, counted=work), **options)
    record.add({"peak_bytes": peak, "memory_method": method})
    record.add({"work": asdict(work), "predicted_work": asdict(declared)})
    if work != declared:
        record.note(f"{route.name}: counted work differs from the declared")
    tape = record.known["tape_bytes"]
    if tape is not None and options.get("iterations") and not options.get("checkpoint"):
        record.add({"tape_bytes_per_iteration": tape / (options["iterations"] * (options.get("newton") or 1))})
    state = context.price()[1]
    if state is not None:
        record.add({"linear_solver": state.factors.name, "factor_bytes": context.factor_bytes})
        with suppress(RoutesError):  # a state at which R_u is singular has no such numbers
            _note_state(context, route, options, model, state, record)
    return again_s


def _note_state(
    context: CaseContext, route: Route, options: Options, model: Model, state: State, record: Record
) -> None:
    """Notes on an unstable state, and on differences of J where the solver leaves noise in it."""
    unstable = model.negative_eigenvalues(state) if context.problem.structure == "spd" else None
    if unstable:
        some = f"{unstable} negative eigenvalue{'s' if unstable > 1 else ''}"
        record.note(f"R_u has {some} at u: the state is unstable")
    if model.solver.newton == "inexact" and state.rate is not None and route.step is not None:
        step = options.get("step") or route.step
        # a solve nearby may end anywhere below the tolerance
        looser = max(1.0, model.solver.rtol / state.residual) if state.residual else 1.0
        noise = f"noise of J up to about {looser * model.noise(state):.1g} over steps of {step:.1g}"
        noise = f"rtol {model.solver.rtol:g}, {noise}"
        record.note(f"{route.name}: differences J of an inexact Newton solve ({noise}): use --newton full")
