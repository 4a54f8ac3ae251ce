"""Send cases to Dask workers, collect the outcomes, and send again those of lost workers."""

from __future__ import annotations

import os
import pickle
import time
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from queue import Empty, SimpleQueue

from distributed import CancelledError, Client, Future, KilledWorker

from gradient_routes.bench.cases.outcome import Outcome, Record, noted
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.cluster.dask_workers import DaskWorkers, Member, Tell, sent
from gradient_routes.bench.execution.cluster.remote import packed
from gradient_routes.bench.execution.cluster.shipped_case import shipped
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.signals import Interrupt
from gradient_routes.bench.execution.measurement import Measure
from gradient_routes.problems.errors import RoutesError

TICK = 0.5  # [s] between two updates of the list of workers
PATIENCE = 60.0  # [s] to wait for a worker
TRIES = 3  # workers that may be lost with one case
GATHERING = 10.0  # [s] to wait for a result before its worker is looked for
Lost = tuple[Member, ...]


class Stranded(RoutesError):
    """There is no worker left."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A case on a worker, and the workers that were lost with it before."""

    job: Measure
    lost: Lost
    member: Member
    future: Future[bytes | None]

    @property
    def record(self) -> Record:
        """A record with what is known here: its host."""
        record = Record(self.job.asked)
        record.add({"host": self.member.greeting.hostname})
        return record


class Dispatch:
    """Assigns cases to workers."""

    def __init__(self, client: Client, limits: Limits, timed: bool, tell: Tell, patience: float) -> None:
        self._client, self._limits, self._patience = client, limits, patience
        self._events: SimpleQueue[Attempt | None] = SimpleQueue()
        self._workers = DaskWorkers(client, timed, tell, lambda: self._events.put(None))
        self._attempts: list[Attempt] = []
        self._waiting: list[tuple[Measure, Lost]] = []
        self._seen = time.monotonic()  # the last time there was a worker

    def outcomes(self, jobs: Iterator[Measure]) -> Iterator[Outcome]:
        """Outcomes until there are no more jobs. Raises Stranded."""
        with Interrupt(lambda: self._events.put(None)) as interrupt:
            while self._attempts or self._waiting or self._pull(jobs):
                self._look()
                for attempt in [attempt for attempt in self._attempts if attempt.member not in self._workers]:
                    yield from self._lose(attempt)
                self._send(jobs)
                yield from self._take(self._event())
                interrupt.heard()

    def cancel(self) -> None:
        """Cancel all cases that are running."""
        with suppress(Exception):  # the scheduler may have ended, too
            self._client.cancel([attempt.future for attempt in self._attempts])

    def _pull(self, jobs: Iterator[Measure]) -> bool:
        job = next(jobs, None)
        if job is not None:
            self._waiting.append((job, ()))
        return job is not None

    def _look(self) -> None:
        try:
            self._workers.look()
        except (OSError, TimeoutError) as error:
            scheduler = f"Dask scheduler {self._workers.scheduler}"
            raise Stranded(
                f"{scheduler}: does not answer, with {self._left} - start another, continue with --resume"
            ) from error
        if len(self._workers):
            self._seen = time.monotonic()
        elif time.monotonic() > self._seen + self._patience:
            raise Stranded(
                f"Dask scheduler {self._workers.scheduler}: no worker for {self._patience:g} s, with {self._left}"
                f" - start some: dask worker {self._workers.scheduler} --nthreads 1"
            )

    @property
    def _left(self) -> str:
        count = len(self._attempts) + len(self._waiting)
        return f"{count} case{'s' * (count != 1)} under way and maybe more to come"

    def _send(self, jobs: Iterator[Measure]) -> None:
        """Send a case to every free worker."""
        while (member := self._workers.free(attempt.member for attempt in self._attempts)) is not None:
            if not self._waiting and not self._pull(jobs):
                return
            job, lost = self._waiting.pop(0)
            parcel = packed(shipped(job), self._limits, os.getcwd())
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sending large graph")  # the references found before are sent along
                future = sent(self._client, member.address, "carry", parcel, member.greeting.pid)
            attempt = Attempt(job, lost, member, future)
            self._attempts.append(attempt)
            future.add_done_callback(lambda _, attempt=attempt: self._events.put(attempt))

    def _event(self) -> Attempt | None:
        """An attempt that has ended, or None after a tick or a wake-up."""
        with suppress(Empty):
            return self._events.get(timeout=TICK)
        return None

    def _take(self, attempt: Attempt | None) -> Iterator[Outcome]:
        """The outcome of an attempt; none if the case is tried again."""
        if attempt not in self._attempts:
            return  # it was given up when its worker was lost
        try:
            reply = self._gathered(attempt)
            outcome, found = (None, {}) if reply is None else pickle.loads(reply)
        except (CancelledError, KilledWorker):
            outcome, found = None, {}
        except Exception as error:  # of Dask or of the worker: errors of the case itself are in its row
            who = f"{attempt.job.name} on worker {attempt.member.address}"
            outcome, found = attempt.record.failed(error, who), {}
        if outcome is None:
            self._workers.forget(attempt.member.address)
            yield from self._lose(attempt)
            return
        self._attempts.remove(attempt)
        attempt.job.found.update(found)
        yield self._signed(outcome, attempt.member, attempt.lost)

    def _gathered(self, attempt: Attempt) -> bytes | None:
        """The result, None if its worker was lost. Raises the error of the attempt."""
        while True:
            try:
                reply: bytes | None = attempt.future.result(timeout=GATHERING)
            except TimeoutError:
                self._look()
                if attempt.future.status == "error":
                    raise
                if attempt.member not in self._workers:
                    return None
            else:
                return reply

    def _lose(self, attempt: Attempt) -> Iterator[Outcome]:
        """Try the case on another worker, up to TRIES times; then it has crashed."""
        self._attempts.remove(attempt)
        with suppress(Exception):
            attempt.future.cancel()
        lost = (*attempt.lost, attempt.member)
        if len(lost) < TRIES:
            self._waiting.insert(0, (attempt.job, lost))
            return
        where = ", ".join(member.address for member in lost)
        reason = f"{attempt.job.name}: {len(lost)} workers were lost with it: {where} - see their logs"
        yield self._signed(attempt.record.ended(Status.CRASHED, reason), attempt.member, ())

    def _signed(self, outcome: Outcome, member: Member, lost: Lost) -> Outcome:
        """The outcome with the environment of its worker, if it has none, and the lost workers in its note."""
        if lost:
            said = f"begun {len(lost) + 1} times, workers were lost: {', '.join(m.address for m in lost)}"
            outcome = replace(outcome, row=outcome.row | {"note": noted(outcome.row["note"], said)})
        if outcome.environment is None:
            return replace(outcome, environment=member.greeting.environment)
        return outcome
