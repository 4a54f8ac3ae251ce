"""`routes run`: gradients by every route named on every problem named, what they cost and how wrong they are."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

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
from gradient_routes.bench.execution.options import executor_options, limit_options
from gradient_routes.problems.errors import InputError

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
GRADIENT = "Show the gradient parameter by parameter beside its reference; with a file, write that as CSV instead."
COMPONENTS = "Only so many components of dJ/dp, drawn at random: the bill of each, and its error."
DIRECTIONS = "Only the slopes of J along so many random directions."
VTU = "Write u, lambda and dJ/dp on the mesh, for ParaView; for one problem and one route."
SENSITIVITIES = "Write du/dp as FILE.csv, FILE.npz or FILE.vtu; for one problem and --route tangent."
OF = "Of the state, du/dp, or of the data, d(S u)/dp."
COLUMNS = "Parameters whose columns of du/dp are written, also to --vtu: 1,5-8. [all; none to --vtu]"
BUDGET = "Skip gradients predicted to take more seconds, or more memory than there is; inf forces them."
TIMING = "Without, gradients are computed and judged, their work counted and memory read, but not timed."
RESUME = "Only cases that the store lacks, that failed, or whose code, data or libraries have changed."
EXPECTED = "Failures that are known, with their reasons. [expected.toml beside the store]"
ONLY = "The same for cases of one kind; all: each again."


@click.command()
@click.option("--problem", "problems", multiple=True, required=True, metavar="SELECTOR", help=SELECTOR)
@click.option("--route", "routes", multiple=True, required=True, metavar="SELECTOR", help=SELECTOR)
@at_option
@click.option("--budget", type=float, default=60.0, show_default=True, help=BUDGET)
@click.option("--min-time", type=float, default=0.1, show_default=True, help="Seconds of steady calls to time.")
@click.option("--timing/--no-timing", "timed", default=True, show_default=True, help=TIMING)
@solver_options
@click.option("--components", type=int, metavar="M", help=COMPONENTS)
@click.option("--directions", type=int, metavar="M", help=DIRECTIONS)
@click.option("--seed", type=int, default=0, show_default=True, help="Of --components and --directions.")
@click.option("--gradient", is_flag=False, flag_value=SHOWN, metavar="[FILE.csv]", help=GRADIENT)
@click.option("--vtu", type=click.Path(path_type=Path), metavar="FILE.vtu", help=VTU)
@click.option("--sensitivities", type=click.Path(path_type=Path), metavar="FILE", help=SENSITIVITIES)
@click.option("--sensitivities-of", type=click.Choice(["state", "data"]), default="state", show_default=True, help=OF)
@click.option("--columns", metavar="LIST", help=COLUMNS)
@click.option("--resume", is_flag=True, help=RESUME)
@click.option("--only", type=click.Choice(["missing", "failed", "stale", "all"]), help=ONLY)
@click.option("--expected", type=click.Path(path_type=Path), metavar="FILE.toml", help=EXPECTED)
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
    resume: bool,
    only: Only | None,
    expected: Path | None,
    isolate: bool,
    limits: Limits,
    executing: Executing,
    as_json: bool,
    kept: Path | None,
) -> None:
    """Compute dJ/dp by every route named, on every problem named; say what it cost and how wrong it is.

    Every case runs in a process of its own; the routes on one problem are timed in turn, a forward solve beside every
    sample. What goes wrong is a row with its reason.

    Exit code: 0 all ok, skipped or failed as expected, 1 a case failed (its row says why), 2 wrong usage,
    130 interrupted.
    """
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.partial import chosen
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.execution.isolation.signals import Interrupt, interruptible
    from gradient_routes.bench.execution.sweep import run as run_cases
    from gradient_routes.bench.store.store import Store
    from gradient_routes.bench.studies.bill.files import COLUMNS_OF, Files
    from gradient_routes.bench.studies.bill.sensitivity_files import wanted as columns_wanted

    if not 0 <= min_time < float("inf"):
        raise InputError(f"--min-time {min_time:g} - give seconds >= 0")
    partial = chosen(components, directions, seed)
    how = executing(isolate, limits, timed)
    problem_specs, route_specs = case.problems(problems), case.routes(routes)
    files = Files(None if gradient in (None, SHOWN) else Path(gradient), vtu, sensitivities)
    count = len(problem_specs) * len(route_specs)
    files.check(len(problem_specs), route_specs, partial, [*([kept] if kept else []), *case.files(problem_specs, at)])
    if sensitivities is None:
        refuse_given(("sensitivities_of",), "is of --sensitivities")
        if vtu is None or route_specs[0].name != COLUMNS_OF:
            refuse_given(("columns",), f"is of --sensitivities, and of --vtu with --route {COLUMNS_OF}")
    for left_out in case.left_out(problems, routes):
        complain(f"left out of 'all': {left_out}")
    du_dp = columns_wanted(sensitivities, sensitivities_of, columns, files.fields)
    budget = checked(budget)
    settings = Settings(at, budget, min_time, timed, gradient is not None, solver, partial, files.fields, du_dp)
    store = None if kept is None else Store(kept)
    known = _expectations(expected, kept)
    wanted = _wanted(store, resume, only, known)
    if store is not None:
        store.check_writable()
    outcomes = run_cases(problem_specs, route_specs, settings, how, wanted)
    done = Done(store, as_json, known, views=gradient is not None or files.fields)
    interruptible()  # SIGTERM ends it like Ctrl-C: with a table
    try:
        with closing(outcomes):  # whatever interrupts, cases under way are ended first
            for outcome in with_progress(outcomes, count):
                with Interrupt() as interrupt:  # a row that is finished is kept whole
                    done.take(outcome)
                interrupt.heard()
    except KeyboardInterrupt:
        raise KeyboardInterrupt("" if store is None else f"; go on with: {_resumed()}") from None
    finally:  # an interrupt leaves what was measured on the screen, too
        done.show(gradients=gradient == SHOWN)
        said, failed = files.write(done.ordered)
        for line in said:
            click.echo(line, err=as_json)
    if resume or only:
        complain(f"{len(done.outcomes)} of {count} cases run, the others left as they are")
    if done.lost:
        failed.append(f"{len(done.lost)} of {len(done.outcomes)} rows were not kept: {done.lost[0]}")
    if failed:
        raise InputError("; ".join(failed))
    if debugging():
        click.echo("".join(outcome.row["traceback"] or "" for outcome in done.outcomes), err=True, nl=False)
    if done.failures:
        raise click.exceptions.Exit(1)


class Done:
    """Outcomes as they come: kept, printed, and what of them the end still needs."""

    def __init__(self, store: Store | None, as_json: bool, known: Sequence[Expectation], views: bool) -> None:
        self.store, self.as_json, self.known, self._views = store, as_json, known, views
        self.outcomes: list[Outcome] = []
        self.lost: list[str] = []
        self._waiting: dict[int, Row] = {}  # by their place: rows that come before the next to print
        self._next = 0

    def take(self, outcome: Outcome) -> None:
        """Keep a row at once; print it, as JSON, once all rows before it are printed."""
        try:
            if self.store is not None:
                self.store.append(outcome.row, outcome.samples, outcome.environment)
        except InputError as error:  # a full disk, a lock: the row is printed all the same
            self.lost.append(str(error))
        self._waiting[outcome.place] = outcome.row
        while self._next in self._waiting:
            self._print(self._next)
            self._next += 1
        slim = replace(outcome, row=outcome.row | {"gradient": None}, samples=None, environment=None)
        self.outcomes.append(slim if self._views else replace(slim, view=None, fields=None))

    def _print(self, place: int) -> None:
        from gradient_routes.bench.cases.row import as_json

        row = self._waiting.pop(place)
        if self.as_json:
            click.echo(as_json(row))

    def show(self, gradients: bool) -> None:
        """The table in the order asked for, and gradients where those were asked for; rows of JSON that still wait."""
        from gradient_routes.bench.studies.bill.view import show

        for place in sorted(self._waiting):
            self._print(place)
        if self.as_json:
            return
        views = [(o.row, o.view) for o in self.ordered if o.view is not None and gradients]
        kept = None if self.store is None or self.lost else self.store.path
        show([o.row for o in self.ordered], views, kept, self.known)

    @property
    def ordered(self) -> list[Outcome]:
        """The outcomes in the order asked for."""
        return sorted(self.outcomes, key=lambda outcome: outcome.place)

    @property
    def failures(self) -> list[Row]:
        """Those that nobody expected."""
        from gradient_routes.bench.cases.expected import as_expected
        from gradient_routes.bench.cases.row import ANSWERED

        rows = [o.row for o in self.outcomes if o.row["status"] not in ANSWERED]
        return [row for row in rows if not as_expected(row, self.known)]


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
    from gradient_routes.bench.store.resume import OPEN, still_open

    if store is None:
        refuse_given(("resume", "only"), "looks into a store, with --no-store there is none")
    if store is None or only == "all" or not (resume or only):
        return everything
    return still_open(store, OPEN if only is None else (only,), lambda row: as_expected(row, known))


def _resumed() -> str:
    """This command again, for what is left."""
    given = [word for word in sys.argv[1:] if word != "--resume"]
    return shlex.join(["routes", *given, "--resume"])


def with_progress(outcomes: Iterator[Outcome], count: int) -> Iterator[Outcome]:
    """A progress bar on a terminal for more than one case, nothing of the kind elsewhere."""
    if count < 2 or not (sys.stderr.isatty() and sys.stdout.isatty()):
        yield from outcomes
        return
    from rich.progress import track

    from gradient_routes.bench.render.terminal.tables import console

    yield from track(outcomes, "cases", total=count, console=console(stderr=True), transient=True)
