"""A row is `ok` only where its state was measured to solve R(u, p) = 0; what does not has the figures."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gradient_routes.bench.api import run
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array, Linearization, Offers, Parameters, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import ForwardWork, Result, Route, Work, route


class Square(Problem):
    """R = u^2 - p, with two solutions; J = u."""

    name = "square"
    offers = Offers.LINEARIZE
    n_state = 1
    parameters = Parameters(start=np.array([4.0]), scale=np.ones(1))

    def initial(self, p: Array) -> Array:
        return np.ones(1, p.dtype)

    def residual(self, u: Array, p: Array) -> Array:
        return u**2 - p

    def tangent(self, u: Array, p: Array) -> Array:
        return np.diag(2.0 * u)

    def objective(self, u: Array, p: Array) -> float:
        return u[0]

    def linearize(self, u: Array, p: Array) -> Linearization:
        return Linearization(-np.eye(1), np.ones(1), np.zeros(1))


class Positions(Square):
    """A spring by the length of what is stretched, X + u with X = 1: R = p ((1 + u) - 1) - load."""

    name = "positions"
    offset = 1.0

    def __init__(self, load: float) -> None:
        self.load = load

    def initial(self, p: Array) -> Array:
        return np.zeros(1, p.dtype)

    def residual(self, u: Array, p: Array) -> Array:
        return p * ((1.0 + u) - 1.0) - self.load

    def tangent(self, u: Array, p: Array) -> Array:
        return np.diag(p)

    def linearize(self, u: Array, p: Array) -> Linearization:
        return Linearization(u[:, None], np.ones(1), np.zeros(1))


def claiming(u: float) -> Route:
    """A route that calls any u its solved state."""

    def cost(n_p: int, forward: ForwardWork) -> Work:
        return Work()

    @route("claiming", needs=Offers.SOLVE, cost=cost)
    def claims(model: Model, p: Array) -> Result:
        """dJ/dp = 1/(2 u)."""
        return Result(u, 0.5 / np.full(1, u), np.full(1, u), 0.0)

    return claims


@pytest.mark.parametrize(
    ("u", "status", "says"),
    [
        (2.0, "ok", None),
        (2.1, "not-converged", r"^claiming: \|R\| / \|R_0\| = 0.14 at the state of this gradient, wanted 1e-12 - "),
        (-2.0, "not-converged", r"^claiming: its state is off that of the forward solve by 2 \|u\|, .* - take "),
    ],
)
def test_what_a_route_claims_is_measured(u: float, status: str, says: str | None) -> None:
    row = run(Square(), claiming(u), timing=False).iloc[0]
    assert row["status"] == status
    assert row["gradient_norm"] == abs(0.5 / u)  # the figures stay
    assert np.isfinite(row["gradient_error"])
    assert (row["status"] == "ok") if says is None else re.match(says, row["reason"])


def test_an_iterate_that_is_no_solution_keeps_its_figures_and_is_not_ok() -> None:
    row = run("bar", "unrolled-ad[inner=jacobi,iterations=100]", min_time=0.0).iloc[0]
    assert row["status"] == "not-converged"
    assert f"|R| / |R_0| = {row['residual']:.2g}" in row["reason"]
    assert row["gradient_error"] > 1.0
    assert row["seconds"] > 0.0


def test_a_residual_of_rounding_is_said_beside_the_numbers() -> None:
    """u of 10^5 springs in series is rounded to |R| ~ 1e-11 of the load: nothing is nearer, the gradient is exact."""
    row = run("bar[n=100000]", "adjoint", timing=False).iloc[0]
    assert row["status"] == "ok"
    assert row["residual"] > 1e-12
    assert f"|R| / |R_0| = {row['residual']:.2g} is rounding of R, rtol 1e-12 is out of reach" in row["note"]
    assert row["gradient_error"] < 1e-14


@pytest.mark.parametrize("load", 10.0 ** -np.arange(0.0, 18.0))
def test_a_residual_that_rounds_the_strain_away_is_never_called_solved(load: float) -> None:
    """Either the gradient u / p of J = u is right to 1e-5, or the solve says how far |R| came."""
    p, said = np.full(1, 3.0), ""
    try:
        result = adjoint.prepare(Model(Positions(load)), p)(p)
    except NotConverged as failure:
        said = str(failure)
    if said:
        assert load < 1e-8
        assert re.search(r"\|R\| / \|R_0\| = .*wanted 1e-12", said)
    else:
        assert result.gradient == pytest.approx([-load / 9.0], rel=1e-5)


def test_a_failed_solve_says_how_far_it_came_relative_to_its_start() -> None:
    bar = Bar(n=8, stop="softplus")
    with pytest.raises(NotConverged, match=r"in 1 steps: \|R\| / \|R_0\| = .*, wanted 1e-12, max-steps=1; \|R\| = "):
        Model(bar, Solver(max_steps=1)).solve(bar.parameters.start)


@pytest.mark.parametrize(("name", "warned"), [("faulty-adjoint[fault=sign]", True), ("adjoint", False)])
def test_a_wrong_gradient_far_below_J_is_warned_of(cli, name: str, warned: bool) -> None:
    """Its error, relative to the terms of J, is 1e-14; the estimated one is 2."""
    problem = "block[n=2,traction=1e-14]"
    (row,) = cli("run", "--json", "--no-store", "--no-timing", "--problem", problem, "--route", name).rows
    assert row["gradient_error"] < 1e-12
    assert (row["gradient_error_estimate"] > 1) is warned
    assert ("the estimated error is 2 of the gradient" in (row["note"] or "")) is warned
