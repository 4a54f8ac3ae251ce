"""Cases side by side in so many processes: for what is not timed, for they are in each other's way."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice

from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.execution.executors.isolated import Isolated, finished
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.signals import Interrupt
from gradient_routes.bench.execution.measurement import Measure

TICK = 0.1  # [s] between two looks whether it is interrupted


def outcomes(jobs: Iterator[Measure], slots: int, limits: Limits) -> Iterator[Outcome]:
    """As they come; a job is taken when a process is free for it. Closed early, it ends those that run."""
    running: dict[Future[Outcome], Isolated] = {}
    with ThreadPoolExecutor(slots) as threads:
        try:
            with Interrupt() as interrupt:  # raised at once it might lose outcomes that have come
                while True:
                    for job in islice(jobs, slots - len(running)):
                        case = Isolated(job, limits)
                        running[threads.submit(finished, case)] = case
                    if not running:
                        return
                    done, _ = wait(running, TICK, FIRST_COMPLETED)
                    for future in done:
                        del running[future]
                    yield from (future.result() for future in done)
                    interrupt.heard()
        finally:
            with Interrupt():  # impatience would leave processes that the threads wait for
                for case in running.values():
                    case.kill()  # the thread that listens to it closes it
