"""Cases in this process, on one workbench a problem: nothing guards it, nothing is started."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import cache

from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.outcome import Outcome, refused, unbuilt
from gradient_routes.bench.cases.status import FOREIGN
from gradient_routes.bench.execution.case_context import Workbench
from gradient_routes.bench.execution.executors.running import interleaved
from gradient_routes.bench.execution.measure_job import Measure
from gradient_routes.bench.execution.measurement import Measurement, measure
from gradient_routes.problems.errors import DomainError, InputError


class Here:
    """A case under way in this process."""

    def __init__(self, bench: Workbench, job: Measure) -> None:
        self._bench, self._job = bench, job
        self._measured: Measurement | None = None

    @property
    def long(self) -> bool:
        return self._measured is not None and self._measured.long

    def prepared(self) -> Outcome | None:
        measured = measure(self._bench, self._job.route, self._job.row)
        if isinstance(measured, Outcome):
            return measured
        self._measured = measured
        return None

    def turn(self) -> bool:
        return self._measured is not None and self._measured.turn()

    def outcome(self, interleaved: int) -> Outcome:
        assert self._measured is not None
        return self._measured.outcome(interleaved)

    def close(self) -> None:
        self._measured = None


def outcomes(jobs: list[Measure]) -> Iterator[Outcome]:
    """Of all routes on one problem."""
    first = jobs[0]
    settle()
    try:
        with stdout_to_stderr():
            bench = Workbench(first.problem, first.settings, first.found)
    except (InputError, DomainError) as error:
        yield from (refused(job.row, error) for job in jobs)
    except FOREIGN as failure:
        yield from (unbuilt(job.row, job.problem.name, failure) for job in jobs)
    else:
        yield from interleaved(Here(bench, job) for job in jobs)


@cache
def settle() -> None:
    """What is loaded by now stays: the collections before measurements look at what comes after, and are short."""
    gc.collect()
    gc.freeze()
