"""`routes identify`: what the data determine of p."""

from __future__ import annotations

from pathlib import Path

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Rule, Study
from gradient_routes.bench.command_options import at_option, replaces, solver_options
from gradient_routes.bench.ranges import COUNT, POSITIVE
from gradient_routes.bench.studies.identify.columns import EXPERIMENTS, IDENTIFIED, PLACEMENT, SPECTRUM
from gradient_routes.bench.studies.options import problem_option

NOISE = "Standard deviation of a reading. [that of the problem]"
MODES = "Number of singular values, by random products. [all where H is affordable]"
OTHER = "The same problem with another {0}=; repeatable."
VARY = "Another value of any other option; repeatable."
PLACE = "Propose K further sensors."
CRITERION = "Least volume (D) or mean variance (A) of the posterior covariance."
AFRESH = "Place them instead of the present sensors, not beside them."
VTU = f"Null share, column norm and standard deviation cell by cell, for ParaView. {replaces('.vtu')}"
QUESTION = ("experiment", "at")

STUDY = Study(
    name="identify",
    question="What do the data determine of p? Singular values of H = d(S u)/dp, rank, blind parameters.",
    help="""Columns of H are those of natural changes of p, its rows those of J. Experiments are compared with the
    first one; sensors are proposed beside the present ones.

    \b
    routes identify --problem bar --noise 0.01
    routes identify --problem bar --sensors 8 --stop multiplier     which change buys more?
    routes identify --problem 'block[n=3,alpha=1e-4]' --noise 1e-3 --cases 3 --vtu null.vtu
    routes identify --problem bar --noise 0.01 --place 3            where to measure next

    Exit code: 0 measured, 1 a forward solve failed, 2 wrong usage, 130 interrupted, nothing kept.""",
    options=(
        problem_option,
        at_option,
        click.option("--noise", type=POSITIVE, metavar="SIGMA", help=NOISE),
        click.option("--sensors", multiple=True, metavar="VALUE", help=OTHER.format("sensors")),
        click.option("--cases", multiple=True, metavar="VALUE", help=OTHER.format("cases")),
        click.option("--stop", multiple=True, metavar="VALUE", help=OTHER.format("stop")),
        click.option("--vary", multiple=True, metavar="KEY=VALUE", help=VARY),
        click.option("--place", type=COUNT, metavar="K", help=PLACE),
        click.option("--criterion", type=click.Choice(["D", "A"]), default="D", show_default=True, help=CRITERION),
        click.option("--afresh", is_flag=True, help=AFRESH),
        click.option("--modes", type=COUNT, metavar="K", help=MODES),
        click.option("--vtu", type=click.Path(path_type=Path), metavar="FILE.vtu", help=VTU),
        solver_options,
    ),
    rules=(Rule(("criterion", "afresh"), lambda given: given["place"] is not None, "is of the sensors of --place"),),
    tables={
        "spectrum": Table(SPECTRUM, QUESTION),
        "identified": Table(IDENTIFIED, QUESTION),
        "experiments": Table(EXPERIMENTS, QUESTION),
        "placement": Table(PLACEMENT, (*QUESTION, "criterion")),
    },
    run="gradient_routes.bench.studies.identify.measure:run",
    view="gradient_routes.bench.studies.identify.view:show",
    figures="gradient_routes.bench.studies.identify.figures:section",
)
