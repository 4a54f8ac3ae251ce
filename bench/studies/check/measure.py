"""What `routes check` judges: anyone's code, a registered problem and route, or the contract of one of them."""

from __future__ import annotations

from pathlib import Path

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.imported import imported
from gradient_routes.bench.cases.point_values import are_values, values
from gradient_routes.bench.cases.study import Found, Say
from gradient_routes.bench.protocols import forward, is_foreign
from gradient_routes.bench.protocols.target import model_of
from gradient_routes.bench.studies.check.conclude import conclude, page_writable
from gradient_routes.bench.studies.options import one_route, problem_at
from gradient_routes.bench.verification import adapter as by_adapter
from gradient_routes.bench.verification import foreign
from gradient_routes.bench.verification.check import accepted, check
from gradient_routes.bench.verification.contract import of_problem, of_route
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.registered import subject
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.data.csv import read_columns
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.foreign.command import command_of
from gradient_routes.routes.newton import Solver


def run(
    say: Say,
    *,
    target: str | None,
    objective: str | None,
    gradient: str | None,
    problem: str | None,
    route: str | None,
    adapter: str | None,
    config: str | None,
    data: str | None,
    at: str,
    budget: int,
    accept: float,
    solver: Solver,
    seed: int,
    html: Path | None,
    kept: Path | None,
) -> int:
    ways = {
        "a target": target,
        "--objective": objective or gradient,
        "--problem or --route": problem or route or adapter,
    }
    given = [name for name, value in ways.items() if value is not None]
    if len(given) != 1:
        what = f"{' and '.join(given)} given" if given else "nothing to check"
        raise InputError(f"check: {what} - give FILE.py:NAME, or --objective and --gradient, or --problem and --route")
    if adapter is not None and (problem is None or route is not None):
        raise InputError("check: --adapter goes with --problem, without --route - give both, or leave it out")
    if adapter is None and (problem is None) != (route is None):
        return _contract(say, problem, route, at, solver)
    plan = Plan(budget=budget, seed=seed)
    accepted(accept)
    if problem is not None and adapter is not None:
        made, p = problem_at(problem, at)
        asked = by_adapter.subject(made, command_of(adapter), adapter, p, solver)
    elif target is not None and is_foreign(target):
        asked = forward.subject(model_of(target, config), _start(at), None if data is None else _column(data), seed)
    else:
        asked = _subject(target, objective, gradient, problem, route, at, solver)
    page_writable(html, kept, [target, objective, gradient, problem, route, config, data, at])
    with stdout_to_stderr():
        found = check(asked, plan, accept)
    beside = [f"--{name} {file}" for name, file in (("config", config), ("data", data)) if file is not None]
    own = " ".join([target, *beside]) if target is not None else f"{objective} {gradient}"
    named = {"problem": problem or own, "route": route or adapter, "at": at}
    return conclude(say, found, named, html)


def _contract(say: Say, problem: str | None, route: str | None, at: str, solver: Solver) -> int:
    """A problem alone with all routes, or a route alone on the bar."""
    made, p = problem_at(problem or "bar", at)
    with stdout_to_stderr():
        if route is not None:
            spec = one_route(route)
            found = of_route(made, p, spec.route, spec.options, solver)
        else:
            found = of_problem(made, p, [spec.route for spec in case.routes(["all"])], solver)
    say(Found(found))
    return 1 if found.broken else 0


def _subject(
    target: str | None,
    objective: str | None,
    gradient: str | None,
    problem: str | None,
    route: str | None,
    at: str,
    solver: Solver,
) -> Subject:
    if problem is not None and route is not None:
        spec = one_route(route)
        made, p = problem_at(problem, at)
        return subject(made, spec.route, spec.options, p, solver)
    start = _start(at)
    if target is not None:
        return foreign.subject_of(imported(target), target, start)
    if objective is None or gradient is None:
        raise InputError("check: --objective and --gradient go together - give both")
    if start is None:
        raise InputError("check: two functions have no start - give the point with --at, values or a file")
    return foreign.subject(imported(objective), imported(gradient), start, name=gradient)


def _start(at: str) -> Array | None:
    """The point named; None for that of the code itself."""
    if at == "true":
        raise InputError("check: --at true is for registered problems with synthetic data - give values or a file")
    if at == "start":
        return None
    return values(at) if are_values(at) else _column(at)


def _column(file: str) -> Array:
    columns = read_columns(file, None, folder=located(""))
    if len(columns) != 1:
        raise InputError(f"{file}: has {len(columns)} columns - give one, with a header line")
    return next(iter(columns.values()))
