"""`routes invert`: J minimized, with any route as the engine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import (
    SELECTOR,
    at_option,
    debug_option,
    refuse_given,
    solver_options,
    store_options,
)
from gradient_routes.bench.execution.limited import confined
from gradient_routes.bench.studies.study import (
    echo_json,
    json_option,
    keep,
    no_plot_option,
    one_problem,
    problem_option,
    writable,
)
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.inversion.optimizers import Name
    from gradient_routes.bench.inversion.variables import Positive
    from gradient_routes.routes.newton import Solver

POSITIVES = ["none", "log", "softplus"]
OPTIMIZERS = ["lbfgs", "gauss-newton", "levenberg-marquardt", "trust", "descent", "adam"]
OPTIMIZER = "gauss-newton, levenberg-marquardt and trust use d(S u)/dp; descent: to watch; adam: for --minibatch."
TOLERANCE = "End where |dJ/dp| is so much of that where the run begins."
POSITIVE = "What keeps a raw parameter > 0: varied is its logarithm, or softplus's argument."
ALPHA_SWEEP = "J minimized at COUNT weights of Phi from LEAST to MOST: the L-curve."
DRAWS = "The same for so many draws of the noise: bias and variance against alpha."
MINIBATCH = "Gradients of so many load cases at a time, drawn at random, for adam."
RATE = "Of adam's steps, in natural changes of p."
RESUME = "From where the last run of the same (problem, route, optimizer, start) in the store ended."


@click.command()
@problem_option
@click.option("--route", "routes", multiple=True, default=["adjoint"], metavar="SELECTOR", help=f"{SELECTOR} [adjoint]")
@at_option
@click.option("--optimizer", type=click.Choice(OPTIMIZERS), default="lbfgs", show_default=True, help=OPTIMIZER)
@click.option("--iterations", type=int, default=200, show_default=True, help="At most.")
@click.option("--tolerance", type=float, default=1e-8, show_default=True, help=TOLERANCE)
@click.option("--positive", type=click.Choice(POSITIVES), default="none", show_default=True, help=POSITIVE)
@click.option("--alpha-sweep", type=(float, float, int), metavar="LEAST MOST COUNT", help=ALPHA_SWEEP)
@click.option("--draws", type=int, metavar="N", help=DRAWS)
@click.option("--minibatch", type=int, metavar="K", help=MINIBATCH)
@click.option("--rate", type=float, default=0.1, show_default=True, help=RATE)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the minibatches.")
@click.option("--resume", is_flag=True, help=RESUME)
@solver_options
@no_plot_option
@json_option
@store_options
@confined(keeps=True)
@debug_option
def invert(
    selector: str,
    routes: tuple[str, ...],
    at: str,
    optimizer: Name,
    iterations: int,
    tolerance: float,
    positive: Positive,
    alpha_sweep: tuple[float, float, int] | None,
    draws: int | None,
    minibatch: int | None,
    rate: float,
    seed: int,
    resume: bool,
    solver: Solver,
    no_plot: bool,
    as_json: bool,
    kept: Path | None,
) -> None:
    """Minimize J(p) = 1/2 |S u(p) - d|^2 + alpha Phi(p): from gradients to answers.

    Every accepted step is shown as it is taken, with the solves paid so far; with several routes, what each pays to
    reach a misfit. A line search that comes back says whether J or its gradient is to blame.

    \b
    routes invert --problem bar                                          five moduli of eight, to rounding
    routes invert --problem 'bar[noise=1e-3]' --alpha-sweep 1e-8 1 9     how much regularization
    routes invert --problem bar --route adjoint --route fd-central       the same answer, two bills

    Exit code: 0 ended (converged or not, the last line says which), 1 J cannot be had at the start, or --timeout is
    over, 2 wrong usage, 130 interrupted. What was found by then is shown and kept.
    """
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.inversion.invert import Engine
    from gradient_routes.bench.inversion.optimizers import Limits
    from gradient_routes.bench.studies.invert.inverting import Run

    _check(iterations, tolerance, rate, draws, alpha_sweep, minibatch, optimizer)
    if optimizer != "adam":
        refuse_given(("rate",), "is of --optimizer adam, the others find their steps")
    if minibatch is None:
        refuse_given(("seed",), "is of --minibatch")
    spec, specs = one_problem(selector), case.routes(routes)
    writable(kept)
    engine = Engine(optimizer, Limits(iterations, tolerance, rate), solver, positive)
    run = Run(spec, specs, engine, at, quiet=as_json, plots=not no_plot)
    if alpha_sweep is not None:
        refuse_given(("resume", "minibatch"), "is of a single inversion, not of an --alpha-sweep")
        tables = run.sweep(alpha_sweep, draws)
    else:
        tables = run.each(_resumed(kept) if resume else None, minibatch, seed)
    if as_json:
        echo_json(tables)
    keep(kept, tables, run.started, quiet=as_json)
    if run.failure is not None:
        raise run.failure
    if run.interrupted:
        raise KeyboardInterrupt


def _check(
    iterations: int,
    tolerance: float,
    rate: float,
    draws: int | None,
    alpha_sweep: tuple[float, float, int] | None,
    minibatch: int | None,
    optimizer: str,
) -> None:
    """Raises InputError."""
    if iterations < 1 or not 0.0 <= tolerance < 1.0 or not 0.0 < rate < float("inf"):
        raise InputError(
            f"--iterations {iterations} --tolerance {tolerance:g} --rate {rate:g} - give at least one iteration, a"
            " tolerance below 1 and a rate > 0"
        )
    if draws is not None and (draws < 2 or alpha_sweep is None):
        raise InputError(f"--draws {draws} - give at least 2, and --alpha-sweep")
    if alpha_sweep is not None and not (0.0 < alpha_sweep[0] < alpha_sweep[1] < float("inf") and alpha_sweep[2] >= 2):
        raise InputError(
            f"--alpha-sweep {alpha_sweep[0]:g} {alpha_sweep[1]:g} {alpha_sweep[2]} - give 0 < LEAST < MOST, COUNT >= 2"
        )
    if minibatch is not None and (optimizer != "adam" or minibatch < 1):
        raise InputError(
            f"--minibatch {minibatch} - give at least 1, and --optimizer adam: a line search needs all of J"
        )


def _resumed(kept: Path | None) -> Path:
    """Raises InputError where there is no store to look into."""
    if kept is None:
        raise InputError("--resume: looks into a store, with --no-store there is none - leave one of them out")
    return kept
