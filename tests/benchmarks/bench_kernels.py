"""pytest-benchmark: what routes are made of, one kernel at a time."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Problem
from gradient_routes.routes.model import Model

pytest_plugins = ("measuring",)
pytestmark = pytest.mark.benchmark(group="kernels")
PROBLEMS = {
    "bar[n=10000]": lambda: Bar(n=10_000),
    "block[n=3]": lambda: Block(n=3),
    "advection[n=16]": lambda: Advection(n=16),
}


@cache
def solved(name: str) -> tuple[Problem, Model, np.ndarray, np.ndarray]:
    """The problem, its model, p and u(p)."""
    problem = PROBLEMS[name]()
    model, p = Model(problem), problem.parameters.start
    return problem, model, p, model.solve(p).u


@pytest.mark.parametrize("name", PROBLEMS)
def test_forward_solve(timed, name: str) -> None:
    _, model, p, u = solved(name)
    np.testing.assert_allclose(timed(model.solve, p).u, u, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", PROBLEMS)
def test_residual(timed, name: str) -> None:
    problem, _, p, u = solved(name)
    assert np.abs(timed(problem.residual, u, p)).max() < 1e-9


@pytest.mark.parametrize("name", PROBLEMS)
def test_tangent(timed, name: str) -> None:
    problem, _, p, u = solved(name)
    timed(problem.tangent, u, p)


@pytest.mark.parametrize("name", PROBLEMS)
def test_factorization(timed, name: str) -> None:
    problem, model, p, u = solved(name)
    R_u = problem.tangent(u, p)
    factors = timed(model.factorize, R_u)
    np.testing.assert_allclose(R_u @ factors.solve(u), u, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", PROBLEMS)
def test_transposed_substitution(timed, name: str) -> None:
    problem, model, p, u = solved(name)
    R_u = problem.tangent(u, p)
    lam = timed(model.factorize(R_u).solve_transposed, u)
    np.testing.assert_allclose(R_u.T @ lam, u, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", PROBLEMS)
def test_product(timed, name: str) -> None:
    problem, _, p, u = solved(name)
    assert np.isfinite(timed(problem.tangent(u, p).__matmul__, u)).all()


@pytest.mark.parametrize("name", PROBLEMS)
def test_linearize(timed, name: str) -> None:
    problem, _, p, u = solved(name)
    assert np.isfinite(timed(problem.linearize, u, p).J_u).all()
