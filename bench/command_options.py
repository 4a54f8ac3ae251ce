"""Options and error lines that several commands share."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from gradient_routes.bench.ranges import COUNT, FRACTION
from gradient_routes.bench.sanitize import echo, unread
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.solvers.registry import DEFAULT, points

if TYPE_CHECKING:
    from gradient_routes.routes.newton import Newton, Solver

STORE = Path("results") / "routes.sqlite"
FINISHED = "what is finished is printed, and kept unless --no-store"
SELECTOR = "NAME, 'NAME[key=value,key=a|b]' (in quotes: [ and | are special to shells) or all. May be repeated."
AT = (
    "Point p of the gradient. Values: all, 0.1,0,-0.3, or some by name, 'log E_1=0.1,log E_3=-0.3', others as at the"
    " start. A file has a header line and n_p values in one column, or names and values as invert -o, run --gradient"
    " and export --table estimates write them. What exists as a file is one."
)
LINEAR_SOLVERS = [*points()]
NEWTONS = ["auto", "full", "inexact"]
ITERATIVE = "Linear solver; krylov and descent are iterative, for any matrix, and stop at --rtol."
NEWTON = "Factorize at every Newton step, or keep the factors and iterate with them; auto: what costs less."

store_option = click.option(
    "--store", type=click.Path(path_type=Path), default=STORE, show_default=True, help="SQLite file of results."
)
no_store_option = click.option("--no-store", is_flag=True, help="Store nothing.")
debug_option = click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks of errors.")
at_option = click.option("--at", default="start", show_default=True, metavar="start|true|VALUES|FILE.csv", help=AT)
rtol_option = click.option(
    "--rtol",
    type=FRACTION,
    default=1e-12,
    show_default=True,
    help="Forward solve: |R| / |R(u_0, p)| to reach.",
)
max_steps_option = click.option(
    "--max-steps", type=COUNT, default=50, show_default=True, help="Forward solve: largest number of Newton steps."
)
linear_solver_option = click.option(
    "--linear-solver", type=click.Choice(LINEAR_SOLVERS), default=DEFAULT, show_default=True, help=ITERATIVE
)
newton_option = click.option("--newton", type=click.Choice(NEWTONS), default="auto", show_default=True, help=NEWTON)


Command = Callable[..., Any]


def routes_option(default: str, given: tuple[str, ...] | None = None) -> Callable[[Command], Command]:
    """--route, repeatable; `given` is its value where it is not on the command line."""
    values = [default] if given is None else list(given)
    text = f"{SELECTOR} [{default}]"
    return click.option("--route", "routes", multiple=True, default=values, metavar="SELECTOR", help=text)


def solver_options(command: Command) -> Command:
    """Options of the forward solve, passed to the command as one `solver`. Raises InputError."""

    @wraps(command)
    def with_solver(*, rtol: float, max_steps: int, linear_solver: str, newton: Newton, **others: Any) -> Any:
        return command(solver=solver_of(rtol, max_steps, linear_solver, newton), **others)

    return rtol_option(max_steps_option(linear_solver_option(newton_option(with_solver))))


def solver_of(rtol: float = 1e-12, max_steps: int = 50, linear_solver: str = "auto", newton: Newton = "auto") -> Solver:
    """The forward solve that these options ask for. Raises InputError."""
    from gradient_routes.routes.newton import Solver

    if not 0 < rtol < 1 or max_steps < 1:
        raise InputError(f"--rtol {rtol:g} --max-steps {max_steps} - give 0 < rtol < 1 and at least one step")
    for what, given, known in (("linear-solver", linear_solver, LINEAR_SOLVERS), ("newton", newton, NEWTONS)):
        if given not in known:
            raise InputError(f"--{what} {given} - choose from {', '.join(known)}")
    return Solver(rtol, max_steps, linear_solver, newton)


def store_options(command: Command) -> Command:
    """--store and --no-store, passed to the command as `kept`: the file or None."""

    @wraps(command)
    def with_store(*, store: Path, no_store: bool, **others: Any) -> Any:
        return command(kept=None if no_store else store, **others)

    return store_option(no_store_option(with_store))


def refuse_given(names: Iterable[str], why: str) -> None:
    """Raise InputError for the first of these options that was given: it would be ignored."""
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            option = next(o for o in context.command.params if o.name == name)
            raise InputError(f"{max(option.opts, key=len)}: {why} - leave it out")


def checked(budget: float) -> float:
    """The budget, if it is a positive number of seconds. Raises InputError."""
    if not budget > 0:
        raise InputError(f"--budget {budget:g} - give seconds > 0, or inf")
    return budget


def replaces(*suffixes: str) -> str:
    """What the help of an option says of the file that it names: see store/output_files.py."""
    return f"Replaces an earlier {' or '.join(suffixes)}, no other file."


def complain(what: str) -> None:
    """Print one line on stderr, without line breaks and control characters of names in it."""
    try:
        echo(f"routes: {' '.join(what.split())}", err=True)
    except OSError:  # nobody reads it
        unread(sys.stderr)


def debugging() -> bool:
    """Whether --debug is given; read from sys.argv, since errors in options come before they are parsed."""
    return "--debug" in sys.argv
