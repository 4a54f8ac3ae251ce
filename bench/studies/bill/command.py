"""`routes run`: the gradient by every route on every problem named, its cost and its error."""

from __future__ import annotations

import math
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from gradient_routes.bench.command_options import (
    SELECTOR,
    at_option,
    complain,
    debug_option,
    debugging,
    refuse_given,
    replaces,
    solver_options,
    store_options,
)
from gradient_routes.bench.execution.options import executor_options, limit_options
from gradient_routes.bench.ranges import MANY, SECONDS, SEED, SHORT
from gradient_routes.bench.sanitize import echo
from gradient_routes.bench.studies.data_options import UNITS, reading

if TYPE_CHECKING:
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.cases.expected import Expectation
    from gradient_routes.bench.cases.outcome import Outcome
    from gradient_routes.bench.execution.isolation.limits import Limits
    from gradient_routes.bench.execution.options import Executing
    from gradient_routes.bench.store.store import Store
    from gradient_routes.routes.newton import Solver

Only = Literal["missing", "failed", "stale", "all"]
SHOWN = "-"  # --gradient without a file
GRADIENT = (
    f"Show every component of the gradient beside its reference; with FILE.csv, write them there. {replaces('.csv')}"
)
COMPONENTS = "Compute only M components of dJ/dp, drawn at random."
DIRECTIONS = "Compute only the slopes of J along M random directions."
VTU = f"Write u, lambda and dJ/dp on the mesh, for ParaView. For one problem and one route. {replaces('.vtu')}"
SENSITIVITIES = f"Write du/dp, for one problem and --route tangent. {replaces('.csv', '.npz', '.vtu')}"
OF = "Sensitivities of the state, du/dp, or of the data, d(S u)/dp."
COLUMNS = (
    "Columns of a data file, as x=NAME,ux=NAME; y=3mm is one value for all rows. [by its header] Or parameters to write"
    " du/dp for, by number, as 1,5-8; also written to --vtu. [all; in --vtu none]"
)
BUDGET = "Skip gradients predicted to take longer [s] or to need more memory than there is; inf: skip none."
TIMING = "Time the gradients; errors, counted work and memory are measured in any case."
RESUME = "Run only cases that are missing in the store, failed, or stale: code, data or libraries changed."
EXPECTED = "File of known failures and their reasons. [expected.toml beside the store]"
ONLY = "Run only cases of one of these kinds; all: run every case again."
YES = "Run more than 100 000 cases."


@click.command()
@click.option("--problem", "problems", multiple=True, required=True, metavar="SELECTOR", help=SELECTOR)
@click.option("--route", "routes", multiple=True, required=True, metavar="SELECTOR", help=SELECTOR)
@at_option
@click.option("--budget", type=SECONDS, default=60.0, show_default=True, help=BUDGET)
@click.option("--min-time", type=SHORT, default=0.1, show_default=True, help="Time each gradient for this long [s].")
@click.option("--timing/--no-timing", "timed", default=True, show_default=True, help=TIMING)
@solver_options
@click.option("--components", type=MANY, metavar="M", help=COMPONENTS)
@click.option("--directions", type=MANY, metavar="M", help=DIRECTIONS)
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of --components and --directions.")
@click.option("--gradient", is_flag=False, flag_value=SHOWN, metavar="[FILE.csv]", help=GRADIENT)
@click.option("--vtu", type=click.Path(path_type=Path), metavar="FILE.vtu", help=VTU)
@click.option("--sensitivities", type=click.Path(path_type=Path), metavar="FILE", help=SENSITIVITIES)
@click.option("--sensitivities-of", type=click.Choice(["state", "data"]), default="state", show_default=True, help=OF)
@click.option("--columns", metavar="LIST", help=COLUMNS)
@click.option("--units", metavar="LIST", help=UNITS)
@click.option("--resume", is_flag=True, help=RESUME)
@click.option("--only", type=click.Choice(["missing", "failed", "stale", "all"]), help=ONLY)
@click.option("--expected", type=click.Path(path_type=Path), metavar="FILE.toml", help=EXPECTED)
@click.option("--yes", is_flag=True, help=YES)
@limit_options("a case", 600.0)
@executor_options
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line and nothing else.")
@store_options
@debug_option
def run(
    problems: tuple[str, ...],
    routes: tuple[str, ...],
    at: str,
    budget: float,
    min_time: float,
    timed: bool,
    solver: Solver,
    components: int | None,
    directions: int | None,
    seed: int,
    gradient: str | None,
    vtu: Path | None,
    sensitivities: Path | None,
    sensitivities_of: str,
    columns: str | None,
    units: str | None,
    resume: bool,
    only: Only | None,
    expected: Path | None,
    yes: bool,
    isolate: bool,
    limits: Limits,
    executing: Executing,
    as_json: bool,
    kept: Path | None,
) -> None:
    """Compute dJ/dp by each route on each problem; measure its cost and its error.

    Every case (one route on one problem) runs in a process of its own. The routes on one problem are timed in turns,
    each sample followed by a sample of forward solves. A case that fails is a row that gives the reason. Rows are
    printed in the order of the command line.

    Exit code: 0 if every case is ok, skipped or failed as expected, 1 if a case failed, 2 for wrong usage, 130 if
    interrupted.
    """
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.expected import FILE
    from gradient_routes.bench.cases.partial import chosen
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.execution.describing import described
    from gradient_routes.bench.execution.isolation.signals import Interrupt, interruptible
    from gradient_routes.bench.execution.sweep import everything
    from gradient_routes.bench.execution.sweep import run as run_cases
    from gradient_routes.bench.store.claims import Claims
    from gradient_routes.bench.store.output_files import read_by
    from gradient_routes.bench.store.store import Store
    from gradient_routes.bench.studies.bill.done import Done
    from gradient_routes.bench.studies.bill.files import COLUMNS_OF, Files
    from gradient_routes.bench.studies.bill.sensitivity_files import wanted as columns_wanted

    named = columns if columns and re.search("[:=]", columns) else None
    problems, columns = (*reading(problems, columns=named, units=units),), None if named else columns
    partial = chosen(components, directions, seed)
    how = executing(isolate, limits, timed)
    told = described(problems, routes, limits) if isolate else case.NOTHING
    most = math.inf if yes else case.MOST
    problem_specs, route_specs = case.problems(problems, told, most), case.routes(routes, told, most)
    files = Files(None if gradient in (None, SHOWN) else Path(gradient), vtu, sensitivities)
    count = len(problem_specs) * len(route_specs)
    case.check_count(count, "cases", most)
    read = read_by(*problems, *routes, at, expected, kept and kept.parent / FILE)
    files.check(len(problem_specs), route_specs, partial, [*([kept] if kept else []), *read])
    if sensitivities is None:
        refuse_given(("sensitivities_of",), "is of --sensitivities")
        if columns is not None and (vtu is None or route_specs[0].name != COLUMNS_OF):
            refuse_given(("columns",), f"is of --sensitivities, and of --vtu with --route {COLUMNS_OF}")
    for left_out in case.left_out(problems, routes):
        complain(f"left out of 'all': {left_out}")
    du_dp = columns_wanted(sensitivities, sensitivities_of, columns, files.fields)
    settings = Settings(at, budget, min_time, timed, gradient is not None, solver, partial, files.fields, du_dp)
    store = None if kept is None else Store(kept)
    known = _expectations(expected, kept)
    if store is not None:
        store.check_writable()
    wanted = _wanted(store, resume, only, known)
    claims = None if store is None or wanted is everything else Claims(store)
    outcomes = run_cases(problem_specs, route_specs, settings, how, wanted, claims)
    done = Done(store, as_json, known, views=gradient is not None or files.fields)
    interruptible()  # SIGTERM acts like Ctrl-C
    try:
        with closing(outcomes):  # an interrupt ends cases under way first
            for outcome in with_progress(outcomes, count):
                with Interrupt() as interrupt:  # held back until the row is stored
                    done.take(outcome)
                interrupt.heard()
    except KeyboardInterrupt:
        raise KeyboardInterrupt("" if store is None else f"; go on with: {_resumed()}") from None
    finally:  # after an interrupt, too
        done.close(gradients=gradient == SHOWN)
        said, failed = files.write(done.ordered)
        for line in said:
            echo(line, err=as_json)
        failed += done.failed
        if failed:
            complain("; ".join(failed))
    if resume or only:
        complain(f"{done.count} of {count} cases run, the others left as they are")
    if failed:
        raise click.exceptions.Exit(1)
    if debugging():
        echo("".join(outcome.row["traceback"] or "" for outcome in done.outcomes), err=True, nl=False)
    if done.failures:
        raise click.exceptions.Exit(1)


def _expectations(named: Path | None, kept: Path | None) -> tuple[Expectation, ...]:
    from gradient_routes.bench.cases.expected import beside, read

    if named is not None:
        return read(named)
    return () if kept is None else beside(kept)


def _wanted(
    store: Store | None, resume: bool, only: Only | None, known: Sequence[Expectation]
) -> Callable[[Row], bool]:
    from gradient_routes.bench.cases.expected import as_expected
    from gradient_routes.bench.execution.sweep import everything
    from gradient_routes.bench.store.resume import OPEN, add_kept_apart, still_open

    if store is None:
        refuse_given(("resume", "only"), "looks into a store, with --no-store there is none")
    if store is None or only == "all" or not (resume or only):
        return everything
    for line in add_kept_apart(store):
        complain(line)
    return still_open(store, OPEN if only is None else (only,), lambda row: as_expected(row, known))


def _resumed() -> str:
    """This command with --resume."""
    given = [word for word in sys.argv[1:] if word != "--resume"]
    return shlex.join(["routes", *given, "--resume"])


def with_progress(outcomes: Iterator[Outcome], count: int) -> Iterator[Outcome]:
    """Show a progress bar for more than one case, if the output is a terminal."""
    if count < 2 or not (sys.stderr.isatty() and sys.stdout.isatty()):
        yield from outcomes
        return
    from rich.progress import track

    from gradient_routes.bench.render.terminal.tables import console

    yield from track(outcomes, "cases", total=count, console=console(stderr=True), transient=True)
