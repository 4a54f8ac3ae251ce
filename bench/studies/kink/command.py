"""`routes kink`: what becomes of dJ/dp where the active set changes, or where its kink is rounded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import (
    SELECTOR,
    at_option,
    checked,
    complain,
    debug_option,
    solver_options,
    store_options,
)
from gradient_routes.bench.execution.limited import confined
from gradient_routes.bench.studies.check.options import built
from gradient_routes.bench.studies.study import keep, no_plot_option, one_problem, writable
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError, RoutesError

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import RouteSpec
    from gradient_routes.bench.studies.kink.event import Kink
    from gradient_routes.bench.studies.kink.rounding import Trade
    from gradient_routes.routes.newton import Solver

RANGE = "Least and largest common factor on all moduli."
BUDGET = "Skip routes whose gradients are predicted to take more seconds; inf forces them."


@click.command()
@click.option("--problem", required=True, metavar="SELECTOR", help="NAME, 'NAME[key=value]' or FILE.py:NAME.")
@click.option("--route", "routes", multiple=True, metavar="SELECTOR", help=f"{SELECTOR} [all]")
@at_option
@click.option("--range", "s_range", nargs=2, type=float, default=(0.25, 4.0), show_default=True, help=RANGE)
@click.option("--points", type=int, default=33, show_default=True, help="Factors in that range.")
@click.option("--budget", type=float, default=60.0, show_default=True, help=BUDGET)
@solver_options
@no_plot_option
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line and nothing else.")
@store_options
@confined()
@debug_option
def kink(
    problem: str,
    routes: tuple[str, ...],
    at: str,
    s_range: tuple[float, float],
    points: int,
    budget: float,
    solver: Solver,
    no_plot: bool,
    as_json: bool,
    kept: Path | None,
) -> None:
    """Sweep a common factor s on all moduli over the event where the active set changes; look at both sides of it.

    Finds s by bisection, shows dJ/ds by every route from the left and from the right, and what finite differences make
    of it. A stop whose law is rounded has no event: shows the sweep, and what its width costs and buys.

    \b
    routes kink --problem 'bar[stop=multiplier]'
    routes kink --problem 'bar[stop=softplus]' --route adjoint

    Exit code: 0 measured, 1 forward solves failed, 2 wrong usage, 130 interrupted, nothing kept.
    """
    import numpy as np

    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.row import as_json as json_line
    from gradient_routes.bench.studies.kink import measure as study
    from gradient_routes.bench.studies.kink.ray import Ray
    from gradient_routes.bench.studies.kink.rows import rows

    low, high = s_range
    if not 0 < low < high < float("inf"):
        raise InputError(f"--range {low:g} {high:g} - give two factors, 0 < least < largest")
    if points < 2:
        raise InputError(f"--points {points} - give at least 2")
    checked(budget)
    started, specs = now(), case.routes(routes or ["all"])
    for left_out in case.left_out([], routes or ["all"]):
        complain(f"left out of 'all': {left_out}")
    made, p = built(one_problem(problem), at)
    writable(kept)
    ray = Ray(made, p, solver)
    failure = None
    with np.errstate(all="ignore"):
        swept, traded = study.kink(ray, specs, np.geomspace(low, high, points).tolist(), budget), None
        try:
            traded = _traded(swept, specs if routes else case.routes(["adjoint"]), budget)
        except RoutesError as unsolved:
            failure = unsolved
    found = rows(swept, traded, {"problem": problem, "at": at})
    if as_json:
        for row in found:
            click.echo(json_line(row))
    else:
        _show(swept, traded, problem, not no_plot)
    keep(kept, {"kink": found}, started, quiet=as_json)
    if swept.rounded and not swept.failed and traded is None and failure is None:
        complain("kink: what the width costs is left out: no route runs for it - name another with --route")
    if failure is not None:
        complain(f"kink: what the stop's law costs is not known: {failure}")
    if swept.failed or failure is not None:
        raise click.exceptions.Exit(1)


def _traded(swept: Kink, specs: list[RouteSpec], budget: float) -> Trade | None:
    """What a stop that yields costs, by the first of the routes that runs, an exact one before others.

    None where there is no such stop or route, or nothing to compare. Raises what the solve of exact contact raises.
    """
    from gradient_routes.bench.studies.kink.measure import why_not
    from gradient_routes.bench.studies.kink.rounding import GRADIENTS, trade, yielding

    ray, stop = swept.ray, yielding(swept.ray.problem)
    if stop is None or swept.failed or (swept.event is None and not swept.rounded):
        return None
    for spec in sorted(specs, key=lambda spec: spec.route.accuracy > 0.0):
        if why_not(ray, spec, 1.0, GRADIENTS, budget) is None:
            return trade(ray, stop, spec, swept.visits[0].s, swept.visits[-1].s)
    return None


def _show(swept: Kink, traded: Trade | None, problem: str, plots: bool) -> None:
    from gradient_routes.bench.render.terminal.tables import console
    from gradient_routes.bench.studies.kink.rounding_view import show_trade
    from gradient_routes.bench.studies.kink.view import show_kink

    out = console()
    show_kink(out, swept, problem, plots)
    if traded is not None:
        show_trade(out, traded, plots)
