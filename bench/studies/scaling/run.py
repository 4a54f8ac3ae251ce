"""What `routes scaling` runs: cases of every size, each kept as soon as it is measured, then the race."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import ProblemSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.study import Found, Kept, Note, Say
from gradient_routes.bench.command_options import debugging, refuse_given
from gradient_routes.bench.execution.describing import described
from gradient_routes.bench.execution.executors.isolated import called
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.sweep import How
from gradient_routes.bench.execution.sweep import run as run_cases
from gradient_routes.bench.render.terminal.tables import titled
from gradient_routes.bench.sanitize import echo, overwrite
from gradient_routes.bench.store.keeping import Keeper
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.options import routes_of
from gradient_routes.bench.studies.scaling.break_even import BreakEvens, Racing, break_even
from gradient_routes.bench.studies.scaling.checkpoints import check_intervals, every_kind
from gradient_routes.bench.studies.scaling.climbing import Series
from gradient_routes.bench.studies.scaling.measure import scaling
from gradient_routes.bench.studies.scaling.sizes import Count, Sizes, sizes, unknowns
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.routes.newton import Solver


def run(
    say: Say,
    *,
    selector: str,
    routes: Sequence[str],
    at: str,
    axis: str | None,
    first: int | None,
    growth: float,
    levels: int,
    budget: float,
    min_time: float,
    solver: Solver,
    isolate: bool,
    limits: Limits,
    kept: Path | None,
) -> int:
    """Ctrl-C ends the study, not what it has measured."""
    told = described([selector], routes or ["all"], limits) if isolate else case.NOTHING
    count = (lambda spec: int(called(unknowns, (spec,), limits))) if told else unknowns
    asked = sizes_of(case.problems([selector], told), first, growth, levels, count, axis)
    specs = routes_of(routes or every_kind(asked), say, told)
    check_intervals(asked, specs)
    settings = Settings(at, budget, min_time, solver=solver)
    keeper = Keeper(None if kept is None else Store(kept))
    measure = partial(run_cases, how=How(isolate, limits))
    race = partial(apart, break_even, limits) if isolate else break_even
    done = scaling(asked, specs, settings, keeping(keeper), measure, race)
    tell(None)
    for row in done.rows:
        say(Kept("cases", row, stored=True))
    for table, rows in done.tables.items():
        for row in rows:
            say(Kept(table, row))
    say(Found(done))
    if lost := keeper.close():
        say(Note(lost))
    if done.interrupted:
        raise KeyboardInterrupt
    if lost:
        return 1
    return 0 if any(row["status"] == "ok" for row in done.rows) else 1


def apart(race: Racing, limits: Limits, sizes: Sizes, every: list[Series], settings: Settings) -> BreakEvens:
    """The race in a process of its own: what ends it is a reason why there is none."""
    try:
        found: BreakEvens = called(race, (sizes, every, settings), limits)
    except RoutesError as ended:
        return [], str(ended)
    return found


def sizes_of(
    specs: list[ProblemSpec], first: int | None, growth: float, levels: int, count: Count, axis: str | None
) -> Sizes:
    """What to measure on. Raises InputError."""
    if len(specs) > 1:
        refuse_given(("growth", "levels"), "the sizes are those of the grid")
        if first is not None:
            raise InputError("--from: the sizes are those of the grid - leave it out")
    return sizes(specs, first, growth, levels, count, axis)


def tell(row: Row | None) -> None:
    """What was measured last, on a line of the terminal that the next one covers; a bar that moves would be timed."""
    if sys.stderr.isatty():
        said = "" if row is None else f"{titled(row)} {row['route']}: {row['status']}"
        overwrite(said[:70])


def keeping(keeper: Keeper) -> Callable[[Outcome], None]:
    """Puts a case into the store as soon as it is known."""

    def append(outcome: Outcome) -> None:
        keeper.append(outcome.row, outcome.samples, outcome.environment)
        if debugging():
            echo(outcome.row["traceback"] or "", err=True, nl=False)
        tell(outcome.row)

    return append
