"""Confined processes that stay, each for one job at a time: what exceeds a limit, or crashes, ends its process only."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import AsyncGenerator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import psutil

from gradient_routes.bench.cases.status import Status, one_line
from gradient_routes.bench.execution.isolation.channel import Job
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Order
from gradient_routes.bench.execution.isolation.worker_process import WorkerProcess
from gradient_routes.bench.lab.shell import Command, Finished, Listening, Ready

BAR = Command(("run", "--problem", "bar", "--route", "adjoint", "--no-timing"), Path("/"))


@dataclass(frozen=True)
class Lane:
    """Processes for jobs of one kind, and the limits of each job.

    workers   so many
    timeout   [s] after which a job is killed
    memory    resident bytes at which it is killed; at half of them its process is replaced after a job
    patience  added to their niceness
    first     what a new process does before its first job, so that that is not slower
    """

    workers: int
    timeout: float
    memory: int = 2 * 2**30
    patience: int = 0
    first: Job = BAR


QUICK = Lane(workers=2, timeout=20.0)
LONG = Lane(workers=1, timeout=300.0, patience=10)


@dataclass(frozen=True)
class Begun:
    """A process works on the job now."""


class Over(Exception):
    """The time of a job is over, or nobody waits for it any more."""


class Worker:
    """One process; a new one after the old one had to be killed."""

    def __init__(self, lane: Lane) -> None:
        self._lane, self._unwanted, self._closed = lane, threading.Event(), False
        self._starting, self._owning = threading.Lock(), threading.Lock()
        self._line: WorkerProcess | None = None

    def wanted(self) -> None:
        """A job will come."""
        self._unwanted.clear()

    def do(self, job: Job) -> Iterator[Message]:
        """Yield the messages of a job, Ended last. Blocks; `leave` from another thread ends it."""
        line = self.started()
        if isinstance(line, Ended):
            yield line
            return
        deadline = time.monotonic() + self._lane.timeout

        def look() -> None:
            if self._unwanted.is_set() or time.monotonic() > deadline:
                raise Over

        message: Message = None
        if not self._unwanted.is_set():
            line.say(cast(Order, job))
        else:
            message = Finished(Ended(Status.INTERRUPTED))  # nobody waits for it any more
        while not isinstance(message, Finished | Ended):
            try:
                message = line.hear(look)
            except Over:
                message = Ended(Status.TIMEOUT, f"after {self._lane.timeout:g} s", killed=True)
            if not isinstance(message, Finished | Ended):
                yield message
        if isinstance(message, Ended) or self._grown(line):
            self._drop()
        yield message.end if isinstance(message, Finished) else message

    def started(self) -> WorkerProcess | Ended:
        """Its process, ready for a job; how it ended where it cannot start."""
        with self._starting:
            if self._line is not None:
                return self._line
            with self._owning:
                if self._closed:
                    return Ended(Status.INTERRUPTED, "closed", killed=True)
                listening = Listening(self._lane.first, self._lane.patience)
                line = self._line = WorkerProcess(listening, Limits(math.inf, self._lane.memory))
            while not isinstance(message := line.hear(), Ready):
                if isinstance(message, Ended):
                    self._drop()
                    return message
            return line

    def leave(self) -> None:
        """End the job that runs, or was to."""
        self._unwanted.set()

    def close(self) -> None:
        """Kill its process; there is no other one then."""
        self.leave()
        self._closed = True
        self._drop()

    def _drop(self) -> None:
        with self._owning:
            line, self._line = self._line, None
        if line is not None:
            line.close()

    def _grown(self, line: WorkerProcess) -> bool:
        with suppress(psutil.Error):
            return psutil.Process(line.process.process.pid).memory_info().rss > self._lane.memory / 2
        return True


class Pool:
    """The workers of a lane. Jobs wait for a free one in the order in which they came."""

    def __init__(self, lane: Lane) -> None:
        self.lane = lane
        self._queue: list[Callable[[int], None]] = []
        self._threads = ThreadPoolExecutor(lane.workers)
        self._all = [Worker(lane) for _ in range(lane.workers)]
        self._free = [*self._all]
        self._turns = asyncio.Semaphore(lane.workers)

    async def messages(self, job: Job, told: Callable[[int], None] = lambda before: None) -> AsyncGenerator[Message]:
        """Those of a job as they come, Begun first, Ended last. Closed early, it ends the job.

        told  is called with the number of jobs that wait or run before it, whenever that changes
        """
        self._queue.append(told)
        self._tell()
        try:
            await self._turns.acquire()
        finally:
            self._queue.remove(told)
            self._tell()
        worker = self._free.pop()  # the one that ended last: it may remember what it has read
        worker.wanted()
        loop, heard = asyncio.get_running_loop(), asyncio.Queue[Message]()

        def tell(message: Message) -> None:
            with suppress(RuntimeError):  # the loop is closed: nobody listens
                loop.call_soon_threadsafe(heard.put_nowait, message)

        def listen() -> None:
            try:
                for message in worker.do(job):
                    tell(message)
                worker.started()  # where it had to be killed, another one is there for the next job
            except Exception as failure:  # a job that cannot be sent, a process that cannot be made
                tell(Ended(Status.FAILED, one_line(failure)))

        def free(listening: asyncio.Future[None]) -> None:
            if listening.cancelled():  # the pool was closed before
                heard.put_nowait(Ended(Status.INTERRUPTED, "closed", killed=True))
            self._free.append(worker)
            self._turns.release()

        loop.run_in_executor(self._threads, listen).add_done_callback(free)
        message: Message = None
        try:
            yield Begun()
            while not isinstance(message, Ended):
                message = await heard.get()
                yield message
        finally:
            if not isinstance(message, Ended):  # else it may do the next job already
                worker.leave()

    def _tell(self) -> None:
        if self._turns.locked():
            for before, told in enumerate(self._queue, start=self.lane.workers):
                told(before)

    def warm(self) -> None:
        """Start the processes, without waiting for them."""
        for worker in self._all:
            self._threads.submit(worker.started)

    def close(self) -> None:
        """Kill all processes."""
        for worker in self._all:
            worker.close()
        self._threads.shutdown(cancel_futures=True)
