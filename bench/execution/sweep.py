"""Sweeps: all pairs of problems and routes become cases, cases become rows. A failure is a row, too."""

from __future__ import annotations

import itertools
import math
import socket
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from gradient_routes.bench.cases.case import Case, ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.keys import identity, witnesses
from gradient_routes.bench.cases.outcome import Outcome, Record
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.measurement import Measure
from gradient_routes.bench.execution.pruning import Pruning, Size
from gradient_routes.bench.execution.references import KnownJudges
from gradient_routes.bench.execution.survey import sizes
from gradient_routes.bench.store.claims import Claims
from gradient_routes.bench.units import now

Group = tuple[ProblemSpec, Size | None, list[RouteSpec]]  # the routes on one problem


@dataclass(frozen=True)
class How:
    """Where cases run: in processes of their own under limits, or here; so many at once; by a Dask cluster."""

    isolate: bool = True
    limits: Limits = field(default_factory=Limits)
    jobs: int = 1
    cluster: Any = None

    @property
    def columns(self) -> Row:
        """The columns that tell of it."""
        return {
            "isolated": int(self.isolate),
            "threads": self.limits.threads,
            "timeout_s": self.limits.timeout if self.isolate and math.isfinite(self.limits.timeout) else None,
            "memory_cap_bytes": self.limits.memory if self.isolate else None,
        }


HERE = How(isolate=False)


def everything(row: Row) -> bool:
    """Every case is wanted."""
    return True


def run(
    problems: list[ProblemSpec],
    routes: list[RouteSpec],
    settings: Settings,
    how: How = HERE,
    wanted: Callable[[Row], bool] = everything,
    claims: Claims | None = None,
) -> Generator[Outcome]:
    """All pairs that are wanted, problem by problem; each outcome as soon as it is known.

    With `claims`, what another runner has claimed comes last, if it is still wanted then. InputError and DomainError
    for problems that cannot be come before anything is measured.
    """
    return Sweep(problems, routes, settings, how, wanted, claims).outcomes()


class Sweep:
    """Cases, and what is known of them before and between."""

    def __init__(
        self,
        problems: list[ProblemSpec],
        routes: list[RouteSpec],
        settings: Settings,
        how: How,
        wanted: Callable[[Row], bool],
        claims: Claims | None = None,
    ) -> None:
        self.settings, self.how, self.wanted, self.claims = settings, how, wanted, claims
        todo = problems
        if wanted is not everything:  # else nothing is asked twice
            todo = [p for p in problems if any(wanted(self._asked(p, route)) for route in routes)]
        guarded = how.limits if how.isolate else None
        known: list[Size | None] = [None] if len(todo) == 1 else sizes(todo, settings, guarded)
        self.groups: list[Group] = [(problem, size, routes) for problem, size in zip(todo, known, strict=True)]
        self.held: list[Group] = []  # by other runners, one route each
        self.unstored = False  # whether this runner holds claims to its end, hence may not wait for others
        self.pruning = Pruning()
        self._places = itertools.count()
        self._started: dict[str, tuple[int, Case, Size | None]] = {}

    def outcomes(self) -> Generator[Outcome]:
        """Raises the refusal of a case that is refused before any other has an outcome."""
        begun = False
        for outcome in self._outcomes():
            if outcome.refusal is not None and not begun:
                raise outcome.refusal
            begun = True
            yield outcome
            if self.claims is not None:
                if self.wanted(outcome.row):  # its row is not stored yet: nobody else shall run it
                    self.unstored = True
                else:
                    self.claims.release(outcome.row["case_key"])

    def _outcomes(self) -> Iterator[Outcome]:
        while self.groups:
            for outcome in self._side_by_side() if self.how.jobs > 1 or self.how.cluster else self._one_by_one():
                place, case, size = self._started.pop(outcome.row["case_key"])
                self.pruning.note(case.problem, case.route, size, outcome.row)
                yield replace(outcome, place=place)
            self.groups, self.held = [] if self.unstored else self.held, []
            if self.claims is not None and self.groups:
                self.claims.wait([self._asked(problem, route)["case_key"] for problem, _, (route,) in self.groups])

    def _one_by_one(self) -> Iterator[Outcome]:
        for group in self.groups:
            pruned: list[Outcome] = []
            jobs = list(self._jobs([group], pruned))
            yield from pruned
            if jobs:
                yield from self._group(jobs)

    def _group(self, jobs: list[Measure]) -> Iterator[Outcome]:
        """The routes on one problem, timed in turn."""
        if not self.how.isolate:
            from gradient_routes.bench.execution.executors.in_process import outcomes

            return outcomes(jobs)
        from gradient_routes.bench.execution.executors.isolated import Isolated
        from gradient_routes.bench.execution.executors.running import interleaved

        return interleaved(Isolated(job, self.how.limits) for job in jobs)

    def _side_by_side(self) -> Iterator[Outcome]:
        from gradient_routes.bench.execution.executors import pool

        pruned: list[Outcome] = []
        jobs = self._jobs(self.groups, pruned)
        run = self.how.cluster.outcomes if self.how.cluster is not None else pool.outcomes
        for outcome in run(jobs, self.how.jobs, self.how.limits):
            yield outcome
            while pruned:
                yield pruned.pop(0)
        yield from pruned

    def _jobs(self, groups: Iterable[Group], pruned: list[Outcome]) -> Iterator[Measure]:
        """What is wanted; what is not worth trying goes among the pruned, what others run among the held."""
        for problem, size, routes in groups:
            found: KnownJudges = {}
            for route in routes:
                case = Case(problem, route, self.settings, self._asked(problem, route))
                if not self.wanted(case.asked):
                    continue
                if self.claims is not None:
                    if not self.claims.take(case.asked["case_key"]):
                        self.held.append((problem, size, [route]))
                        continue
                    if not self.wanted(case.asked):  # whoever held it has done it
                        self.claims.release(case.asked["case_key"])
                        continue
                self._started[case.asked["case_key"]] = next(self._places), case, size
                reason = self.pruning.reason(problem, route, size)
                if reason is None:
                    yield Measure(case, found, witnesses(problem, route, self.settings.at))
                else:
                    record = Record(case.asked)
                    record.add(dict(zip(("n_state", "n_param"), size or (), strict=False)))
                    pruned.append(record.ended(Status.PRUNED, reason))

    def _asked(self, problem: ProblemSpec, route: RouteSpec) -> Row:
        """The columns that are known before it is run."""
        budget = self.settings.budget
        return {
            **identity(problem, route, self.settings, self.how.limits.threads),
            **self.how.columns,
            "budget_s": budget if math.isfinite(budget) else None,
            "started": now(),
            "host": socket.gethostname(),
        }
