"""How large problems are, and which cannot be built as asked: known before anything is measured."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import ClassVar

from gradient_routes.bench.cases.case import ProblemSpec, sized
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.outcome import bare
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.status import FOREIGN
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import Returned
from gradient_routes.bench.execution.isolation.worker_process import WorkerProcess
from gradient_routes.bench.execution.pruning import Size
from gradient_routes.problems.errors import DomainError, InputError, RoutesError

BATCH = 1000  # problems that are sent to one process: those after one that ends it are sent again


@dataclass(frozen=True)
class Survey:
    """Builds problems without solving anything. Says of each what `surveyed` returns."""

    problems: list[ProblemSpec]
    settings: Settings
    name: ClassVar[str] = "survey"

    def __call__(self, channel: Channel) -> None:
        for problem in self.problems:
            channel.say(Returned(surveyed(problem, self.settings.at)))


def sizes(problems: list[ProblemSpec], settings: Settings, limits: Limits | None) -> list[Size | None]:
    """n_u and n_p of every problem, in a process of its own under `limits` or, where None, in this one; None for one
    whose code fails: each of its cases will tell. Raises InputError, DomainError.
    """
    if limits is None:
        return [_understood(surveyed(problem, settings.at)) for problem in problems]
    found: list[Size | None] = []
    while len(found) < len(problems):
        batch = problems[len(found) : len(found) + BATCH]
        before = len(found)
        with closing(WorkerProcess(Survey(batch, settings), limits)) as line:
            while len(found) < before + len(batch) and isinstance(message := line.hear(), Returned):
                found.append(_understood(message.value))
        if len(found) < before + len(batch):
            found.append(None)  # the one that it ended at
    return found


def surveyed(problem: ProblemSpec, at: str) -> Size | RoutesError | None:
    """The size of one problem, the error of one that refuses what it is given, None for one that fails."""
    try:
        with stdout_to_stderr():
            return sized(problem, at)
    except (InputError, DomainError) as error:
        return bare(error)
    except FOREIGN:
        return None


def _understood(what: Size | RoutesError | None) -> Size | None:
    if isinstance(what, RoutesError):
        raise what
    return what
