"""`routes unrolling`: error and tape of unrolled AD against the number of iterations."""

from __future__ import annotations

from pathlib import Path

import click

from gradient_routes.bench.command_options import at_option, checked, debug_option, store_options
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

INNER = "The iteration on the tape. [that of the route]"
CHECKPOINT = "Beside that, keep every so-manieth iterate only."
WITHIN = "Errors of implicit-ad that the gradient may have to have met it."


@click.command()
@problem_option
@at_option
@click.option("--inner", type=click.Choice(["cg", "richardson", "jacobi", "direct"]), help=INNER)
@click.option("--checkpoint", type=int, metavar="C", help=CHECKPOINT)
@click.option("--max-iterations", type=int, default=4096, show_default=True, help="Where k ends.")
@click.option("--within", type=float, default=10.0, show_default=True, help=WITHIN)
@budget_option
@no_plot_option
@json_option
@store_options
@confined()
@debug_option
def unrolling(
    selector: str,
    at: str,
    inner: str | None,
    checkpoint: int | None,
    max_iterations: int,
    within: float,
    budget: float,
    no_plot: bool,
    as_json: bool,
    kept: Path | None,
) -> None:
    """What unrolled AD takes to be right: errors of J and its gradient, and bytes of tape, against k iterations.

    k doubles until the gradient meets that of implicit-ad; the tape is fitted by a line. Errors of 2e-13 are rounding.

    Exit code: 0 measured, 1 the problem cannot be solved, 2 wrong usage, 130 interrupted, nothing kept.
    """
    from gradient_routes.bench.studies.unrolling import measure as study
    from gradient_routes.bench.studies.unrolling import view

    problem = one_problem(selector)
    writable(kept)
    started = now()
    done = study.unrolling(problem, at, inner, checkpoint, max_iterations, within, checked(budget))
    if as_json:
        echo_json(done.tables)
    else:
        view.show(done.tables["unrolling"], done.tables["unrolling_fits"], plotted=not no_plot)
    keep(kept, done.tables, started, quiet=as_json)
