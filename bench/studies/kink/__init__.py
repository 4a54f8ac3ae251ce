"""`routes kink`: dJ/dp where the active set of a contact changes."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import at_option, routes_option, solver_options
from gradient_routes.bench.ranges import POSITIVE, Whole
from gradient_routes.bench.studies.kink.columns import KINK
from gradient_routes.bench.studies.options import budget_option, problem_option

RANGE = "Least and largest common factor on all moduli."

STUDY = Study(
    name="kink",
    question="What becomes of dJ/dp where the active set changes? A common factor s on all moduli is swept over it.",
    help="""Finds s by bisection, shows dJ/ds by every route from the left and from the right, and what finite
    differences make of it. A stop whose law is rounded has no event: the sweep is shown, and what its width costs.

    \b
    routes kink --problem 'bar[stop=multiplier]'
    routes kink --problem 'bar[stop=softplus]' --route adjoint

    Exit code: 0 measured, 1 forward solves failed, 2 wrong usage, 130 interrupted, nothing kept.""",
    options=(
        problem_option,
        routes_option("all", given=()),
        at_option,
        click.option("--range", "s_range", nargs=2, type=POSITIVE, default=(0.25, 4.0), show_default=True, help=RANGE),
        click.option("--points", type=Whole(2, 100_000), default=33, show_default=True, help="Factors in that range."),
        budget_option,
        solver_options,
    ),
    tables={"kink": Table(KINK, ("problem", "at"))},
    run="gradient_routes.bench.studies.kink.measure:run",
    view="gradient_routes.bench.studies.kink.view:show_study",
    figures="gradient_routes.bench.studies.kink.figures:section",
)
