"""`routes tolerance`: gradient error against the tolerance of the solves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from gradient_routes.bench.command_options import (
    LINEAR_SOLVERS,
    SELECTOR,
    at_option,
    checked,
    complain,
    debug_option,
    store_options,
)
from gradient_routes.bench.execution.limited import confined
from gradient_routes.bench.studies.study import (
    budget_option,
    echo_json,
    json_option,
    keep,
    no_plot_option,
    one_problem,
    problem_option,
    writable,
)
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.studies.tolerance.measure import Sweep

Swept = Literal["forward", "adjoint", "both"]
SWEEP = "Which tolerance varies. [both; forward where --adjoint-rtol is given]"
RTOL = "Forward tolerance while the adjoint's is swept. [1e-12]"
ADJOINT_RTOL = "Tolerance of linearized and adjoint solves while the forward one is swept. [the same]"
SOLVER = "[direct on nonlinear problems; krylov on linear ones, on few unknowns descent]"
TIGHT = 1e-12


@click.command()
@problem_option
@click.option("--route", "routes", multiple=True, default=["all"], metavar="SELECTOR", help=f"{SELECTOR} [all]")
@at_option
@click.option("--loosest", type=float, default=1e-1, show_default=True, help="Tolerance to begin with.")
@click.option("--tightest", type=float, default=1e-14, show_default=True, help="Tolerance to end with.")
@click.option("--per-decade", type=int, default=1, show_default=True, help="Tolerances a decade.")
@click.option("--sweep", type=click.Choice(["forward", "adjoint", "both"]), help=SWEEP)
@click.option("--rtol", type=float, help=RTOL)
@click.option("--adjoint-rtol", type=float, help=ADJOINT_RTOL)
@click.option("--linear-solver", type=click.Choice(LINEAR_SOLVERS), help=SOLVER)
@budget_option
@no_plot_option
@json_option
@store_options
@confined(keeps=True)
@debug_option
def tolerance(
    selector: str,
    routes: tuple[str, ...],
    at: str,
    loosest: float,
    tightest: float,
    per_decade: int,
    sweep: Swept | None,
    rtol: float | None,
    adjoint_rtol: float | None,
    linear_solver: str | None,
    budget: float,
    no_plot: bool,
    as_json: bool,
    kept: Path | None,
) -> None:
    """How wrong a gradient is where the solves are loose: every route at every tolerance, achieved residuals beside.

    Finite differences differentiate the solver's noise, the adjoint relies on an identity that a loose solve violates,
    unrolled AD differentiates another iterate.

    Exit code: 0 measured (a tolerance that is not met is a row that says so), 1 the problem cannot be solved at all,
    or --timeout is over, 2 wrong usage, 130 interrupted. What was measured by then is shown and kept.
    """
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.studies.tolerance import measure as study
    from gradient_routes.bench.studies.tolerance import view

    problem, specs = one_problem(selector), case.routes(routes)
    tolerances = swept(study.decades(loosest, tightest, per_decade), sweep, rtol, adjoint_rtol)
    writable(kept)
    started = now()
    for left_out in case.left_out([], routes):
        complain(f"left out of 'all': {left_out}")
    done = study.tolerance(problem, specs, tolerances, at, linear_solver, checked(budget))
    tables = {"tolerance": done.rows}
    if as_json:
        echo_json(tables)
    else:
        view.show(done.rows, plotted=not no_plot, jumps=done.jumps)
    keep(kept, tables, started, quiet=as_json)
    if done.interrupted:
        raise KeyboardInterrupt


def swept(tolerances: tuple[float, ...], sweep: Swept | None, rtol: float | None, adjoint_rtol: float | None) -> Sweep:
    """Which tolerance varies and where the other stays. Raises InputError."""
    from gradient_routes.bench.studies.tolerance.measure import Sweep

    for name, value in (("--rtol", rtol), ("--adjoint-rtol", adjoint_rtol)):
        if value is not None and not 0.0 < value < 1.0:
            raise InputError(f"{name} {value:g} - give a tolerance between 0 and 1")
    sweep = sweep or ("both" if adjoint_rtol is None else "forward")
    if rtol is not None and sweep != "adjoint":
        raise InputError(f"--rtol {rtol:g} with the forward tolerance swept - add --sweep adjoint or drop it")
    if adjoint_rtol is not None and sweep != "forward":
        raise InputError(f"--adjoint-rtol {adjoint_rtol:g} with the adjoint's swept - take --sweep forward or drop it")
    return Sweep(
        tolerances,
        forward=(rtol or TIGHT) if sweep == "adjoint" else None,
        adjoint=(adjoint_rtol or TIGHT) if sweep == "forward" else None,
    )
