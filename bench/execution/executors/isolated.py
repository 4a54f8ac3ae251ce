"""A case in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from typing import Any

from gradient_routes.bench.cases.environment import Environment
from gradient_routes.bench.cases.outcome import Outcome, Record
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.cluster.shipped_case import ShippedCase
from gradient_routes.bench.execution.executors.running import alone
from gradient_routes.bench.execution.isolation.channel import Call
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import (
    Begun,
    Done,
    Ended,
    Finish,
    Known,
    Message,
    Ready,
    Returned,
    Turn,
    Turned,
)
from gradient_routes.bench.execution.isolation.stack import where as located
from gradient_routes.bench.execution.isolation.worker_process import WorkerProcess
from gradient_routes.bench.execution.measurement import Measure
from gradient_routes.bench.execution.references import KnownJudges
from gradient_routes.problems.errors import InputError, RoutesError

CaseJob = Measure | ShippedCase


class Isolated:
    """A case under way in a process of its own; what it has said is known whatever becomes of it."""

    def __init__(self, job: CaseJob, limits: Limits, cwd: str | None = None) -> None:
        self.found: KnownJudges = job.found
        self.long = False
        self._record = Record(job.asked)
        self._phase = "its start"
        self._environment: Environment | None = None
        self._ended: Outcome | None = None
        self._line = WorkerProcess(replace(job, found=dict(job.found)), limits, cwd=cwd)

    def prepared(self) -> Outcome | None:
        return self._until(Ready)

    def turn(self) -> bool:
        if self._ended is None:
            self._line.say(Turn())
            self._until(Turned)
        return self._ended is None and self._more

    def outcome(self, interleaved: int) -> Outcome:
        if self._ended is None:
            self._line.say(Finish(interleaved))
            self._until(Done)
        assert self._ended is not None
        return self._ended

    def close(self) -> None:
        self._line.close()

    def kill(self) -> None:
        """From another thread than the one that listens, which will hear that it has ended."""
        self._line.process.kill()

    def _until(self, wanted: type[Ready | Turned | Done]) -> Outcome | None:
        """Listen until it says so, or until it has ended: then its outcome."""
        message: Message | None = None
        while not isinstance(message, wanted) and self._ended is None:
            message = self._line.hear()
            self._take(message)
        if self._ended is not None:
            self._line.close()  # now all of its stderr has come
            row = self._ended.row | {"stderr": self._line.process.stderr or None}
            self._ended = replace(self._ended, row=row)
        return self._ended

    def _take(self, message: Message) -> None:
        match message:
            case Begun(environment):
                self._environment = environment
            case Known(phase, news):
                self._phase = phase
                self._record.add(news)
            case Ready(long, found):
                self.long = long
                self.found.update(found)  # for cases that are prepared before this one is done
            case Turned(more):
                self._more = more
            case Done(outcome, found):
                self._ended = outcome
                self.found.update(found)
            case Ended(Status.REFUSED, reason):
                self._ended = self._record.refused(InputError(reason))
            case Ended():
                self._ended = self._died(message)

    def _died(self, end: Ended) -> Outcome:
        """What was known when it died is kept."""
        error, status = self._record.known.get("gradient_error"), end.status
        reason = end.reason
        if status is Status.OK:
            status, reason = Status.CRASHED, "its process ended before the case did"
        known = "" if error is None else f"; its gradient was known by then, its error {error:.2g}"
        where = f"{self._phase}{located(end.stderr)}"
        self._record.add({"traceback": end.traceback or None})
        reason = f"{self._record.asked['route']}: {status} in {where}: {reason}{known}"
        return self._record.ended(status, reason, environment=self._environment)


def called(function: Callable[..., Any], arguments: tuple[Any, ...], limits: Limits) -> Any:
    """What a function of a module returns in a process of its own. Raises RoutesError where that ends before."""
    job = Call(function, arguments)
    with closing(WorkerProcess(job, limits)) as line:
        message = line.hear()
    if isinstance(message, Returned):
        return message.value
    assert isinstance(message, Ended)
    said = [each.strip() for each in message.stderr.splitlines() if each.strip()] or ["nothing, it said nothing"]
    todo = f"see {said[-1]}" if message.status is Status.CRASHED else message.status.todo
    what = f"{message.status}: {message.reason} - {todo}" if todo else message.reason
    raise RoutesError(f"{job.name}: {what}")


def whole(job: CaseJob, limits: Limits, cwd: str | None = None) -> Outcome:
    """A case from its start to its end, timed beside no other."""
    return finished(Isolated(job, limits, cwd))


def finished(case: Isolated) -> Outcome:
    """The outcome of a case that nobody has listened to yet."""
    try:
        return case.prepared() or alone(case)
    finally:
        case.close()
