"""A command in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.command_options import Command, complain
from gradient_routes.bench.execution.isolation.signals import interruptible
from gradient_routes.bench.execution.options import limit_options
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.execution.isolation.limits import Limits
    from gradient_routes.bench.execution.isolation.process import Confined

FAILED, INTERRUPTED = 1, 130
FINISHED = "what is finished is printed, and kept unless --no-store"
LAST = 10.0  # [s] to keep what there is when the time is over


@dataclass
class Inside:
    """The context's object in a process that is confined already."""

    stopped: bool = False  # it has been told to end
    expired: bool = False  # its time is over, and it is being stopped: the process that watches it says so


def confined(timeout: float = 3600.0, keeps: bool = False) -> Callable[[Command], Command]:
    """The whole verb in a process of its own, this one watching. It writes where this one writes.

    One that `keeps` what it has when it is interrupted is interrupted at its limit of time, before it is killed.
    """

    def decorate(command: Command) -> Command:
        @wraps(command)
        def apart(*, isolate: bool, limits: Limits, **others: Any) -> Any:
            context = click.get_current_context()
            if isolate and not isinstance(context.find_root().obj, Inside):
                raise click.exceptions.Exit(_watched(context.info_name or "", limits, keeps, others.get("kept")))
            if not isolate:
                limits.pin()
            return command(**others)

        return limit_options("it", timeout, LAST if keeps else 0.0)(apart)

    return decorate


def _watched(verb: str, limits: Limits, keeps: bool, kept: Any) -> int:
    """Its exit code. A limit is said in a line and kept as a study that came to nothing."""
    from gradient_routes.bench.execution.isolation.command import ENDED, EXPIRED
    from gradient_routes.bench.execution.isolation.process import Confined, Killed

    given = json.dumps(asdict(limits) | {"timeout": None})
    reader, writer = os.pipe()
    arguments = [given, str(os.getpid()), str(writer), *sys.argv[1:]]
    interruptible()  # what was started ends, too
    last = (EXPIRED, LAST) if keeps else None
    process = Confined(
        "gradient_routes.bench.execution.isolation.command",
        arguments,
        limits,
        talkative=True,
        last_words=last,
        pass_fds=[writer],
    )
    os.close(writer)
    try:
        process.watch(process.ended, time.monotonic() + limits.timeout)
    except Killed as limit:
        left = f"; {FINISHED}" if keeps and process.process.returncode == INTERRUPTED else ""  # else it did not react
        return _ended(verb, limit.status, limit.reason, f"raise the limit, or ask for less{left}", process, kept)
    except KeyboardInterrupt:
        return _interrupted(process)
    code = process.process.wait()
    process.kill()  # what it has left behind
    word = _word(reader)
    if word == ENDED:
        return code
    if word:
        return _ended(verb, Status.OUT_OF_MEMORY, word, "raise --memory, or ask for less", process, kept)
    ending = process.ending()
    return _ended(verb, ending.status, ending.reason, "see what it says above", process, kept)


def _word(reader: int) -> str:
    """What has been said on a line, which processes that are out of reach may still hold open."""
    os.set_blocking(reader, False)
    try:
        return os.read(reader, 10_000).decode(errors="replace")
    except BlockingIOError:
        return ""
    finally:
        os.close(reader)


def _ended(verb: str, status: str, reason: str, todo: str, process: Confined, kept: Any) -> int:
    """Say and keep why a verb has come to nothing."""
    complain(f"{verb}: {status}: {reason} - {todo}")
    _keep(kept, verb, status, reason, process.stderr)
    return FAILED


def _interrupted(process: Confined) -> int:
    """The verb may still print and keep what it has."""
    from gradient_routes.bench.execution.isolation.run import GRACE

    process.process.send_signal(signal.SIGINT)
    with suppress(KeyboardInterrupt):  # the user's patience is over
        process.ended(GRACE)
    process.kill()
    if "routes: interrupted" not in process.stderr:
        complain("interrupted - nothing is kept")
    return INTERRUPTED


def _keep(kept: Any, verb: str, status: str, reason: str, stderr: str) -> None:
    from gradient_routes.bench.store.store import Store

    if kept is not None:
        try:
            Store(kept).append_ended(verb, status, reason, stderr)
        except InputError as error:
            complain(f"not kept: {error}")
