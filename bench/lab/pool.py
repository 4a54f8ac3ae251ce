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

from gradient_routes.bench.cases.status import Status
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
        self._lane, self._unwanted, self._busy = lane, threading.Event(), threading.Lock()
        self._line: WorkerProcess | None = None

    def do(self, job: Job) -> Iterator[Message]:
        """Yield the messages of a job, Ended last. Blocks; `leave` from another thread ends it."""
        self._unwanted.clear()
        line = self.started()
        if isinstance(line, Ended):
            yield line
            return
        deadline = time.monotonic() + self._lane.timeout

        def look() -> None:
            if self._unwanted.is_set() or time.monotonic() > deadline:
                raise Over

        line.say(cast(Order, job))
        message: Message = None
        while not isinstance(message, Finished | Ended):
            try:
                message = line.hear(look)
            except Over:
                message = Ended(Status.TIMEOUT, f"after {self._lane.timeout:g} s", killed=True)
            if not isinstance(message, Finished | Ended):
                yield message
        if isinstance(message, Ended) or self._grown(line):
            self.close()
        yield message.end if isinstance(message, Finished) else message

    def started(self) -> WorkerProcess | Ended:
        """Its process, ready for a job; how it ended where it cannot start."""
        with self._busy:
            if self._line is None:
                self._line = WorkerProcess(
                    Listening(self._lane.first, self._lane.patience), Limits(math.inf, self._lane.memory)
                )
                while not isinstance(message := self._line.hear(), Ready):
                    if isinstance(message, Ended):
                        self.close()
                        return message
            return self._line

    def leave(self) -> None:
        """End the job that runs."""
        self._unwanted.set()

    def close(self) -> None:
        """Kill its process."""
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
        self._idle: asyncio.Queue[Worker] = asyncio.Queue()
        for worker in self._all:
            self._idle.put_nowait(worker)

    async def messages(self, job: Job, told: Callable[[int], None] = lambda before: None) -> AsyncGenerator[Message]:
        """Those of a job as they come, Begun first, Ended last. Closed early, it ends the job.

        told  is called with the number of jobs that wait or run before it, whenever that changes
        """
        self._queue.append(told)
        self._tell()
        try:
            worker = await self._idle.get()
        finally:
            self._queue.remove(told)
            self._tell()
        yield Begun()
        loop, heard = asyncio.get_running_loop(), asyncio.Queue[Message]()

        def listen() -> None:
            for message in worker.do(job):
                loop.call_soon_threadsafe(heard.put_nowait, message)

        listening = loop.run_in_executor(self._threads, listen)
        try:
            message: Message = None
            while not isinstance(message, Ended):
                message = await heard.get()
                yield message
        finally:
            worker.leave()
            await listening
            self._idle.put_nowait(worker)

    def _tell(self) -> None:
        if self._idle.empty():
            for before, told in enumerate(self._queue, start=self.lane.workers):
                told(before)

    def warm(self) -> None:
        """Start the processes, without waiting for them."""
        for worker in self._all:
            self._threads.submit(worker.started)

    def close(self) -> None:
        """Kill all processes."""
        for worker in self._all:
            worker.leave()
            worker.close()
        self._threads.shutdown(cancel_futures=True)
