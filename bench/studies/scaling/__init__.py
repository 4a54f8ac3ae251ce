"""`routes scaling`: cost against problem size."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import at_option, routes_option, solver_options
from gradient_routes.bench.ranges import MANY, SECONDS, SHORT, Real, Whole
from gradient_routes.bench.studies.data_options import data_options
from gradient_routes.bench.studies.scaling.columns import BREAK_EVEN, CHECKPOINTS, SCALING_FITS

PROBLEM = "NAME, whose n grows, or a grid of sizes: 'NAME[n=8|64|512]'."
AXIS = "Whole number of the problem that grows: n, or steps of a march in time. [n]"
FROM = "n to begin with, or another axis. [that of the problem]"
ROUTES = "all; along steps adjoint with checkpoints of every kind"
GROWTHS = Real(min=1.0, min_open=True, max=1e6)
GROWTH = "Unknowns of a level over those of the level before."
BUDGET = "End of a route: gradients predicted to take more seconds; inf forces them."
QUESTION = ("problem", "problem_options", "at", "route", "route_options")

STUDY = Study(
    name="scaling",
    question="How do time, memory, work grow with unknowns, parameters, steps, iterations; how far do routes get?",
    help="""A route ends where the next size is over the budget, or reaches another cap. On one affordable size tangent,
    finite differences and adjoint are then timed in turn on 1, 2, 4 ... of the parameters: the n_p from which one is
    cheaper is fitted, and shown beside what the cost model predicts. A grid of iterations is fitted as well:
    --route 'unrolled-ad[iterations=10|100|1000]'. Along --axis steps, memory and steps marched again are also shown
    against the interval k between states that a march keeps: --route 'adjoint[checkpoint=all|every=10|sqrt]'.

    Exit code: 0 measured, 1 no route could be measured, 2 wrong usage, 130 interrupted.""",
    options=(
        click.option("--problem", "selector", required=True, metavar="SELECTOR", help=PROBLEM),
        data_options,
        routes_option(ROUTES, given=()),
        at_option,
        click.option("--axis", metavar="KEY", help=AXIS),
        click.option("--from", "first", type=MANY, metavar="N", help=FROM),
        click.option("--growth", type=GROWTHS, default=4.0, show_default=True, help=GROWTH),
        click.option("--levels", type=Whole(1, 1000), default=10, show_default=True, help="Sizes at most."),
        click.option("--budget", type=SECONDS, default=10.0, show_default=True, help=BUDGET),
        click.option("--min-time", type=SHORT, default=0.1, show_default=True, help="Seconds of steady calls to time."),
        solver_options,
    ),
    tables={
        "scaling_fits": Table(SCALING_FITS, (*QUESTION, "quantity", "against")),
        "break_even": Table(BREAK_EVEN, (*QUESTION, "other", "other_options")),
        "checkpoints": Table(CHECKPOINTS, QUESTION),
    },
    run="gradient_routes.bench.studies.scaling.run:run",
    view="gradient_routes.bench.studies.scaling.view:show",
    figures="gradient_routes.bench.studies.scaling.figures:section",
    keeps=True,
    confined=False,
)
