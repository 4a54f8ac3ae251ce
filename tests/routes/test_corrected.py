"""The corrected gradient is of second order in the solves, and its distance to a gradient is the error of that."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import EXACT, relative_error

from gradient_routes.bench.execution.error_estimate import error_estimate
from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route

LOOSE = {
    "block": (Block(n=2), "auto"),
    "softplus": (Bar(n=4, sensors=3, stop="softplus", width=0.3, k_c=5.0), "auto"),
    "advection": (Advection(n=3), "krylov"),
    "bar": (Bar(), "descent"),
}
TOLERANCES = (1e-1, 1e-3, 1e-5, 1e-8)
ROUNDING = 1e-12  # errors below are not those of the solves alone
EXPECTED = {"block": 3, "softplus": 2, "advection": 3, "bar": 4}  # tolerances, at least, that leave an error above it


def reference(problem: Problem, p: Array) -> Array:
    """A closed form, or complex steps of tight direct solves: no adjoint."""
    own = problem.reference(p)
    return complex_step.prepare(Model(problem, Solver(1e-14)), p)(p).gradient if own is None else own.gradient


def solver(rtol: float, linear_solver: str) -> Solver:
    return Solver(rtol, linear_solver=linear_solver, adjoint_rtol=rtol)


@pytest.mark.parametrize("name", LOOSE)
def test_the_corrected_adjoint_is_of_second_order(name: str) -> None:
    """Both errors relative; 10: the curvature of u(p) and lam(p), of the order of one in natural units."""
    problem, linear_solver = LOOSE[name]
    p = problem.parameters.start
    exact = reference(problem, p)
    seen = 0
    for rtol in TOLERANCES:
        model = Model(problem, solver(rtol, linear_solver))
        plain, better = (adjoint.function(model, p, correct=c).gradient for c in ("no", "yes"))
        error, less = relative_error(plain, exact), relative_error(better, exact)
        if error < 0.1:  # second order is a law of small errors
            assert less <= 10 * error**2 + 1e-13
            seen += error > ROUNDING
    assert seen >= 2


@pytest.mark.parametrize("route", EXACT, ids=lambda route: route.name)
@pytest.mark.parametrize("name", LOOSE)
def test_estimates_are_near_the_error(name: str, route: Route) -> None:
    problem, linear_solver = LOOSE[name]
    p = problem.parameters.start
    exact = reference(problem, p)
    ratios = {}
    for rtol in TOLERANCES:
        model = Model(problem, solver(rtol, linear_solver))
        result = route.prepare(model, p)(p)
        error, estimate = relative_error(result.gradient, exact), error_estimate(model, model.solve(p), route, result)
        assert estimate is not None
        if error > ROUNDING:
            ratios[rtol] = estimate / error
    assert len(ratios) >= EXPECTED[name] or route is complex_step
    assert all(1 / 3 < ratio < 3 for ratio in ratios.values()), ratios


def test_a_wrong_gradient_is_far_from_the_corrected_one() -> None:
    problem, _ = LOOSE["block"]
    model, p = Model(problem), problem.parameters.start
    result = adjoint.function(model, p)
    spoilt = result._replace(gradient=1.01 * result.gradient)
    assert error_estimate(model, model.solve(p), adjoint, spoilt) == pytest.approx(0.01, rel=1e-6)


def test_finite_differences_have_no_estimate() -> None:
    """Their error is that of the step."""
    problem, _ = LOOSE["bar"]
    model, p = Model(problem), problem.parameters.start
    assert error_estimate(model, model.solve(p), fd_central, fd_central.prepare(model, p)(p)) is None


def test_the_corrected_adjoint_returns_the_state_it_belongs_to() -> None:
    problem, _ = LOOSE["block"]
    model, p = Model(problem, Solver(rtol=1e-2, adjoint_rtol=1e-2)), problem.parameters.start
    plain, better = (adjoint.function(model, p, correct=c) for c in ("no", "yes"))
    assert better.residual == pytest.approx(model.relative_residual(better.u, p))
    assert better.residual < 1e-2 * plain.residual
    assert pytest.approx(problem.objective(better.u, p)) == better.J
    assert np.abs(problem.tangent(better.u, p).T @ better.lam + problem.linearize(better.u, p).J_u).max() < 1e-5
