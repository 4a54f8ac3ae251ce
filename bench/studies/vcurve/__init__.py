"""`routes vcurve`: difference quotients over decades of steps against a route's gradient."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import at_option, solver_options
from gradient_routes.bench.ranges import POSITIVE, SECONDS, SEED, Whole
from gradient_routes.bench.studies.check import HTML, TABLES
from gradient_routes.bench.studies.options import problem_option

COMPONENTS = "Number of components, chosen by sensitivity, or these: 2,5..7 [those the problem suggests, else 3]."
BUDGET = "Refuse what is predicted to take more seconds; inf forces it."

STUDY = Study(
    name="vcurve",
    question="How do finite differences approach a route's gradient over decades of steps, and is it right?",
    help="""One-sided and central quotients along components and random directions, against the gradient of the route;
    on a plateau the forward solve is tightened and the mesh refined. Every point is kept:
    `routes export --table points`.

    Exit code: 0 agrees, 1 wrong-gradient or inconsistent-discretization, 3 inconclusive, 2 wrong usage.""",
    options=(
        problem_option,
        click.option("--route", required=True, metavar="SELECTOR", help="The route whose gradient is judged."),
        at_option,
        click.option("--components", metavar="M|LIST", help=COMPONENTS),
        click.option("--directions", type=Whole(1, 1000), default=2, show_default=True, help="Random directions."),
        click.option(
            "--steps", nargs=2, type=POSITIVE, default=(1e-16, 1.0), show_default=True, help="Least and largest h."
        ),
        click.option("--per-decade", type=Whole(2, 100), default=4, show_default=True, help="Steps per decade."),
        click.option("--budget", type=SECONDS, default=60.0, show_default=True, help=BUDGET),
        solver_options,
        click.option("--seed", type=SEED, default=0, show_default=True, help="Of the directions."),
        HTML,
    ),
    tables=TABLES,
    run="gradient_routes.bench.studies.vcurve.measure:run",
    view="gradient_routes.bench.studies.check.view:show",
    json="gradient_routes.bench.studies.check.view:as_dict",
    figures="gradient_routes.bench.studies.vcurve.figures:section",
)
