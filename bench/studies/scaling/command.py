"""`routes scaling`: the bill of every route against size, how far each gets, and where the adjoint begins to win."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import (
    SELECTOR,
    at_option,
    checked,
    complain,
    debug_option,
    debugging,
    refuse_given,
    solver_options,
    store_options,
)
from gradient_routes.bench.execution.options import limit_options
from gradient_routes.bench.studies.study import echo_json, json_option, keep, no_plot_option, writable
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError, RoutesError

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec
    from gradient_routes.bench.cases.outcome import Outcome
    from gradient_routes.bench.cases.row import Row
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.execution.isolation.limits import Limits
    from gradient_routes.bench.studies.scaling.break_even import Found, Racing
    from gradient_routes.bench.studies.scaling.climbing import Series
    from gradient_routes.bench.studies.scaling.sizes import Sizes
    from gradient_routes.routes.newton import Solver

PROBLEM = "NAME, whose n climbs, or a grid of sizes: 'NAME[n=8|64|512]'."
FROM = "n to begin with. [that of the problem]"
GROWTH = "Unknowns of a level over those of the level before."
LEVELS = "Sizes at most."
BUDGET = "End of a route: gradients predicted to take more seconds; inf forces them."
MIN_TIME = "Seconds of steady calls to time."


@click.command()
@click.option("--problem", "selector", required=True, metavar="SELECTOR", help=PROBLEM)
@click.option("--route", "routes", multiple=True, default=["all"], metavar="SELECTOR", help=f"{SELECTOR} [all]")
@at_option
@click.option("--from", "first", type=int, metavar="N", help=FROM)
@click.option("--growth", type=float, default=4.0, show_default=True, help=GROWTH)
@click.option("--levels", type=int, default=10, show_default=True, help=LEVELS)
@click.option("--budget", type=float, default=10.0, show_default=True, help=BUDGET)
@click.option("--min-time", type=float, default=0.1, show_default=True, help=MIN_TIME)
@solver_options
@limit_options("a case", 600.0)
@no_plot_option
@json_option
@store_options
@debug_option
def scaling(
    selector: str,
    routes: tuple[str, ...],
    at: str,
    first: int | None,
    growth: float,
    levels: int,
    budget: float,
    min_time: float,
    solver: Solver,
    isolate: bool,
    limits: Limits,
    no_plot: bool,
    as_json: bool,
    kept: Path | None,
) -> None:
    """Time, memory and work against unknowns, parameters and iterations, with exponents, and the largest size.

    A route ends where the next size is over the budget, or reaches another cap. On one affordable size tangent, finite
    differences and adjoint then race on 1, 2, 4 ... of the parameters: the n_p from which one is cheaper is fitted, and
    shown beside what the cost model predicts. A grid of iterations is fitted as well:
    --route 'unrolled-ad[iterations=10|100|1000]'.

    Exit code: 0 measured, 1 no route could be measured, 2 wrong usage, 130 interrupted.
    """
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.execution.isolation.signals import interruptible
    from gradient_routes.bench.execution.sweep import How, run
    from gradient_routes.bench.studies.scaling import measure as study
    from gradient_routes.bench.studies.scaling import view
    from gradient_routes.bench.studies.scaling.break_even import break_even

    if not 0 <= min_time < float("inf"):
        raise InputError(f"--min-time {min_time:g} - give seconds >= 0")
    asked = sizes_of(case.problems([selector]), first, growth, levels)
    specs = case.routes(routes)
    settings = Settings(at, checked(budget), min_time, solver=solver)
    writable(kept)
    started = now()
    for left_out in case.left_out([], routes):
        complain(f"left out of 'all': {left_out}")
    lost: list[str] = []
    interruptible()  # SIGTERM ends it like Ctrl-C: with tables
    if not isolate:
        limits.pin()
    measure = partial(run, how=How(isolate, limits))
    race = partial(apart, break_even, limits) if isolate else break_even
    done = study.scaling(asked, specs, settings, keeping(kept, lost), measure, race)
    tell(None)
    tables: dict[str, list[Row]] = done.tables
    if as_json:
        echo_json({"cases": [*done.rows], **tables})
    else:
        view.show(done, plotted=not no_plot)
    keep(kept, tables, started, quiet=as_json)
    if lost:
        raise InputError(f"{len(lost)} of {len(done.rows)} cases were not kept: {lost[0]}")
    if done.interrupted:
        raise KeyboardInterrupt
    if not any(row["status"] == "ok" for row in done.rows):
        raise click.exceptions.Exit(1)


def apart(race: Racing, limits: Limits, sizes: Sizes, every: list[Series], settings: Settings) -> Found:
    """The race in a process of its own: what ends it is a reason why there is none."""
    from gradient_routes.bench.execution.executors.isolated import called

    try:
        found: Found = called(race, (sizes, every, settings), limits)
    except RoutesError as ended:
        return [], str(ended)
    return found


def sizes_of(specs: list[ProblemSpec], first: int | None, growth: float, levels: int) -> Sizes:
    """What to measure on. Raises InputError."""
    from gradient_routes.bench.studies.scaling.sizes import sizes

    if not 1.0 < growth < float("inf") or levels < 1:
        raise InputError(f"--growth {growth:g} --levels {levels} - give a growth > 1 and at least one level")
    if len(specs) > 1:
        refuse_given(("growth", "levels"), "the sizes are those of the grid")
        if first is not None:
            raise InputError("--from: the sizes are those of the grid - leave it out")
    return sizes(specs, first, growth, levels)


def tell(row: Row | None) -> None:
    """What was measured last, on a line of the terminal that the next one covers; a bar that moves would be timed."""
    if sys.stderr.isatty() and sys.stdout.isatty():
        from gradient_routes.bench.render.terminal.tables import titled

        said = "" if row is None else f"{titled(row)} {row['route']}: {row['status']}"
        click.echo(f"\r\x1b[K{said[:70]}", nl=False, err=True)


def keeping(kept: Path | None, lost: list[str]) -> Callable[[Outcome], None]:
    """Puts a case into the store as soon as it is known; `lost` says why one is not there."""
    from gradient_routes.bench.store.store import Store

    store = None if kept is None else Store(kept)

    def append(outcome: Outcome) -> None:
        try:
            if store is not None:
                store.append(outcome.row, outcome.samples, outcome.environment)
        except InputError as error:  # a full disk, a lock: the row is printed all the same
            lost.append(str(error))
        if debugging():
            click.echo(outcome.row["traceback"] or "", err=True, nl=False)
        tell(outcome.row)

    return append
