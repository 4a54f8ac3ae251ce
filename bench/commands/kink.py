"""`routes kink`: what becomes of dJ/dp where the active set changes, or where its kink is rounded."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bench.commands.shared import SELECTOR, at_option, checked, complain, debug_option, solver_options, store_options
from bench.commands.studying import keep, no_plot_option, now, one_problem, writable
from bench.commands.verdict import built
from problems.errors import InputError, NotConverged, SingularMatrix

if TYPE_CHECKING:
    from bench.case import RouteSpec
    from bench.studies.event import Kink
    from bench.studies.ray import Ray
    from bench.studies.rounding import Trade
    from routes.newton import Solver

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
    of it. A stop whose law is rounded has no event: shows what its width costs and buys instead.

    \b
    routes kink --problem 'bar[stop=multiplier]'
    routes kink --problem 'bar[stop=softplus]' --route adjoint

    Exit code: 0 measured, 1 forward solves failed, 2 wrong usage.
    """
    import numpy as np

    from bench import case
    from bench.rows import as_json as json_line
    from bench.studies.kink_rows import rows
    from bench.studies.ray import Ray

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
    try:
        with np.errstate(all="ignore"):
            swept, traded = _measured(ray, specs, bool(routes), np.geomspace(low, high, points).tolist(), budget)
    except (NotConverged, SingularMatrix) as failure:
        raise InputError(f"kink: {failure}") from failure
    found = rows(swept, traded, {"problem": problem, "at": at})
    if as_json:
        for row in found:
            click.echo(json_line(row))
    else:
        _show(swept, traded, problem, not no_plot)
    keep(kept, {"kink": found}, started, quiet=as_json)
    if swept is not None and swept.failed:
        sys.exit(1)


def _measured(
    ray: Ray, specs: list[RouteSpec], named: bool, s: list[float], budget: float
) -> tuple[Kink | None, Trade | None]:
    """The sweep where the law has a kink, the trade where a stop yields; the latter by one route."""
    from bench import case
    from bench.studies import kink
    from bench.studies.rounding import GRADIENTS, trade, width_of, yielding

    stop = yielding(ray.problem)
    swept = kink.kink(ray, specs, s, budget) if stop is None or width_of(stop) is None else None
    if stop is None or (swept is not None and swept.event is None):
        return swept, None
    reasons = []
    for spec in specs if named else case.routes(["adjoint"]):
        reason = kink.why_not(ray, spec, 1.0, GRADIENTS, budget)
        if reason is None:
            break
        reasons.append(reason)
    else:
        if swept is not None:
            return swept, None
        raise InputError(f"kink: {'; '.join(reasons)} - choose another route")
    return swept, trade(ray, stop, spec, s[0], s[-1])


def _show(swept: Kink | None, traded: Trade | None, problem: str, plots: bool) -> None:
    from bench.views.kink import show_kink, show_trade
    from bench.views.tables import console

    out = console()
    if swept is not None:
        show_kink(out, swept, problem, plots)
    if traded is not None:
        show_trade(out, traded, problem)
