"""Cases for a crew: sent, taken back, and sent again where the worker was lost."""

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

from gradient_routes.bench.cases.outcome import Outcome, failed, note
from gradient_routes.bench.execution.cluster.dask_workers import Crew, Member, Tell, sent
from gradient_routes.bench.execution.cluster.remote import packed
from gradient_routes.bench.execution.cluster.shipped_case import sealed
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.signals import Interrupt
from gradient_routes.bench.execution.measure_job import Measure
from gradient_routes.problems.errors import RoutesError

TICK = 0.5  # [s] between two looks at who is there
PATIENCE = 60.0  # [s] to wait for a worker
TRIES = 3  # of a case whose workers are lost
GATHERING = 10.0  # [s] after which a result that does not come makes one look whether its worker is there
Lost = tuple[Member, ...]


class Stranded(RoutesError):
    """There is nobody to run cases any more."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A case on a worker, after others were lost with it."""

    job: Measure
    lost: Lost
    member: Member
    future: Future[bytes | None]


class Dispatch:
    """Which worker has which case."""

    def __init__(self, client: Client, limits: Limits, timed: bool, tell: Tell, patience: float) -> None:
        self._client, self._limits, self._patience = client, limits, patience
        self._events: SimpleQueue[Attempt | None] = SimpleQueue()
        self._crew = Crew(client, timed, tell, lambda: self._events.put(None))
        self._attempts: list[Attempt] = []
        self._waiting: list[tuple[Measure, Lost]] = []
        self._seen = time.monotonic()  # when there was a worker last

    def outcomes(self, jobs: Iterator[Measure]) -> Iterator[Outcome]:
        """Until there are no more jobs. Raises Stranded."""
        with Interrupt(lambda: self._events.put(None)) as interrupt:
            while self._attempts or self._waiting or self._pull(jobs):
                self._look()
                for attempt in [attempt for attempt in self._attempts if attempt.member not in self._crew]:
                    yield from self._lose(attempt)
                self._send(jobs)
                yield from self._take(self._event())
                interrupt.heard()

    def cancel(self) -> None:
        """Nobody waits for anything any more."""
        with suppress(Exception):  # the scheduler may be gone, too
            self._client.cancel([attempt.future for attempt in self._attempts])

    def _pull(self, jobs: Iterator[Measure]) -> bool:
        job = next(jobs, None)
        if job is not None:
            self._waiting.append((job, ()))
        return job is not None

    def _look(self) -> None:
        try:
            self._crew.look()
        except (OSError, TimeoutError) as error:
            raise Stranded(
                f"Dask scheduler {self._crew.scheduler}: gone, with {self._left} - start another, go on with --resume"
            ) from error
        if len(self._crew):
            self._seen = time.monotonic()
        elif time.monotonic() > self._seen + self._patience:
            raise Stranded(
                f"Dask scheduler {self._crew.scheduler}: no worker for {self._patience:g} s, with {self._left}"
                f" - start some: dask worker {self._crew.scheduler} --nthreads 1"
            )

    @property
    def _left(self) -> str:
        count = len(self._attempts) + len(self._waiting)
        return f"{count} case{'s' * (count != 1)} under way and maybe more to come"

    def _send(self, jobs: Iterator[Measure]) -> None:
        """One case to everyone who may have one."""
        while (member := self._crew.free(attempt.member for attempt in self._attempts)) is not None:
            if not self._waiting and not self._pull(jobs):
                return
            job, lost = self._waiting.pop(0)
            parcel = packed(sealed(job), self._limits, os.getcwd())
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sending large graph")  # references found before go along
                future = sent(self._client, member.address, "carry", parcel, member.greeting.pid)
            attempt = Attempt(job, lost, member, future)
            self._attempts.append(attempt)
            future.add_done_callback(lambda _, attempt=attempt: self._events.put(attempt))

    def _event(self) -> Attempt | None:
        """A case that has come back, unless something else is to be looked at."""
        with suppress(Empty):
            return self._events.get(timeout=TICK)
        return None

    def _take(self, attempt: Attempt | None) -> Iterator[Outcome]:
        """What came of it; nothing where it is tried again."""
        if attempt not in self._attempts:
            return  # its worker was lost before
        try:
            reply = self._gathered(attempt)
            outcome, found = (None, {}) if reply is None else pickle.loads(reply)
        except (CancelledError, KilledWorker):
            outcome, found = None, {}
        except Exception as error:  # of Dask or of the worker: the case itself tells in its row
            row = failed(attempt.job.row, f"{attempt.job.row['route']} on worker {attempt.member.address}", error)
            outcome, found = Outcome(row | {"host": attempt.member.greeting.hostname}), {}
        if outcome is None:
            self._crew.forget(attempt.member.address)
            yield from self._lose(attempt)
            return
        self._attempts.remove(attempt)
        attempt.job.found.update(found)
        yield self._signed(outcome, attempt.member, attempt.lost)

    def _gathered(self, attempt: Attempt) -> bytes | None:
        """Raises what happened to it."""
        while True:
            try:
                reply: bytes | None = attempt.future.result(timeout=GATHERING)
            except TimeoutError:
                self._look()
                if attempt.future.status == "error":
                    raise
                if attempt.member not in self._crew:
                    return None
            else:
                return reply

    def _lose(self, attempt: Attempt) -> Iterator[Outcome]:
        """It is tried elsewhere, or so many times was enough."""
        self._attempts.remove(attempt)
        with suppress(Exception):
            attempt.future.cancel()
        lost = (*attempt.lost, attempt.member)
        if len(lost) < TRIES:
            self._waiting.insert(0, (attempt.job, lost))
            return
        where = ", ".join(member.address for member in lost)
        row = attempt.job.row | {
            "status": "crashed",
            "reason": f"{attempt.job.row['route']}: {len(lost)} workers were lost with it: {where} - see their logs",
            "host": attempt.member.greeting.hostname,
        }
        yield self._signed(Outcome(row), attempt.member, ())

    def _signed(self, outcome: Outcome, member: Member, lost: Lost) -> Outcome:
        """With the machine it comes from, if it does not tell itself, and what was lost on the way."""
        if lost:
            note(outcome.row, f"begun {len(lost) + 1} times, workers were lost: {', '.join(m.address for m in lost)}")
        if outcome.environment is None:
            return replace(outcome, environment=member.greeting.environment)
        return outcome
