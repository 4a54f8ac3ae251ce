"""The other end of a case: a process that does one job, says what it knows as soon as it knows it, and ends."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any, Protocol

from bench.isolation.inside import submit_to
from bench.isolation.stack import told

if TYPE_CHECKING:
    from bench.accuracy import Found
    from bench.case import ProblemSpec, RouteSpec
    from bench.rows import Row
    from bench.sources import Stamp
    from bench.workbench import Settings


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
        from bench.environment import environment
        from bench.measurement import measure
        from bench.outcome import FOREIGN, Outcome, bare, outdated, unbuilt
        from bench.sources import changed
        from bench.workbench import Workbench
        from problems.errors import DomainError, InputError

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
    """Builds problems without solving anything. Says of each: surveyed, and what bench.survey found."""

    problems: list[ProblemSpec]
    settings: Settings

    def __call__(self, channel: Channel) -> None:
        from bench.survey import surveyed

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
    for ours in ("problems", "routes"):
        import_module(ours)  # before what lies beside a user's file can be taken for them
    limits, parent, sys.path[:] = connection.recv()
    submit_to(limits, parent)
    job: Job = connection.recv()
    job(Channel(connection))
    sys.stderr.flush()
    os._exit(0)  # nothing that a plug-in or XLA does at exit is of interest


if __name__ == "__main__":
    main(int(sys.argv[1]))
