"""`routes horizon`: what dJ/dp says of J the longer a march is."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import at_option, solver_options
from gradient_routes.bench.ranges import Real, Whole
from gradient_routes.bench.studies.horizon.columns import HORIZON
from gradient_routes.bench.studies.options import budget_option, problem_option

SPREAD = "Of p to either side along one direction, relative to natural changes."

STUDY = Study(
    name="horizon",
    question="Does dJ/dp say what J does, the longer the march? Gradients against differences of J.",
    help="""For T = 1, 2, 4, .. steps: |dJ/dp|, slopes dJ/dp . v at places of an interval of p around the point, their
    mean and scatter, and the difference quotient of J over the whole interval, which is the mean of all slopes in it
    where J is continuous. Contact in time and chaos make slopes scatter, and miss jumps of J.

    \b
    routes horizon --problem vibrating-bar
    routes horizon --problem 'vibrating-bar[n=2,steps=512,stop=quadratic,stops=both,gap=0.1]'

    Exit code: 0 measured, 1 no march could be solved, 2 wrong usage, 130 interrupted, nothing kept.""",
    options=(
        problem_option,
        at_option,
        click.option("--spread", type=Real(min=1e-12, max=1.0), default=1e-3, show_default=True, help=SPREAD),
        click.option("--places", type=Whole(2, 1000), default=12, show_default=True, help="Slopes in that interval."),
        budget_option,
        solver_options,
    ),
    tables={"horizon": Table(HORIZON, ("problem", "problem_options", "at", "spread", "places"))},
    run="gradient_routes.bench.studies.horizon.measure:run",
    view="gradient_routes.bench.studies.horizon.view:show",
    figures="gradient_routes.bench.studies.horizon.figures:section",
)
