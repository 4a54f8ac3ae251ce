"""A job, and how it speaks to whoever runs it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from gradient_routes.bench.cases.status import Status, one_line, reason_of, status_of
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Order, Returned
from gradient_routes.problems.errors import DomainError, InputError

SAID = "said"  # goes with every message from one process to the other, to tell it from garbage


def no_orders() -> Order:
    raise EOFError("this job is given no orders")


@dataclass(frozen=True)
class Channel:
    """say(message) reports to whoever runs the job, in this process or another; hear() waits for an order."""

    say: Callable[[Message], None]
    hear: Callable[[], Order] = no_orders


class Job(Protocol):
    """What can be run in a process of its own: picklable, with a name for messages.

    It says what it has as soon as it has it. Where it is to end early KeyboardInterrupt is raised in it: it may still
    say what it has, and raises KeyboardInterrupt again.
    """

    @property
    def name(self) -> str: ...

    def __call__(self, channel: Channel) -> None: ...


@dataclass(frozen=True)
class Call:
    """function(*arguments). Says what it returned."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()

    @property
    def name(self) -> str:
        return self.function.__name__

    def __call__(self, channel: Channel) -> None:
        channel.say(Returned(self.function(*self.arguments)))


def ended(job: Job, channel: Channel) -> Ended:
    """Do the job, and say how it ended. The one place where what a job raises becomes a status."""
    try:
        job(channel)
    except KeyboardInterrupt:
        return Ended(Status.INTERRUPTED)
    except (InputError, DomainError) as error:
        return Ended(Status.REFUSED, str(error), traceback=_formatted(error))
    except BaseException as failure:  # whatever code of others raises
        status = status_of(failure)
        reason = one_line(failure) if status.todo else reason_of(failure, job.name)
        return Ended(status, reason, traceback=_formatted(failure))
    return Ended(Status.OK)


def _formatted(failure: BaseException) -> str:
    return "".join(traceback.format_exception(failure))
