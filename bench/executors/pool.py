"""Cases side by side in so many processes: for what is not timed, for they are in each other's way."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice

from bench.executors.isolated import Isolated
from bench.executors.running import alone
from bench.isolation.limits import Limits
from bench.outcome import Outcome
from bench.worker import Measure


def outcomes(jobs: Iterator[Measure], slots: int, limits: Limits) -> Iterator[Outcome]:
    """As they come; a job is taken when a process is free for it."""
    running: dict[Future[Outcome], Isolated] = {}
    with ThreadPoolExecutor(slots) as threads:
        try:
            while True:
                for job in islice(jobs, slots - len(running)):
                    case = Isolated(job, limits)
                    running[threads.submit(_whole, case)] = case
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    running.pop(future)
                    yield future.result()
        finally:
            for case in running.values():  # an interrupt waits for nobody
                case.close()


def _whole(case: Isolated) -> Outcome:
    return case.prepared() or alone(case)
