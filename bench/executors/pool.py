"""Cases side by side in so many processes: for what is not timed, for they are in each other's way."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice

from bench.executors.isolated import whole
from bench.isolation.limits import Limits
from bench.outcome import Outcome
from bench.worker import Measure


def outcomes(jobs: Iterator[Measure], slots: int, limits: Limits) -> Iterator[Outcome]:
    """As they come; a job is taken when a process is free for it."""
    with ThreadPoolExecutor(slots) as threads:
        running: set[Future[Outcome]] = set()
        while True:
            running |= {threads.submit(whole, job, limits) for job in islice(jobs, slots - len(running))}
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)
