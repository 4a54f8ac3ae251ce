"""`routes invert`: p estimated from data."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.study import Rule, Study
from gradient_routes.bench.command_options import at_option, replaces, routes_option, solver_options
from gradient_routes.bench.inversion.columns import CONSTANTS, ESTIMATES, FIT, INVERSION, LCURVE, RESIDUALS, TRADEOFF
from gradient_routes.bench.ranges import COUNT, FROM_ZERO, POSITIVE, SEED, Whole
from gradient_routes.bench.studies.options import problem_option

FROM_NONE = Whole(0)
POSITIVES = ["none", "log", "softplus"]
OPTIMIZERS = ["lbfgs", "gauss-newton", "levenberg-marquardt", "trust", "descent", "adam"]
OPTIMIZER = "gauss-newton, levenberg-marquardt and trust use d(S u)/dp; descent is for comparison, adam for --minibatch"
TOLERANCE = "Ends where |dJ/dp|, per natural change of p, is this part of its first, or of 1/2 |d|^2 (stiffness, rod)."
RAW = "How a raw parameter is kept > 0: its logarithm varies, or the argument of softplus."
ALPHA_SWEEP = "J minimized at COUNT weights of Phi from LEAST to MOST: the L-curve."
DRAWS = "The same for N draws of the noise: bias and variance against alpha."
MINIBATCH = "Gradients of K load cases at a time, drawn at random, for adam."
RATE = "Of adam's steps, in natural changes of p."
AT_NOISE = "End at the first step that meets the data to their noise: the discrepancy principle for iterations."
LINEAR = "One linear solve in place of an iteration: the map from readings to p, about the start."
MAP = "A map that -o has saved, in place of --problem."
FRAMES = (
    "Readings to apply it to, a row a frame: CSV with columns of their names, or .npz with one array in their order."
)
OUTPUT = (
    "FILE.csv: estimates and error bars, a parameter a line, which --at reads; FILE.vtu: u and p on the mesh,"
    " residuals at the data. With --linear p of every frame as CSV, and FILE.npz, the map."
    f" {replaces('file of its kind')}"
)
RESUME = "From where the last run of the same (problem, route, optimizer, start) in the store ended."
RUN = ("problem", "problem_options", "at", "route", "route_options", "optimizer")

STUDY = Study(
    name="invert",
    question="Which p minimizes J(p) = 1/2 |S u(p) - d|^2 + alpha Phi(p), with any route as the source of gradients?",
    help="""Every accepted step is shown as it is taken, with the solves paid so far; with several routes, what each
    pays to reach a misfit. A line search that fails is diagnosed: J or its gradient.

    \b
    routes invert --problem bar                                          five moduli of eight, to rounding
    routes invert --problem 'bar[noise=1e-3]' --alpha-sweep 1e-8 1 9     how much regularization
    routes invert --problem bar --route adjoint --route fd-central       the same answer, two costs
    routes invert --problem bar --linear -o map.npz                      one linear solve, kept
    routes invert --linear --map map.npz --frames readings.csv -o p.csv  for any number of frames

    Where the error that the solves leave in dJ/dp, estimated, exceeds what is left of it, the inversion stops and says
    so. Before "converged" is said, differences of J along two random directions confirm that dJ/dp is 0 there.

    Exit code: 0 ended (converged or not, the last line says which), 1 the gradient is not that of J, or the model does
    not explain the data, or shorter steps in time move the answer, or that of --linear does not suffice for the noise,
    or J cannot be evaluated at the start, or --timeout is over, 2 wrong usage, 130 interrupted. What was found by then
    is shown and kept.""",
    options=(
        partial(problem_option, required=False),
        routes_option("adjoint"),
        at_option,
        click.option("--optimizer", type=click.Choice(OPTIMIZERS), default="lbfgs", show_default=True, help=OPTIMIZER),
        click.option("--iterations", type=FROM_NONE, default=200, show_default=True, help="At most; 0: the start."),
        click.option("--tolerance", type=FROM_ZERO, default=1e-9, show_default=True, help=TOLERANCE),
        click.option(
            "--positive",
            type=click.Choice(POSITIVES),
            default="none",
            show_default=True,
            help=RAW,
        ),
        click.option(
            "--alpha-sweep", type=(POSITIVE, POSITIVE, Whole(2, 10_000)), metavar="LEAST MOST COUNT", help=ALPHA_SWEEP
        ),
        click.option("--draws", type=Whole(2), metavar="N", help=DRAWS),
        click.option("--stop-at-noise", is_flag=True, help=AT_NOISE),
        click.option("--minibatch", type=COUNT, metavar="K", help=MINIBATCH),
        click.option("--rate", type=POSITIVE, default=0.1, show_default=True, help=RATE),
        click.option("--seed", type=SEED, default=0, show_default=True, help="Of the minibatches."),
        click.option("--linear", is_flag=True, help=LINEAR),
        click.option("--map", "saved_map", type=click.Path(path_type=Path), metavar="FILE.npz", help=MAP),
        click.option("--frames", type=click.Path(path_type=Path), metavar="FILE", help=FRAMES),
        click.option("-o", "--output", type=click.Path(path_type=Path), multiple=True, metavar="FILE", help=OUTPUT),
        click.option("--resume", is_flag=True, help=RESUME),
        solver_options,
    ),
    rules=(
        Rule(("rate",), lambda given: given["optimizer"] == "adam", "is of --optimizer adam"),
        Rule(("seed",), lambda given: given["minibatch"] is not None, "is of --minibatch"),
        Rule(
            ("resume", "minibatch", "stop_at_noise", "linear"),
            lambda given: given["alpha_sweep"] is None,
            "is of a single inversion, not of an --alpha-sweep",
        ),
        Rule(("saved_map", "frames"), lambda given: given["linear"], "is of --linear"),
        Rule(
            ("optimizer", "iterations", "positive", "minibatch", "resume", "stop_at_noise"),
            lambda given: not given["linear"],
            "is of an iteration, which --linear is not",
        ),
    ),
    tables={
        "inversion": Table(INVERSION, (*RUN, "alpha")),
        "estimates": Table(ESTIMATES, (*RUN, "alpha")),
        "constants": Table(CONSTANTS, (*RUN, "alpha")),
        "fit": Table(FIT, (*RUN, "alpha")),
        "residuals": Table(RESIDUALS, (*RUN, "alpha")),
        "lcurve": Table(LCURVE, RUN),
        "tradeoff": Table(TRADEOFF, RUN),
    },
    run="gradient_routes.bench.studies.invert.measure:run",
    view="gradient_routes.bench.studies.invert.view:show",
    figures="gradient_routes.bench.studies.invert.figures:section",
    keeps=True,
)
