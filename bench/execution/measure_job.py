"""The jobs of a sweep: measure a case, survey problems."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.execution.isolation.messages import Begun, Done, Known, Returned

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.cases.sources import Stamp
    from gradient_routes.bench.execution.references import Found


@dataclass(frozen=True)
class Measure:
    """One case. Says Begun, Known phase by phase, Ready before it is timed in turns that it is told to take, Done."""

    problem: ProblemSpec
    route: RouteSpec
    settings: Settings
    row: Row
    found: Found
    witnesses: tuple[Stamp, ...] = ()

    @property
    def name(self) -> str:
        return self.route.name

    def __call__(self, channel: Channel) -> None:
        """Files that have changed since the runner took their key end it: a row must not stand under another's name.
        Raises InputError and DomainError for a problem that does not take what it was given.
        """
        from gradient_routes.bench.cases.environment import environment
        from gradient_routes.bench.cases.outcome import Outcome, outdated, unbuilt
        from gradient_routes.bench.cases.sources import changed
        from gradient_routes.bench.cases.status import FOREIGN
        from gradient_routes.bench.execution.case_context import Workbench
        from gradient_routes.bench.execution.measurement import measure
        from gradient_routes.problems.errors import DomainError, InputError

        channel.say(Begun(environment()))
        row = self.row | {"prepare_s": (self.row["prepare_s"] or 0.0) + age()}
        channel.say(Known("the building of its problem", row))
        try:
            bench = Workbench(self.problem, self.settings, self.found)
        except (InputError, DomainError):
            raise
        except FOREIGN as failure:
            channel.say(Done(unbuilt(row, self.problem.name, failure), {}))
            return
        measured = measure(bench, self.route, row, lambda phase, row: channel.say(Known(phase, dict(row))))
        if not isinstance(measured, Outcome):
            measured = measured.in_turns(channel)
        file = changed(self.witnesses)
        if file is not None:
            measured = Outcome(outdated(row, file))
        channel.say(Done(measured, bench.judges.found if file is None else {}))


@dataclass(frozen=True)
class Survey:
    """Builds problems without solving anything. Says of each what bench.execution.survey found."""

    name: ClassVar[str] = "survey"

    problems: list[ProblemSpec]
    settings: Settings

    def __call__(self, channel: Channel) -> None:
        from gradient_routes.bench.execution.survey import surveyed

        for problem in self.problems:
            channel.say(Returned(surveyed(problem, self.settings.at)))


def age() -> float:
    """Seconds since this process was started."""
    import psutil

    return float(time.time() - psutil.Process().create_time())
