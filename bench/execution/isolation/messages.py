"""Messages from jobs, and orders to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gradient_routes.bench.cases.status import Status
from gradient_routes.problems.text import shortened

if TYPE_CHECKING:
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.cases.environment import Environment
    from gradient_routes.bench.cases.outcome import Outcome
    from gradient_routes.bench.execution.references import KnownJudges


@dataclass(frozen=True)
class Returned:
    """The value of a function, or one of several values."""

    value: Any


@dataclass(frozen=True)
class Begun:
    """A case has begun, in this environment."""

    environment: Environment


@dataclass(frozen=True)
class Known:
    """The phase of a case that begins, and the columns that have become known since the last one."""

    phase: str
    news: Row


@dataclass(frozen=True)
class Ready:
    """A case is ready to be timed, in turns; `long` where one call takes so long that no other case should wait.

    `found` are the references it has found.
    """

    long: bool
    found: KnownJudges


@dataclass(frozen=True)
class Turned:
    """A turn of timing is over; whether the case needs more of them."""

    more: bool


@dataclass(frozen=True)
class Done:
    """The outcome of a case, and the references it has found."""

    outcome: Outcome
    found: KnownJudges


@dataclass(frozen=True)
class Ended:
    """The last message: how the job ended.

    reason     what happened, with numbers
    stderr     last lines of what its process wrote to stderr
    traceback  of the exception that ended it
    killed     the process did not end by itself: what it had not said by then is lost
    """

    status: Status
    reason: str = ""
    stderr: str = ""
    traceback: str = ""
    killed: bool = False

    def __post_init__(self) -> None:
        for name in ("reason", "traceback"):
            object.__setattr__(self, name, shortened(getattr(self, name)))

    def line(self, who: str) -> str:
        """For the user: who, what happened, what to do."""
        return f"{who}: {self.status}: {self.reason} - {self.status.todo}" if self.status.todo else self.reason


Message = Any  # one of these, or of bench.cases.study, or any other picklable value


@dataclass(frozen=True)
class Turn:
    """To a case that is ready: time it for a while."""


@dataclass(frozen=True)
class Finish:
    """To a case that is ready: give the outcome, timed beside so many cases."""

    interleaved: int


Order = Turn | Finish
