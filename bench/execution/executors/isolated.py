"""A case in a process of its own."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing import Pipe
from queue import Empty, SimpleQueue
from typing import Any

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import Environment
from gradient_routes.bench.cases.outcome import Outcome, refused
from gradient_routes.bench.execution.cluster.shipped_case import Sealed
from gradient_routes.bench.execution.executors.running import alone
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.process import Confined, Killed
from gradient_routes.bench.execution.isolation.stack import where
from gradient_routes.bench.execution.references import Found
from gradient_routes.bench.execution.worker import Call, Job, Measure
from gradient_routes.problems.errors import RoutesError

Case = Measure | Sealed


class Line:
    """A confined worker doing a job, and the messages it sends, read beside: half a message must stop nobody."""

    def __init__(self, job: Job, limits: Limits, cwd: str | None = None) -> None:
        self._left = limits.timeout
        self.connection, other = Pipe()
        with other:
            self.process = Confined(
                "gradient_routes.bench.execution.worker",
                [str(other.fileno())],
                limits,
                pass_fds=[other.fileno()],
                cwd=cwd,
                stdin=subprocess.DEVNULL,
            )
        with suppress(OSError):  # it is gone: hearing will tell
            self.connection.send((limits, os.getpid(), sys.path))
            self.connection.send(job)
        self._heard: SimpleQueue[Any] = SimpleQueue()
        self._message: Any = None
        self._listening = threading.Thread(target=self._listen, daemon=True)
        self._listening.start()

    def hear(self) -> tuple[str, Any]:
        """Its next message. Raises Killed at a limit, EOFError where it has ended, with no word or a broken one."""
        start = time.monotonic()
        try:
            self.process.watch(self._came, start + self._left)
        finally:
            self._left -= time.monotonic() - start
        try:
            kind, what = self._message
        except (TypeError, ValueError) as broken:
            raise EOFError from broken
        return kind, what

    def _listen(self) -> None:
        message: Any = ()
        while message is not None:
            try:
                message = self.connection.recv()
            except Exception:  # its end, half a message, or one that cannot be read here
                message = None
            self._heard.put(message)

    def _came(self, seconds: float) -> bool:
        """Whether a message has, within so many seconds."""
        if self.process.gone:
            self._hang_up()  # a child it has left behind may hold the line open: who listens gets what is on it yet
        try:
            self._message = self._heard.get(timeout=seconds)
        except Empty:
            return False
        return True

    def say(self, kind: str, what: Any = None) -> None:
        """A dead worker is found out when it is heard."""
        with suppress(OSError):
            self.connection.send((kind, what))

    def close(self) -> None:
        """Whatever it and its children are at, it ends; who listens does before the line's descriptor is given away,
        or it would read on from the next that gets it.
        """
        self.process.kill()
        self._hang_up()
        self._listening.join()
        self.connection.close()

    def _hang_up(self) -> None:
        """Nothing more will come, whoever holds the other end."""
        with suppress(OSError), socket.fromfd(self.connection.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as line:
            line.shutdown(socket.SHUT_RDWR)


class Isolated:
    """A case under way in a process of its own; what it has said is known whatever becomes of it."""

    def __init__(self, job: Case, limits: Limits, cwd: str | None = None) -> None:
        self.found: Found = job.found
        self.long = False
        self._row: Row = job.row
        self._phase = "its start"
        self._environment: Environment | None = None
        self._ended: Outcome | None = None
        self._line = Line(replace(job, found=dict(job.found)), limits, cwd)

    def prepared(self) -> Outcome | None:
        return self._until("ready")

    def turn(self) -> bool:
        if self._ended is None:
            self._line.say("turn")
            self._until("turned")
        return self._ended is None and self._more

    def outcome(self, interleaved: int) -> Outcome:
        if self._ended is None:
            self._line.say("finish", interleaved)
            self._until("done")
        assert self._ended is not None
        return self._ended

    def close(self) -> None:
        self._line.close()

    def kill(self) -> None:
        """From another thread than the one that listens, which will hear that it has ended."""
        self._line.process.kill()

    def _until(self, wanted: str) -> Outcome | None:
        """Listen until it says so, or until it has ended: then its outcome."""
        kind = ""
        try:
            while kind != wanted and self._ended is None:
                kind, what = self._line.hear()
                self._take(kind, what)
        except Killed as limit:
            self._ended = self._died(limit.status, limit.reason)
        except EOFError:
            ending = self._line.process.ending()
            self._ended = self._died(ending.status, ending.reason)
        if self._ended is not None:
            self._line.close()  # now all of its stderr has come
            row = self._ended.row | {"stderr": self._line.process.stderr or None}
            self._ended = replace(self._ended, row=row)
        return self._ended

    def _take(self, kind: str, what: Any) -> None:
        if kind == "environment":
            self._environment = what
        elif kind == "known":
            self._phase, self._row = what
        elif kind == "ready":
            self.long, found = what
            self.found.update(found)  # for cases that are prepared before this one is done
        elif kind == "turned":
            self._more = what
        elif kind == "refused":
            self._ended = refused(self._row, what)
        elif kind == "done":
            self._ended, found = what
            self.found.update(found)

    def _died(self, status: str, reason: str) -> Outcome:
        """What was known when it died is kept."""
        error = self._row["gradient_error"]
        at = where(self._line.process.stderr)
        known = "" if error is None else f"; its gradient was known by then, its error {error:.2g}"
        row = self._row | {
            "status": status,
            "reason": f"{self._row['route']}: {status} in {self._phase}{at}: {reason}{known}",
        }
        return Outcome(row, environment=self._environment)


def called(function: Callable[..., Any], arguments: tuple[Any, ...], limits: Limits) -> Any:
    """What a function of a module returns in a process of its own. Raises RoutesError where that ends before."""
    line = Line(Call(function, arguments), limits)
    try:
        return line.hear()[1]
    except Killed as limit:
        raise RoutesError(f"{function.__name__}: {limit.status} {limit.reason} - raise the limit") from None
    except EOFError:
        ending = line.process.ending()
        raise RoutesError(f"{function.__name__}: {ending.status}: {ending.reason} - see {last(line)}") from None
    finally:
        line.close()


def last(line: Line) -> str:
    """The last thing it said."""
    said = [each for each in line.process.stderr.splitlines() if each.strip()]
    return said[-1].strip() if said else "nothing, it said nothing"


def whole(job: Case, limits: Limits, cwd: str | None = None) -> Outcome:
    """A case from its start to its end, timed beside no other."""
    return finished(Isolated(job, limits, cwd))


def finished(case: Isolated) -> Outcome:
    """The outcome of a case that nobody has listened to yet."""
    try:
        return case.prepared() or alone(case)
    finally:
        case.close()
