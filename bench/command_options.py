"""What verbs share: options, one-line complaints, a store that may be full."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from gradient_routes.bench.sanitize import plain
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.routes.newton import Newton, Solver
    from gradient_routes.routes.solvers.factorization import LinearSolver

STORE = Path("results") / "routes.sqlite"
SELECTOR = "NAME, 'NAME[key=value,key=a|b]' (quoted: the shell has its own use for [ and |) or all; repeatable."
AT = "The p to differentiate at; a file has a header line and n_p values in one column."
LINEAR_SOLVERS = ["auto", "pardiso", "superlu", "cg-amg", "krylov", "descent"]
NEWTONS = ["full", "inexact"]
ITERATIVE = "krylov and descent iterate, on systems of any kind, until --rtol is met."
NEWTON = "Factors at every Newton step, or kept and iterated with."

store_option = click.option(
    "--store", type=click.Path(path_type=Path), default=STORE, show_default=True, help="SQLite file that keeps results."
)
no_store_option = click.option("--no-store", is_flag=True, help="Keep nothing.")
debug_option = click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks.")
at_option = click.option("--at", default="start", show_default=True, metavar="start|true|FILE.csv", help=AT)
rtol_option = click.option(
    "--rtol", type=float, default=1e-12, show_default=True, help="Forward solve: |R| relative to its start."
)
max_steps_option = click.option(
    "--max-steps", type=int, default=50, show_default=True, help="Forward solve: Newton steps at most."
)
linear_solver_option = click.option(
    "--linear-solver", type=click.Choice(LINEAR_SOLVERS), default="auto", show_default=True, help=ITERATIVE
)
newton_option = click.option("--newton", type=click.Choice(NEWTONS), default="full", show_default=True, help=NEWTON)


Command = Callable[..., Any]


def solver_options(command: Command) -> Command:
    """Options of the forward solve; the command gets them as one `solver`. Raises InputError."""

    @wraps(command)
    def with_solver(*, rtol: float, max_steps: int, linear_solver: LinearSolver, newton: Newton, **others: Any) -> Any:
        return command(solver=solver_of(rtol, max_steps, linear_solver, newton), **others)

    return rtol_option(max_steps_option(linear_solver_option(newton_option(with_solver))))


def solver_of(
    rtol: float = 1e-12, max_steps: int = 50, linear_solver: LinearSolver = "auto", newton: Newton = "full"
) -> Solver:
    """The forward solve that these options ask for. Raises InputError."""
    from gradient_routes.routes.newton import Solver

    if not 0 < rtol < 1 or max_steps < 1:
        raise InputError(f"--rtol {rtol:g} --max-steps {max_steps} - give 0 < rtol < 1 and at least one step")
    for what, given, known in (("linear-solver", linear_solver, LINEAR_SOLVERS), ("newton", newton, NEWTONS)):
        if given not in known:
            raise InputError(f"--{what} {given} - choose from {', '.join(known)}")
    return Solver(rtol, max_steps, linear_solver, newton)


def store_options(command: Command) -> Command:
    """--store and --no-store; the command gets the file, or None, as `kept`."""

    @wraps(command)
    def with_store(*, store: Path, no_store: bool, **others: Any) -> Any:
        return command(kept=None if no_store else store, **others)

    return store_option(no_store_option(with_store))


def refuse_given(names: Iterable[str], why: str) -> None:
    """Options that would be ignored. Raises InputError for the first that was given."""
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise InputError(f"--{name.replace('_', '-')}: {why} - leave it out")


def checked(budget: float) -> float:
    """A budget in seconds. Raises InputError."""
    if not budget > 0:
        raise InputError(f"--budget {budget:g} - give seconds > 0, or inf")
    return budget


def complain(what: str) -> None:
    """One line on stderr, whatever a name in it holds."""
    click.echo(f"routes: {plain(' '.join(what.split()))}", err=True)


def debugging() -> bool:
    """Asked before options are parsed, too: an error in them is one to debug."""
    return "--debug" in sys.argv
