"""The other end of a case: a process that does one job, says what it knows as soon as it knows it, and ends."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any, Protocol

from gradient_routes.bench.execution.isolation.inside import submit_to
from gradient_routes.bench.execution.isolation.stack import told

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.cases.sources import Stamp
    from gradient_routes.bench.execution.references import Found


class Channel:
    """Messages to the runner, (kind, what) each, and its answers."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def say(self, kind: str, what: Any = None) -> None:
        self._connection.send((kind, what))

    def hear(self) -> tuple[str, Any]:
        kind, what = self._connection.recv()
        return kind, what


class Job(Protocol):
    """What can be sent to a worker."""

    def __call__(self, channel: Channel) -> None: ...


@dataclass(frozen=True)
class Measure:
    """One case. Says: environment, known (phase, row), and refused or done at the end; ready, with references it found,
    before it is timed, in turns that it is told to take."""

    problem: ProblemSpec
    route: RouteSpec
    settings: Settings
    row: Row
    found: Found
    witnesses: tuple[Stamp, ...] = ()

    def __call__(self, channel: Channel) -> None:
        """Files that have changed since the runner took their key end it: a row must not stand under another's name."""
        from gradient_routes.bench.cases.environment import environment
        from gradient_routes.bench.cases.outcome import FOREIGN, Outcome, bare, outdated, unbuilt
        from gradient_routes.bench.cases.sources import changed
        from gradient_routes.bench.execution.case_context import Workbench
        from gradient_routes.bench.execution.measurement import measure
        from gradient_routes.problems.errors import DomainError, InputError

        channel.say("environment", environment())
        row = self.row | {"prepare_s": (self.row["prepare_s"] or 0.0) + age()}
        channel.say("known", ("the building of its problem", row))
        try:
            bench = Workbench(self.problem, self.settings, self.found)
        except (InputError, DomainError) as error:
            channel.say("refused", bare(error))
            return
        except FOREIGN as failure:
            channel.say("done", (unbuilt(row, self.problem.name, failure), {}))
            return
        measured = measure(bench, self.route, row, lambda phase, row: channel.say("known", (phase, dict(row))))
        if not isinstance(measured, Outcome):
            measured = measured.in_turns(channel)
        file = changed(self.witnesses)
        if file is not None:
            channel.say("done", (Outcome(outdated(row, file)), {}))
            return
        channel.say("done", (measured, bench.judges.found))


@dataclass(frozen=True)
class Survey:
    """Builds problems without solving anything. Says of each: surveyed, and what bench.execution.survey found."""

    problems: list[ProblemSpec]
    settings: Settings

    def __call__(self, channel: Channel) -> None:
        from gradient_routes.bench.execution.survey import surveyed

        for problem in self.problems:
            channel.say("surveyed", surveyed(problem, self.settings.at))


@dataclass(frozen=True)
class Call:
    """function(*arguments). Says: done, and what it returned."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]

    def __call__(self, channel: Channel) -> None:
        channel.say("done", self.function(*self.arguments))


def age() -> float:
    """Seconds since this process was started."""
    import psutil

    return float(time.time() - psutil.Process().create_time())


def main(descriptor: int) -> None:
    """Submit to limits, do one job."""
    os.set_inheritable(descriptor, False)  # what a case starts must not hold the line open
    told()
    os.dup2(2, 1)  # stdout belongs to results, whoever writes to it
    assert isinstance(sys.stderr, io.TextIOWrapper)
    sys.stderr.reconfigure(write_through=True)  # what is printed before a crash is not lost
    sys.stdout = sys.stderr
    connection = Connection(descriptor)
    limits, parent, sys.path[:] = connection.recv()
    submit_to(limits, parent)
    job: Job = connection.recv()
    job(Channel(connection))
    sys.stderr.flush()
    os._exit(0)  # nothing that a plug-in or XLA does at exit is of interest


if __name__ == "__main__":
    main(int(sys.argv[1]))
