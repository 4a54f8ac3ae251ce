"""`routes unrolling`: error and tape of unrolled AD against the iteration count."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import at_option
from gradient_routes.bench.ranges import COUNT, Real
from gradient_routes.bench.studies.options import budget_option, problem_option
from gradient_routes.bench.studies.unrolling.columns import UNROLLING, UNROLLING_FITS

INNER = "The iteration on the tape. [that of the route]"
CHECKPOINT = "Also keep only every C-th iterate on the tape, and compare."
WITHIN = "Multiple of implicit-ad's error at which the gradients are taken to agree."
QUESTION = ("problem", "problem_options", "at", "inner", "checkpoint")

STUDY = Study(
    name="unrolling",
    question="How many iterations does unrolled AD take to be right, and how long is its tape?",
    help="""Errors of J and of its gradient, and bytes of tape, against k iterations. k doubles until the gradient
    agrees with that of implicit-ad; the tape is fitted by a line. Errors of 2e-13 are rounding.

    Exit code: 0 measured, 1 the problem cannot be solved, 2 wrong usage, 130 interrupted, nothing kept.""",
    options=(
        problem_option,
        at_option,
        click.option("--inner", type=click.Choice(["cg", "richardson", "jacobi", "direct"]), help=INNER),
        click.option("--checkpoint", type=COUNT, metavar="C", help=CHECKPOINT),
        click.option("--max-iterations", type=COUNT, default=4096, show_default=True, help="Largest k."),
        click.option("--within", type=Real(min=1.0), default=10.0, show_default=True, help=WITHIN),
        budget_option,
    ),
    tables={"unrolling": Table(UNROLLING, QUESTION), "unrolling_fits": Table(UNROLLING_FITS, QUESTION)},
    run="gradient_routes.bench.studies.unrolling.measure:run",
    view="gradient_routes.bench.studies.unrolling.view:show",
    figures="gradient_routes.bench.studies.unrolling.figures:section",
)
