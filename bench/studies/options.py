"""Options that several studies have, and what they name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gradient_routes.bench.ranges import SECONDS
from gradient_routes.bench.studies.data_options import Command, data_options
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.cases.declared import Told
    from gradient_routes.bench.cases.study import Say
    from gradient_routes.problems.problem import Array, Problem

PROBLEM = "NAME, 'NAME[key=value]' or FILE.py:NAME: one problem."
BUDGET = "Skip what is predicted to take more seconds; inf forces it."


def problem_option(command: Command, required: bool = True) -> Command:
    """--problem, and how it reads its data."""
    given = click.option("--problem", "selector", required=required, metavar="SELECTOR", help=PROBLEM)
    return given(data_options(command))


budget_option = click.option("--budget", type=SECONDS, default=60.0, show_default=True, help=BUDGET)


def one_problem(selector: str) -> ProblemSpec:
    """The only problem that a selector names. Raises InputError."""
    from gradient_routes.bench.cases import case

    specs = case.problems([selector])
    if len(specs) != 1:
        raise InputError(f"--problem {selector}: names {len(specs)} problems - name one, without | and all")
    return specs[0]


def one_route(selector: str) -> RouteSpec:
    """The only route that a selector names. Raises InputError."""
    from gradient_routes.bench.cases import case

    specs = case.routes([selector])
    if len(specs) != 1:
        raise InputError(f"--route {selector}: names {len(specs)} routes - name one")
    return specs[0]


def routes_of(selectors: Sequence[str], say: Say, told: Told | None = None) -> list[RouteSpec]:
    """The routes that selectors name; what `all` leaves out is said. Raises InputError."""
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.study import Note

    specs = case.routes(selectors, told or case.NOTHING)
    for left_out in case.left_out([], selectors):
        say(Note(f"left out of 'all': {left_out}"))
    return specs


def problem_at(selector: str, at: str = "start") -> tuple[Problem, Array]:
    """The only problem that a selector names, and the point p. Raises InputError, whatever its factory raises."""
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
    from gradient_routes.bench.verification.guarded import FOREIGN
    from gradient_routes.problems.errors import RoutesError

    spec = one_problem(selector)
    try:
        with stdout_to_stderr():
            problem = spec()
    except (RoutesError, MemoryError):
        raise
    except FOREIGN as error:
        said = " ".join(str(error).split())
        raise InputError(f"problem '{spec.name}' cannot be built: {type(error).__name__}: {said} - mend it") from error
    return problem, case.point(problem, at)
