"""A case as it is sent to another host."""

from __future__ import annotations

import pickle
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.execution.isolation.messages import Begun, Done
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.execution.isolation.channel import Channel
    from gradient_routes.bench.execution.measurement import Measure
    from gradient_routes.bench.execution.references import KnownJudges


@dataclass(frozen=True)
class ShippedCase:
    """Unpickled only by the process that runs it, since that imports the code of problem and route.

    parts  problem, route and settings, pickled
    files  that the case reads
    """

    parts: bytes
    files: tuple[str, ...]
    asked: Row
    found: KnownJudges

    @property
    def name(self) -> str:
        return str(self.asked["route"])

    def __call__(self, channel: Channel) -> None:
        from gradient_routes.bench.cases.case import Case
        from gradient_routes.bench.cases.environment import environment
        from gradient_routes.bench.cases.keys import witnesses
        from gradient_routes.bench.cases.outcome import Record
        from gradient_routes.bench.execution.measurement import Measure

        try:
            problem, route, settings = pickle.loads(self.parts)
            checked_s = self._check(problem, route, settings.at)
        except InputError as error:
            channel.say(Begun(environment()))
            reason = f"{self.name} on {self.asked['host']}: {error}"
            channel.say(Done(Record(self.asked).failed(InputError(reason), self.name), {}))
            return
        case = Case(problem, route, settings, self.asked)
        Measure(case, self.found, witnesses(problem, route, settings.at), checked_s)(channel)

    def _check(self, problem: ProblemSpec, route: RouteSpec, at: str) -> float:
        """The seconds the check took. Raises InputError if files, code or libraries differ on this host."""
        from gradient_routes.bench.cases.keys import content_key

        start = time.perf_counter()
        missing = [file for file in self.files if not located(file).is_file()]
        if missing:
            raise InputError(f"no file {missing[0]} in {located('')} - copy it there")
        if content_key(self.asked["case_key"], problem, route, at) != self.asked["content_key"]:
            raise InputError("its code, data or libraries are others than here - install and copy the same there")
        return time.perf_counter() - start


def shipped(job: Measure) -> ShippedCase:
    """A case to be sent."""
    from gradient_routes.bench.cases.case import files

    case = job.case
    parts = pickle.dumps((case.problem, case.route, case.settings))
    return ShippedCase(parts, tuple(map(str, files([case.problem.options], case.settings.at))), case.asked, job.found)
