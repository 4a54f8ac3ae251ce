"""`routes tolerance`: gradient error against solver tolerance."""

from __future__ import annotations

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.command_options import LINEAR_SOLVERS, at_option, routes_option
from gradient_routes.bench.ranges import FRACTION, Whole
from gradient_routes.bench.studies.options import budget_option, problem_option
from gradient_routes.bench.studies.tolerance.columns import TOLERANCE

SWEEP = "Which tolerance varies. [both; forward where --adjoint-rtol is given]"
RTOL = "Forward tolerance while the adjoint tolerance is swept. [1e-12]"
ADJOINT_RTOL = "Tolerance of linearized and adjoint solves while the forward tolerance is swept. [the same]"
SOLVER = "[direct on nonlinear problems; krylov on linear ones, descent on those with few unknowns]"

STUDY = Study(
    name="tolerance",
    question="How wrong is a gradient where the solves are loose? Every route at every tolerance.",
    help="""Achieved residuals are shown beside the errors, and how near estimates of the
    errors come to them. Finite differences differentiate the solver's noise, the
    adjoint relies on an identity that a loose solve violates, unrolled AD differentiates another iterate.

    Exit code: 0 measured (a tolerance that is not met is a row that says so), 1 the problem cannot be solved at all,
    or --timeout is over, 2 wrong usage, 130 interrupted. What was measured by then is shown and kept.""",
    options=(
        problem_option,
        routes_option("all and adjoint[correct=yes]", ("all", "adjoint[correct=yes]")),
        at_option,
        click.option("--loosest", type=FRACTION, default=1e-1, show_default=True, help="Tolerance to begin with."),
        click.option("--tightest", type=FRACTION, default=1e-14, show_default=True, help="Tolerance to end with."),
        click.option("--per-decade", type=Whole(1, 1000), default=1, show_default=True, help="Tolerances per decade."),
        click.option("--sweep", type=click.Choice(["forward", "adjoint", "both"]), help=SWEEP),
        click.option("--rtol", type=FRACTION, help=RTOL),
        click.option("--adjoint-rtol", type=FRACTION, help=ADJOINT_RTOL),
        click.option("--linear-solver", type=click.Choice(LINEAR_SOLVERS), help=SOLVER),
        budget_option,
    ),
    tables={"tolerance": Table(TOLERANCE, ("problem", "problem_options", "at", "linear_solver", "sweep", "route"))},
    run="gradient_routes.bench.studies.tolerance.measure:run",
    view="gradient_routes.bench.studies.tolerance.view:show",
    figures="gradient_routes.bench.studies.tolerance.figures:section",
    keeps=True,
)
