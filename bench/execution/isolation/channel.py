"""A job, and its connection to the process that runs it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from gradient_routes.bench.cases.status import Status, one_line, reason_of, status_of
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Order, Returned
from gradient_routes.problems.errors import DomainError, InputError

SAID = "said"  # marks every message between processes: anything else on the pipe is no message


def no_orders() -> Order:
    raise EOFError("this job is given no orders")


@dataclass(frozen=True)
class Channel:
    """say(message) sends to the process that runs the job, which may be this one; hear() waits for an order."""

    say: Callable[[Message], None]
    hear: Callable[[], Order] = no_orders


class Job(Protocol):
    """A picklable callable that can run in its own process; `name` stands in messages.

    It sends each result as soon as it has it. To end it early KeyboardInterrupt is raised in it: it may still send
    what it has, and raises KeyboardInterrupt again.
    """

    @property
    def name(self) -> str: ...

    def __call__(self, channel: Channel) -> None: ...


@dataclass(frozen=True)
class Call:
    """Calls function(*arguments) and sends what it returns."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()

    @property
    def name(self) -> str:
        return self.function.__name__

    def __call__(self, channel: Channel) -> None:
        channel.say(Returned(self.function(*self.arguments)))


def ended(job: Job, channel: Channel) -> Ended:
    """Do the job; how it ended. The only place where an exception of a job becomes a status."""
    try:
        job(channel)
    except KeyboardInterrupt:
        return Ended(Status.INTERRUPTED)
    except (InputError, DomainError) as error:
        return Ended(Status.REFUSED, str(error), traceback=_formatted(error))
    except BaseException as failure:  # user code may raise anything
        status = status_of(failure)
        reason = one_line(failure) if status.todo else reason_of(failure, job.name)
        return Ended(status, reason, traceback=_formatted(failure))
    return Ended(Status.OK)


def _formatted(failure: BaseException) -> str:
    return "".join(traceback.format_exception(failure))
