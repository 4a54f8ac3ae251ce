"""A case under way, wherever it runs; and cases whose timings are taken in turn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

from gradient_routes.bench.cases.machine import available_bytes, total_bytes
from gradient_routes.bench.cases.outcome import Outcome

SPARE = 0.5  # of the machine's memory: with less at hand, no case waits for others


class Running(Protocol):
    """prepared() runs it up to its timing and gives the outcome where there is none; turn() times it for a while and
    says whether that is not enough; outcome(n) ends it, timed beside n cases; close() drops it.
    """

    @property
    def long(self) -> bool: ...

    def prepared(self) -> Outcome | None: ...

    def turn(self) -> bool: ...

    def outcome(self, interleaved: int) -> Outcome: ...

    def close(self) -> None: ...


def interleaved(cases: Iterable[Running]) -> Iterator[Outcome]:
    """Outcomes of cases on one problem, as they come: all are prepared, then timed in turn, so that what disturbs the
    machine for a while disturbs them all. A case of long calls waits for nobody.
    """
    waiting: list[Running] = []
    try:
        for case in cases:
            waiting.append(case)
            outcome = case.prepared()
            if outcome is None and (case.long or scarce()):
                outcome = alone(case)
            if outcome is not None:
                waiting.pop()
                yield outcome
        hungry = list(waiting)
        while hungry:
            hungry = [case for case in hungry if case.turn()]
        count = len(waiting)
        while waiting:
            outcome = waiting[0].outcome(count)  # still among those that are closed if this is interrupted
            waiting.pop(0)
            yield outcome
    finally:
        for case in waiting:
            case.close()


def alone(case: Running) -> Outcome:
    """All its turns at once."""
    while case.turn():
        pass
    return case.outcome(1)


def scarce() -> bool:
    """Whether processes that wait could be in the way of others."""
    left, whole = available_bytes(), total_bytes()
    return left is not None and whole is not None and left < SPARE * whole
