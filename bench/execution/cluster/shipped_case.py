"""A case as it travels to another host."""

from __future__ import annotations

import os
import pickle
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gradient_routes.bench.execution.isolation.messages import Begun, Done
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.execution.isolation.channel import Channel
    from gradient_routes.bench.execution.measure_job import Measure
    from gradient_routes.bench.execution.references import Found


@dataclass(frozen=True)
class Sealed:
    """Opened by the process that runs it and by no other: to open it imports the code of problem and route.

    parts  problem, route and settings, pickled
    files  that the case reads
    """

    parts: bytes
    files: tuple[str, ...]
    row: Row
    found: Found

    @property
    def name(self) -> str:
        return str(self.row["route"])

    def __call__(self, channel: Channel) -> None:
        from gradient_routes.bench.cases.environment import environment
        from gradient_routes.bench.cases.keys import witnesses
        from gradient_routes.bench.cases.outcome import Outcome, failed
        from gradient_routes.bench.execution.measure_job import Measure

        try:
            problem, route, settings = pickle.loads(self.parts)
            checked_s = self._check(problem, route, settings.at)
        except InputError as error:
            channel.say(Begun(environment()))
            row = failed(self.row, self.row["route"], error)
            row["reason"] = f"{self.row['route']} on {self.row['host']}: {error}"
            channel.say(Done(Outcome(row), {}))
            return
        row = self.row | {"prepare_s": -checked_s}  # at home nobody checks: it is no part of the preparation
        Measure(problem, route, settings, row, self.found, witnesses(problem, route, settings.at))(channel)

    def _check(self, problem: ProblemSpec, route: RouteSpec, at: str) -> float:
        """The seconds it took. Raises InputError where this host would compute something else."""
        from gradient_routes.bench.cases.keys import content_key

        start = time.perf_counter()
        missing = [file for file in self.files if not os.path.isfile(file)]
        if missing:
            raise InputError(f"no file {missing[0]} in {os.getcwd()} - copy it there")
        if content_key(self.row["case_key"], problem, route, at) != self.row["content_key"]:
            raise InputError("its code, data or libraries are others than here - install and copy the same there")
        return time.perf_counter() - start


def sealed(job: Measure) -> Sealed:
    """A case ready to travel."""
    from gradient_routes.bench.cases.case import files

    parts = pickle.dumps((job.problem, job.route, job.settings))
    return Sealed(parts, tuple(map(str, files([job.problem], job.settings.at))), job.row, job.found)
