"""Cases in this process, those on one problem in one context: nothing limits them, nothing is started."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import cache

from gradient_routes.bench.cases.case import Case
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.outcome import Outcome, Record
from gradient_routes.bench.cases.status import FOREIGN
from gradient_routes.bench.execution.case_context import CaseContext
from gradient_routes.bench.execution.executors.running import interleaved
from gradient_routes.bench.execution.measurement import Measure, Measurement, measure
from gradient_routes.problems.errors import DomainError, InputError


class InProcess:
    """A case under way in this process."""

    def __init__(self, context: CaseContext, case: Case) -> None:
        self._context, self._case = context, case
        self._measured: Measurement | None = None

    @property
    def long(self) -> bool:
        return self._measured is not None and self._measured.long

    def prepared(self) -> Outcome | None:
        measured = measure(self._context, self._case, Record(self._case.asked))
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
    first = jobs[0].case
    settle()
    try:
        with stdout_to_stderr():
            context = CaseContext(first.problem, first.settings, jobs[0].found)
    except (InputError, DomainError) as error:
        yield from (Record(job.asked).refused(error) for job in jobs)
    except FOREIGN as failure:
        yield from (Record(job.asked).unbuilt(failure) for job in jobs)
    else:
        yield from interleaved(InProcess(context, job.case) for job in jobs)


@cache
def settle() -> None:
    """What is loaded by now stays: the collections before measurements look at what comes after, and are short."""
    gc.collect()
    gc.freeze()
