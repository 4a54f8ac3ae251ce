"""pytest-benchmark: gradients by every route on small problems, and the bar's adjoint over N."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Route
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

pytest_plugins = ("measuring",)
PROBLEMS = {
    "bar[n=100]": lambda: Bar(n=100),
    "block[n=2]": lambda: Block(n=2),
    "advection[n=4]": lambda: Advection(n=4),
}
ROUTES = (adjoint, tangent, implicit_ad, unrolled_ad, fd_central)
UNROLLED = {"bar[n=100]": "cg"}  # the others through their Newton loop
ACCURATE = 1e-6  # that what is timed is the gradient; how exact it is the count and error gate judges


@cache
def problem_of(name: str) -> tuple[Problem, Array]:
    """The problem, and its gradient by the adjoint."""
    problem = PROBLEMS[name]()
    p = problem.parameters.start
    return problem, adjoint.prepare(Model(problem), p)(p).gradient


@pytest.mark.benchmark(group="routes")
@pytest.mark.parametrize("route", ROUTES, ids=lambda route: route.name)
@pytest.mark.parametrize("name", PROBLEMS)
def test_gradient(gradient_of, name: str, route: Route) -> None:
    problem, exact = problem_of(name)
    options = {"inner": UNROLLED.get(name, "direct")} if route is unrolled_ad else {}
    g = gradient_of(route, Model(problem), problem.parameters.start, **options)
    assert np.linalg.norm(g - exact) < ACCURATE * np.linalg.norm(exact)


@pytest.mark.benchmark(group="bar's adjoint over N")
@pytest.mark.parametrize("n", [10**3, 10**5])
def test_bar_adjoint(gradient_of, n: int) -> None:
    problem = Bar(n=n)
    assert not gradient_of(adjoint, Model(problem), problem.parameters.start)[5:].any()
