"""`routes check`: a verdict on anyone's gradient."""

from __future__ import annotations

from pathlib import Path

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Options, Rule, Study
from gradient_routes.bench.command_options import at_option, replaces, solver_options
from gradient_routes.bench.protocols import is_foreign
from gradient_routes.bench.ranges import FROM_ZERO, MANY, SEED
from gradient_routes.bench.studies.data_options import data_options
from gradient_routes.bench.verification.columns import CHECKS, POINTS

ACCEPT = "Relative error of the gradient that is good enough, where 1e-7 is too strict."
PAGE = f"Write the verdict and its curves there. {replaces('.html')}"
CONFIG = 'UM-Bridge: the model\'s config; Tesseract: {"inputs": {..}}, p among them.'
DATA = "UM-Bridge, Tesseract: J = 1/2 |F(p) - d|^2 with these data d, a header line and m values."
HTML = click.option("--html", type=click.Path(path_type=Path), metavar="FILE", help=PAGE)
QUESTION = ("problem", "route", "at")
TABLES = {"checks": Table(CHECKS, QUESTION), "points": Table(POINTS, QUESTION)}


def _registered(given: Options) -> bool:
    return given["problem"] is not None or given["route"] is not None


def _judged(given: Options) -> bool:
    """Whether there will be a verdict: a problem alone, or a route alone, has its contract checked."""
    return given["adapter"] is not None or (given["problem"] is None) == (given["route"] is None)


def _foreign(given: Options) -> bool:
    return is_foreign(given["target"])


STUDY = Study(
    name="check",
    question="Is this gradient right, and if not, why?",
    help="""
    \b
    routes check my_model.py:Model                an object with objective(p), gradient(p) and start
    routes check --objective m.py:J --gradient m.py:dJ --at p.csv
    routes check --problem block --route adjoint
    routes check --problem bar --adapter mine.py  another code, by its adapter
    routes check umbridge:http://localhost:4242#forward --at p.csv
    routes check tesseract:my_tesseract --config inputs.json
    routes check --problem my_problem.py:Spring   the contract: shapes, derivatives, transposes, work

    The object may offer value_and_gradient(p) instead, and scale, bounds, names, tighten(factor), active_set(p).

    Exit code: 0 agrees, 1 wrong-gradient or inconsistent-discretization, 3 inconclusive, 2 wrong usage.""",
    options=(
        click.argument("target", required=False, metavar="[FILE.py:NAME|umbridge:URL#MODEL|tesseract:FILE|URL]"),
        click.option("--objective", metavar="FILE.py:NAME", help="A function J(p), in place of an object."),
        click.option("--gradient", metavar="FILE.py:NAME", help="A function dJ/dp(p) -> (n_p,), beside --objective."),
        click.option("--problem", metavar="SELECTOR", help="A problem, or FILE.py:NAME; without --route its contract."),
        data_options,
        click.option("--route", metavar="SELECTOR", help="A route, or FILE.py:NAME; without --problem its contract."),
        click.option("--adapter", metavar="FILE", help="Another code on --problem: its adapter's script or command."),
        click.option("--config", metavar="FILE.json", help=CONFIG),
        click.option("--data", metavar="FILE.csv", help=DATA),
        at_option,
        click.option("--budget", type=MANY, default=240, show_default=True, help="Objective calls at most."),
        click.option("--accept", type=FROM_ZERO, default=0.0, metavar="ERROR", help=ACCEPT),
        solver_options,
        click.option("--seed", type=SEED, default=0, show_default=True, help="Of random directions."),
        HTML,
    ),
    rules=(
        Rule(("rtol", "max_steps", "linear_solver", "newton"), _registered, "is for registered problems"),
        Rule(("config", "data"), _foreign, "is for models of UM-Bridge and Tesseract"),
        Rule(("budget", "accept", "seed", "html", "no_plot", "store"), _judged, "is for verdicts, a contract has none"),
    ),
    tables=TABLES,
    stores=_judged,
    run="gradient_routes.bench.studies.check.measure:run",
    view="gradient_routes.bench.studies.check.view:show",
    json="gradient_routes.bench.studies.check.view:as_dict",
)
