"""The group of all commands: errors become one line on stderr and an exit code."""

from __future__ import annotations

import io
import os
import sys
import traceback
from contextlib import suppress
from typing import Any, NoReturn

import click

from gradient_routes.bench.cases.folder import from_here
from gradient_routes.bench.command_options import FINISHED, complain, debugging
from gradient_routes.bench.commands.interrupts import catching, over
from gradient_routes.bench.sanitize import echo
from gradient_routes.problems.errors import DomainError, InputError, RoutesError

FAILED, WRONG_USAGE, INTERRUPTED = 1, 2, 130
READING = (
    "compare",
    "baseline",
    "status",
    "report",
    "export",
    "merge",
)  # commands that run no code of others: input is wrong


class Routes(click.Group):
    """Prints errors as one line, with --debug the traceback too.

    A command ends with an exit code by click's Exit: a SystemExit comes from the code that it runs.
    """

    def invoke(self, ctx: click.Context) -> Any:
        prepare_streams()
        try:
            catching()
            with from_here():
                return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            over()
            kept = FINISHED if ctx.invoked_subcommand == "run" else "nothing is kept"  # studies say so themselves
            complain(f"interrupted - {kept}{' '.join(map(str, interrupt.args))}")
            leave(INTERRUPTED)
        except click.UsageError as error:
            about = error.ctx.command_path if error.ctx else "routes"
            complain(f"{error.format_message()} - see {about} --help")
            ctx.exit(WRONG_USAGE)
        except click.ClickException as error:
            complain(error.format_message())
            ctx.exit(error.exit_code)
        except (BrokenPipeError, click.exceptions.Exit, click.exceptions.Abort):
            raise  # click ends the process, quietly where the reader of a pipe has gone
        except (Exception, SystemExit) as failure:
            command = ctx.invoked_subcommand
            if debugging():
                echo(traceback.format_exc(), err=True, nl=False)
            complain(said(failure, command))
            ctx.exit(code(failure, command))


def said(failure: BaseException, command: str | None) -> str:
    """An error in one line."""
    from gradient_routes.bench.cases.status import one_line

    if isinstance(failure, RoutesError):
        return str(failure)
    if isinstance(failure, OSError):
        return f"{failure.strerror or failure} - check where the output goes"
    return f"{command}: {one_line(failure)} - see --debug"


def code(failure: BaseException, command: str | None) -> int:
    """2 where what was given is wrong, 1 where what was run failed."""
    if isinstance(failure, RoutesError):
        return WRONG_USAGE if isinstance(failure, InputError | DomainError) else FAILED
    return WRONG_USAGE if command in READING and not isinstance(failure, OSError) else FAILED


def leave(code: int) -> NoReturn:
    """Exit at once: threads of XLA that compile cannot be waited for, and crash at an orderly exit; and Python ends
    itself by SIGINT where one came while it imported an extension.
    """
    if sys.stdout is sys.__stdout__:  # its own process
        for stream in filter(None, (sys.stdout, sys.stderr)):
            with suppress(OSError):
                stream.flush()
        os._exit(code)
    sys.exit(code)


def prepare_streams() -> None:
    """A closed stream discards what is written; a character that the terminal cannot show is escaped."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
