"""The command line. Every verb calls a study and a view; nothing heavy is imported before it is needed."""

from __future__ import annotations

import io
import os
import signal
import sys
import traceback
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from bench.commands.check import check
from bench.commands.compare import baseline, compare
from bench.commands.kink import kink
from bench.commands.shared import (
    SELECTOR,
    at_option,
    checked,
    complain,
    debug_option,
    debugging,
    solver_options,
    store_option,
    store_options,
)
from bench.commands.tolerance import tolerance
from bench.commands.unrolling import unrolling
from bench.commands.vcurve import vcurve
from problems.errors import DomainError, InputError, RoutesError

if TYPE_CHECKING:
    from bench.rows import Row
    from bench.runner import Outcome, View
    from routes.newton import Solver

FAILED, WRONG_USAGE, INTERRUPTED = 1, 2, 130
KEEPING = ("run", "tolerance")  # verbs that an interrupt does not rob of what they have
SHOWN = "-"  # --gradient without a file


class Routes(click.Group):
    """Turns errors into one line and an exit code; --debug lets the traceback through."""

    def invoke(self, ctx: click.Context) -> Any:
        mend_streams()
        try:
            return super().invoke(ctx)
        except RoutesError as error:
            if debugging():
                traceback.print_exc()
            complain(str(error))
            ctx.exit(WRONG_USAGE if isinstance(error, InputError | DomainError) else FAILED)
        except click.UsageError as error:
            about = error.ctx.command_path if error.ctx else "routes"
            complain(f"{error.format_message()} - see {about} --help")
            ctx.exit(WRONG_USAGE)
        except KeyboardInterrupt:
            what = "what is finished is printed, and kept unless --no-store"
            complain(f"interrupted - {what if ctx.invoked_subcommand in KEEPING else 'nothing is kept'}")
            leave(INTERRUPTED)
        except BrokenPipeError:
            raise  # click ends quietly: whoever read has read enough
        except OSError as error:
            if debugging():
                traceback.print_exc()
            complain(f"{error.strerror or error} - check where the output goes")
            ctx.exit(WRONG_USAGE)


def leave(code: int) -> NoReturn:
    """Exit at once: what XLA's threads are compiling cannot be waited for, and crashes where it is torn down."""
    own_process = sys.stdout is sys.__stdout__
    if own_process and "jax" in sys.modules:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


def mend_streams() -> None:
    """A closed stream swallows what is written; a character the terminal cannot show is escaped."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@click.group(cls=Routes, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="gradient-routes", prog_name="routes")
def main() -> None:
    """Gradients of PDE-constrained objectives: every route to dJ/dp, what it costs and how wrong it is.

    \b
    routes list                                   what exists, with all options
    routes run --problem bar --route adjoint      one gradient, its bill and its error
    routes run --problem 'bar[n=8|64]' --route all
    routes vcurve --problem bar --route adjoint   is it right? differences at every step, and a verdict
    routes check my_model.py:Model                the same for anyone's code
    """


main.add_command(vcurve)
main.add_command(check)
main.add_command(kink)


@main.command("list")
@click.argument("what", required=False, type=click.Choice(["problems", "routes"]))
@debug_option
def list_(what: str | None) -> None:
    """What exists: problems, routes, their options with defaults, plug-ins that cannot be imported."""
    from bench.views.listing import listing
    from bench.views.tables import console

    out = console()
    if what != "routes":
        out.print(listing("problem"))
    if what != "problems":
        out.print(listing("route"))


GRADIENT = "Show the gradient parameter by parameter beside its reference; with a file, write that as CSV instead."
COMPONENTS = "Only so many components of dJ/dp, drawn at random: the bill of each, and its error."
DIRECTIONS = "Only the slopes of J along so many random directions."
VTU = "Write u, lambda and dJ/dp on the mesh, for ParaView; for one problem and one route."
BUDGET = "Skip gradients predicted to take more seconds, or more memory than there is; inf forces them."


@main.command()
@click.option("--problem", "problems", multiple=True, required=True, metavar="SELECTOR", help=SELECTOR)
@click.option("--route", "routes", multiple=True, required=True, metavar="SELECTOR", help=SELECTOR)
@at_option
@click.option("--budget", type=float, default=60.0, show_default=True, help=BUDGET)
@click.option("--min-time", type=float, default=0.1, show_default=True, help="Seconds of steady calls to time.")
@solver_options
@click.option("--components", type=int, metavar="M", help=COMPONENTS)
@click.option("--directions", type=int, metavar="M", help=DIRECTIONS)
@click.option("--seed", type=int, default=0, show_default=True, help="Of --components and --directions.")
@click.option("--gradient", is_flag=False, flag_value=SHOWN, metavar="[FILE.csv]", help=GRADIENT)
@click.option("--vtu", type=click.Path(path_type=Path), metavar="FILE.vtu", help=VTU)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line and nothing else.")
@store_options
@debug_option
def run(
    problems: tuple[str, ...],
    routes: tuple[str, ...],
    at: str,
    budget: float,
    min_time: float,
    solver: Solver,
    components: int | None,
    directions: int | None,
    seed: int,
    gradient: str | None,
    vtu: Path | None,
    as_json: bool,
    kept: Path | None,
) -> None:
    """Compute dJ/dp by every route named, on every problem named; say what it cost and how wrong it is.

    Exit code: 0 all ok or skipped, 1 a case failed (its row says why), 2 wrong usage,
    130 interrupted.
    """
    from bench import case
    from bench.files import Files
    from bench.partial import chosen
    from bench.rows import as_json as json_line
    from bench.runner import Settings
    from bench.runner import run as run_cases
    from bench.store import Store

    if not 0 <= min_time < float("inf"):
        raise InputError(f"--min-time {min_time:g} - give seconds >= 0")
    partial = chosen(components, directions, seed)
    problem_specs, route_specs = case.problems(problems), case.routes(routes)
    files = Files(None if gradient in (None, SHOWN) else Path(gradient), vtu)
    files.check(
        len(problem_specs) * len(route_specs), partial, [*([kept] if kept else []), *case.files(problem_specs, at)]
    )
    for left_out in case.left_out(problems, routes):
        complain(f"left out of 'all': {left_out}")
    settings = Settings(at, checked(budget), min_time, gradient is not None, solver, partial, vtu is not None)
    outcomes = run_cases(problem_specs, route_specs, settings)
    store = None if kept is None else Store(kept)
    if store is not None:
        store.check_writable()
    done: list[Outcome] = []
    lost: list[str] = []
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends like Ctrl-C: with a table
    try:
        for outcome in with_progress(outcomes, len(problem_specs) * len(route_specs)):
            done.append(outcome)
            try:
                if store is not None:
                    store.append(outcome.row, outcome.samples)
            except InputError as error:  # a full disk, a lock: the row is printed all the same
                lost.append(str(error))
            if as_json:
                click.echo(json_line(outcome.row))
    finally:  # an interrupt leaves what was measured on the screen, too
        if not as_json:
            views = [(o.row, o.view) for o in done if o.view is not None and gradient == SHOWN]
            show([o.row for o in done], views, None if lost else kept)
        said, failed = files.write(done)
        for line in said:
            click.echo(line, err=as_json)
    if lost:
        failed.append(f"{len(lost)} of {len(done)} rows were not kept: {lost[0]}")
    if failed:
        raise InputError("; ".join(failed))
    if debugging():
        click.echo("".join(outcome.traceback or "" for outcome in done), err=True, nl=False)
    if any(outcome.row["status"] == "failed" for outcome in done):
        sys.exit(1)


def show(rows: list[Row], views: Iterable[tuple[Row, View]] = (), kept: Path | None = None) -> None:
    """The table, the reasons and notes below it, the gradients where they were asked for."""
    from bench.views import tables

    if not rows:
        return
    out = tables.console()
    tables.show(out, tables.results(rows))
    for line in tables.remarks(rows):
        out.print(line, soft_wrap=not out.is_terminal)
    if kept is not None:
        out.print(f"kept in {kept}", style="dim", soft_wrap=True)
    for row, view in views:
        out.print()
        tables.show(out, tables.gradient(row, view))


def with_progress(outcomes: Iterator[Outcome], count: int) -> Iterator[Outcome]:
    """A progress bar on a terminal for more than one case, nothing of the kind elsewhere."""
    if count < 2 or not (sys.stderr.isatty() and sys.stdout.isatty()):
        yield from outcomes
        return
    from rich.progress import track

    from bench.views.tables import console

    yield from track(outcomes, "cases", total=count, console=console(stderr=True), transient=True)


@main.command()
@click.option("--table", default="cases", show_default=True, help="One of those that results/README.md describes.")
@click.option("--format", type=click.Choice(["csv", "parquet", "json"]), help="[that of FILE's name, else csv]")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write [stdout].")
@store_option
@debug_option
def export(table: str, format: str | None, output: Path | None, store: Path) -> None:
    """Tables of the store as CSV, Parquet or JSON (one array of row objects)."""
    from bench.export import export as write
    from bench.store import Store

    named = output.suffix.lstrip(".") if output is not None else ""
    write(Store(store), table, format or (named if named in ("parquet", "json") else "csv"), output)


@main.command()
@store_option
@debug_option
def report(store: Path) -> None:
    """The tables of everything the store holds."""
    from bench.store import Store

    show(Store(store).rows())


main.add_command(tolerance)
main.add_command(unrolling)
main.add_command(compare)
main.add_command(baseline)
