"""`routes check`: is this gradient right? For anyone's code, a registered problem and route, or a contract."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.command_options import at_option, debug_option, refuse_given, solver_options, store_options
from gradient_routes.bench.execution.limited import confined
from gradient_routes.bench.studies.check.options import built, conclude, one_route, page_writable
from gradient_routes.bench.studies.study import no_plot_option, one_problem, writable
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.verification.subject import Subject
    from gradient_routes.routes.newton import Solver

SOLVER = ("rtol", "max_steps", "linear_solver", "newton")
UNUSED = ("budget", "accept", "seed", "html", "no_plot", "store")
ACCEPT = "Relative error of the gradient that is good enough, where 1e-7 is too strict."


@click.command()
@click.argument("target", required=False, metavar="[FILE.py:NAME]")
@click.option("--objective", metavar="FILE.py:NAME", help="A function J(p), in place of an object that has one.")
@click.option("--gradient", metavar="FILE.py:NAME", help="A function dJ/dp(p) -> (n_p,), beside --objective.")
@click.option("--problem", metavar="SELECTOR", help="A problem, or FILE.py:NAME; without --route its contract.")
@click.option("--route", metavar="SELECTOR", help="A route, or FILE.py:NAME; without --problem its contract.")
@at_option
@click.option("--budget", type=int, default=200, show_default=True, help="Objective calls at most.")
@click.option("--accept", type=float, default=0.0, metavar="ERROR", help=ACCEPT)
@solver_options
@click.option("--seed", type=int, default=0, show_default=True, help="Of random directions.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object and nothing else.")
@click.option("--html", type=click.Path(path_type=Path), metavar="FILE", help="Write the verdict and its curves there.")
@no_plot_option
@store_options
@confined()
@debug_option
def check(
    target: str | None,
    objective: str | None,
    gradient: str | None,
    problem: str | None,
    route: str | None,
    at: str,
    budget: int,
    accept: float,
    solver: Solver,
    seed: int,
    as_json: bool,
    html: Path | None,
    no_plot: bool,
    kept: Path | None,
) -> None:
    """Is this gradient right, and if not, why?

    \b
    routes check my_model.py:Model                an object with objective(p), gradient(p) and start
    routes check --objective m.py:J --gradient m.py:dJ --at p.csv
    routes check --problem block --route adjoint
    routes check --problem my_problem.py:Spring   the contract: shapes, derivatives, transposes, work

    The object may offer value_and_gradient(p) instead, and scale, bounds, names, tighten(factor), active_set(p).

    Exit code: 0 agrees, 1 wrong-gradient or inconsistent-discretization, 3 inconclusive, 2 wrong usage.
    """
    from gradient_routes.bench.verification.check import accepted
    from gradient_routes.bench.verification.check import check as check_subject
    from gradient_routes.bench.verification.plan import Plan

    started = now()
    ways = {"a target": target, "--objective": objective or gradient, "--problem or --route": problem or route}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) != 1:
        what = f"{' and '.join(given)} given" if given else "nothing to check"
        raise InputError(f"check: {what} - give FILE.py:NAME, or --objective and --gradient, or --problem and --route")
    if problem is None and route is None:
        refuse_given(SOLVER, "is for registered problems")
    if (problem is None) != (route is None):
        refuse_given(UNUSED, "is for verdicts, a contract has none")
        raise click.exceptions.Exit(_contract(problem, route, at, solver, as_json))
    plan = Plan(budget=budget, seed=seed)
    accepted(accept)
    subject = _subject(target, objective, gradient, problem, route, at, solver)
    page_writable(html, [kept, target, objective, gradient, problem, route, at])
    writable(kept)
    with stdout_to_stderr():
        found = check_subject(subject, plan, accept)
    named = {"problem": problem or target or f"{objective} {gradient}", "route": route, "at": at}
    code = conclude(found, named, started, as_json=as_json, no_plot=no_plot, html=html, kept=kept)
    raise click.exceptions.Exit(code)


def _subject(
    target: str | None,
    objective: str | None,
    gradient: str | None,
    problem: str | None,
    route: str | None,
    at: str,
    solver: Solver,
) -> Subject:
    from gradient_routes.bench.cases.imported import imported
    from gradient_routes.bench.verification import foreign

    if problem is not None and route is not None:
        from gradient_routes.bench.verification.registered import subject

        spec = one_route(route)
        made, p = built(one_problem(problem), at)
        return subject(made, spec.route, spec.options, p, solver)
    if at == "true":
        raise InputError("check: --at true is for registered problems with synthetic data - give a file")
    start = None if at == "start" else _column(at)
    if target is not None:
        return foreign.subject_of(imported(target), target, start)
    if objective is None or gradient is None:
        raise InputError("check: --objective and --gradient go together - give both")
    if start is None:
        raise InputError("check: two functions have no start - give the point with --at FILE.csv")
    return foreign.subject(imported(objective), imported(gradient), start, name=gradient)


def _column(at: str) -> object:
    from gradient_routes.problems.data.csv import read_columns

    columns = read_columns(at, None)
    if len(columns) != 1:
        raise InputError(f"{at}: has {len(columns)} columns - --at reads one, with a header line")
    return next(iter(columns.values()))


def _contract(problem: str | None, route: str | None, at: str, solver: Solver, as_json: bool) -> int:
    """A problem alone with all routes, or a route alone on the bar."""
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.row import clean
    from gradient_routes.bench.verification.contract import of_problem, of_route

    made, p = built(one_problem(problem or "bar"), at)
    with stdout_to_stderr():
        if route is not None:
            spec = one_route(route)
            found = of_route(made, p, spec.route, spec.options, solver)
        else:
            found = of_problem(made, p, [spec.route for spec in case.routes(["all"])], solver)
    if as_json:
        findings = [vars(f) | {"sound": f.sound} for f in found.findings]
        click.echo(json.dumps(clean({"name": found.name, "findings": findings}), allow_nan=False))
    else:
        from gradient_routes.bench.render.terminal.tables import console
        from gradient_routes.bench.verification.view import show_contract

        show_contract(console(), found)
    return 1 if found.broken else 0
