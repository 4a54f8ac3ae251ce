"""The command line. Every verb calls a study and a view; nothing heavy is imported before it is needed."""

from __future__ import annotations

import io
import os
import sys
import traceback
from pathlib import Path
from typing import Any, NoReturn

import click

from gradient_routes.bench.cases import registry
from gradient_routes.bench.command_options import complain, debug_option, debugging, store_option
from gradient_routes.bench.commands.compare import baseline, compare
from gradient_routes.bench.commands.report import report
from gradient_routes.bench.commands.status import status
from gradient_routes.bench.studies.command import command_of
from gradient_routes.problems.errors import DomainError, InputError, RoutesError

FAILED, WRONG_USAGE, INTERRUPTED = 1, 2, 130
READING = ("compare", "baseline", "status", "report", "export")  # verbs that fail by what they are given only
KEEPING = ("run", "tolerance", "scaling", "invert")  # verbs that an interrupt does not rob of what they have


class Routes(click.Group):
    """Turns errors into one line and an exit code; --debug lets the traceback through.

    A verb ends with an exit code by click's Exit: a SystemExit is of the code that it runs.
    """

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
        except KeyboardInterrupt as interrupt:
            hint = " ".join(map(str, interrupt.args))
            if not (isinstance(ctx.obj, Inside) and ctx.obj.expired):
                complain(f"interrupted - {FINISHED if ctx.invoked_subcommand in KEEPING else 'nothing is kept'}{hint}")
            leave(INTERRUPTED)
        except (BrokenPipeError, click.ClickException, click.exceptions.Exit, click.exceptions.Abort):
            raise  # click ends, quietly where whoever read has read enough
        except OSError as error:
            if debugging():
                traceback.print_exc()
            complain(f"{error.strerror or error} - check where the output goes")
            ctx.exit(WRONG_USAGE)
        except (Exception, SystemExit) as failure:  # what code of others may leave by
            from gradient_routes.bench.cases.status import one_line, status_of

            if debugging():
                traceback.print_exc()
            if isinstance(ctx.obj, Inside) and status_of(failure) == "out-of-memory":
                raise  # the process that watches this one says and keeps it
            complain(f"{ctx.invoked_subcommand}: {one_line(failure)} - see --debug")
            ctx.exit(WRONG_USAGE if ctx.invoked_subcommand in READING else FAILED)


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


for _study in registry.studies().values():
    main.add_command(command_of(_study))
main.add_command(status)


@main.command("list")
@click.argument("what", required=False, type=click.Choice(["problems", "routes"]))
@debug_option
def list_(what: str | None) -> None:
    """What exists: problems, routes, their options with defaults, plug-ins that cannot be imported."""
    from gradient_routes.bench.commands.listing import listing
    from gradient_routes.bench.render.terminal.tables import console

    out = console()
    if what != "routes":
        out.print(listing("problem"))
    if what != "problems":
        out.print(listing("route"))


@main.command()
@click.option("--table", default="cases", show_default=True, help="One of those that results/README.md describes.")
@click.option("--format", type=click.Choice(["csv", "parquet", "json"]), help="[that of FILE's name, else csv]")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write [stdout].")
@store_option
@debug_option
def export(table: str, format: str | None, output: Path | None, store: Path) -> None:
    """Tables of the store as CSV, Parquet or JSON (one array of row objects)."""
    from gradient_routes.bench.store.export import export as write
    from gradient_routes.bench.store.store import Store

    named = output.suffix.lstrip(".") if output is not None else ""
    write(Store(store), table, format or (named if named in ("parquet", "json") else "csv"), output)


main.add_command(report)
main.add_command(compare)
main.add_command(baseline)
