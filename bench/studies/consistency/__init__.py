"""`routes consistency`: what it costs an inversion that its gradient is not that of J."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import at_option, routes_option, solver_options
from gradient_routes.bench.ranges import COUNT, FROM_ZERO
from gradient_routes.bench.studies.consistency.columns import CONSISTENCY, STEPS
from gradient_routes.bench.studies.data_options import data_options
from gradient_routes.bench.studies.options import PROBLEM

DEFAULT = "advection[n=8,data=twin,noise=0.01,alpha=0.0001]"
OPTIMIZERS = ["lbfgs", "descent"]
TOLERANCE = "Ends where |dJ/dp|, per natural change of p, is this part of its first, or of 1/2 |d|^2 (stiffness, rod)."
QUESTION = ("problem", "route", "at", "optimizer")

STUDY = Study(
    name="consistency",
    question="What does it cost an inversion that its gradient is not that of the discretized J?",
    help="""The same inversion with each gradient: where the line search stalls, at which J, true gradient and step
    length, after how many evaluations, and how far above the minimum. Without --route: the adjoint of the discretized
    equations (discretize, then optimize), and each adjoint with a discretization of its own that the problem offers.

    \b
    routes consistency
    routes consistency --problem 'advection[n=16,data=twin]' --route adjoint --route 'faulty-adjoint[fault=otd]'

    Exit code: 0 measured, 1 J cannot be evaluated or minimized, 2 wrong usage, 130 interrupted, nothing kept.""",
    options=(
        click.option("--problem", "selector", default=DEFAULT, show_default=True, metavar="SELECTOR", help=PROBLEM),
        data_options,
        routes_option("adjoint and all inconsistent ones", given=()),
        at_option,
        click.option("--optimizer", type=click.Choice(OPTIMIZERS), default="lbfgs", show_default=True, help="How."),
        click.option("--iterations", type=COUNT, default=200, show_default=True, help="At most."),
        click.option("--tolerance", type=FROM_ZERO, default=1e-9, show_default=True, help=TOLERANCE),
        solver_options,
    ),
    tables={"consistency": Table(CONSISTENCY, QUESTION), "consistency_steps": Table(STEPS, QUESTION)},
    run="gradient_routes.bench.studies.consistency.measure:run",
    view="gradient_routes.bench.studies.consistency.view:show",
    figures="gradient_routes.bench.studies.consistency.figures:section",
)
