"""`routes vcurve`: difference quotients over decades of steps against a route's gradient, and a verdict."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.command_options import at_option, checked, debug_option, solver_options, store_options
from gradient_routes.bench.execution.limited import confined
from gradient_routes.bench.studies.check.options import built, conclude, one_route, page_writable
from gradient_routes.bench.studies.study import no_plot_option, one_problem, writable
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError, NotConverged, SingularMatrix

if TYPE_CHECKING:
    from gradient_routes.bench.verification.plan import Plan
    from gradient_routes.routes.newton import Solver

LONGEST = 12  # digits of a number that are read
FEW = 3  # components, where nobody says how many
COMPONENTS = "So many components by sensitivity, or these: 2,5..7 [element min(3, M) of the bar; 3 elsewhere]."
BUDGET = "Refuse what is predicted to take more seconds; inf forces it."


@click.command()
@click.option("--problem", required=True, metavar="SELECTOR", help="NAME, 'NAME[key=value]' or FILE.py:NAME.")
@click.option("--route", required=True, metavar="SELECTOR", help="The route whose gradient is looked at.")
@at_option
@click.option("--components", metavar="M|LIST", help=COMPONENTS)
@click.option("--directions", type=int, default=2, show_default=True, help="Random directions.")
@click.option("--steps", nargs=2, type=float, default=(1e-16, 1.0), show_default=True, help="Least and largest h.")
@click.option("--per-decade", type=int, default=4, show_default=True, help="Steps in each decade.")
@click.option("--budget", type=float, default=60.0, show_default=True, help=BUDGET)
@solver_options
@click.option("--seed", type=int, default=0, show_default=True, help="Of the directions.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object and nothing else.")
@click.option("--html", type=click.Path(path_type=Path), metavar="FILE", help="Write the verdict and its curves there.")
@no_plot_option
@store_options
@confined()
@debug_option
def vcurve(
    problem: str,
    route: str,
    at: str,
    components: str | None,
    directions: int,
    steps: tuple[float, float],
    per_decade: int,
    budget: float,
    solver: Solver,
    seed: int,
    as_json: bool,
    html: Path | None,
    no_plot: bool,
    kept: Path | None,
) -> None:
    """Sweep finite-difference steps over decades, read the curve and say whether the gradient is right.

    One-sided and central quotients along components and random directions, against the gradient of the route; on a
    plateau the forward solve is tightened and the mesh refined. Every point is kept: `routes export --table points`.

    Exit code: 0 agrees, 1 wrong-gradient or inconsistent-discretization, 3 inconclusive, 2 wrong usage.
    """
    from gradient_routes.bench.execution.cost_model import price_of
    from gradient_routes.bench.verification.check import check
    from gradient_routes.bench.verification.plan import Plan
    from gradient_routes.bench.verification.registered import subject

    checked(budget)
    started, route_spec = now(), one_route(route)
    made, p = built(one_problem(problem), at)
    few: int | tuple[int, ...] = FEW if made.typical is None else (made.typical,)
    few = few if components is None else _components(components, len(p))
    plan = Plan(*steps, per_decade, few, directions, everywhere=True, budget=float("inf"), seed=seed)
    looked_at = subject(made, route_spec.route, route_spec.options, p, solver)
    with suppress(NotConverged, SingularMatrix):  # a solve that fails is part of the verdict
        _refuse_beyond(budget, price_of(lambda: looked_at.objective(p))[0], plan)
    page_writable(html, [kept, problem, route, at])
    writable(kept)
    with stdout_to_stderr():
        found = check(looked_at, plan)
    what = {"problem": problem, "route": route, "at": at}
    code = conclude(found, what, started, as_json=as_json, no_plot=no_plot, html=html, kept=kept)
    raise click.exceptions.Exit(code)


def _components(text: str, n_p: int) -> int | tuple[int, ...]:
    """A number of components, or their numbers from 1: 2,5..7."""
    numbers: list[int] = []
    for item in text.split(","):
        first, dots, last = item.strip().partition("..")
        if not first.isdecimal() or (dots and not last.isdecimal()):
            raise InputError(f"--components {text}: {item!r} is no number - write 3 (how many) or 2,5..7 (which)")
        start, stop = (int(number[:LONGEST]) for number in (first, last or first))
        if not 1 <= start <= stop <= n_p:
            raise InputError(f"--components {text}: there are 1 to {n_p} - choose among them")
        numbers += range(start, stop + 1)
    if "," not in text and ".." not in text:
        return numbers[0]
    return tuple(dict.fromkeys(i - 1 for i in numbers))


def _refuse_beyond(budget: float, seconds: float, plan: Plan) -> None:
    from gradient_routes.bench.units import duration

    few = plan.components if isinstance(plan.components, int) else len(plan.components)
    calls = 2 * len(plan.steps) * (few + plan.directions)
    if calls * seconds > budget:
        raise InputError(
            f"vcurve: {calls} forward solves are predicted to take {duration(calls * seconds)} > --budget {budget:g} s"
            " - take fewer by --per-decade, --components, --directions or --steps, or --budget inf"
        )
