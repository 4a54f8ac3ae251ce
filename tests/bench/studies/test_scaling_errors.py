"""Scaling of the error: an adjoint solver that squares the condition number is found where it fails, and only there."""

from __future__ import annotations

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from gradient_routes.bench.api import run
from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.studies.scaling.growing_error import growing
from gradient_routes.bench.studies.scaling.measure import Scaling, scaling
from gradient_routes.bench.studies.scaling.sizes import sizes
from gradient_routes.bench.studies.scaling.view import show
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Offers, Result, Route, Work, route


def cost(n_p: int, forward: ForwardWork) -> Work:
    return forward.cold


@route("squared", needs=Offers.LINEARIZE, cost=cost)
def squared(model: Model, p: Array) -> Result:
    """R_u R_u lam = -R_u J_u by conjugate gradients."""
    state = model.solve(p)
    lin, K = model.linearize(state), model.tangent(state.u, p)
    lam, r = np.zeros_like(state.u), -(K @ lin.J_u)
    d, wanted = r, 1e-7 * np.linalg.norm(r)
    for _ in range(4 * len(r)):
        if np.linalg.norm(r) <= wanted:
            break
        KKd = K @ (K @ d)
        a = r @ r / (d @ KKd)
        lam, r_next = lam + a * d, r - a * KKd
        d, r = r_next + r_next @ r_next / (r @ r) * d, r_next
    return Result(state.J, lin.J_p + lin.R_p.T @ lam, state.u, state.residual, lam)


def study(of: Route) -> Scaling:
    asked = sizes(case.problems(["bar[n=25|50|100|200|400]"]), None, 2.0, 3)
    specs = [RouteSpec(of.name, of, of.defaults)]
    return scaling(asked, specs, Settings(min_time=0.0), race=lambda *given: ([], None))


def test_a_solver_that_squares_the_condition_number_is_named_where_its_error_grows() -> None:
    done = study(squared)
    errors = [row["gradient_error"] for row in done.rows]
    assert errors[0] < 1e-3 < 0.1 < errors[-1]
    said = list(growing(done.sizes, done.series[0]))
    assert said
    for sentence in said:
        assert "where the adjoint's residual is " in sentence
    out = StringIO()
    show(Console(file=out, width=200), done, plotted=False)
    assert f"note: squared: {said[0]}" in out.getvalue()


def test_a_sound_adjoint_has_no_growing_error() -> None:
    done = study(adjoint)
    assert [row["status"] for row in done.rows] == ["ok"] * 5
    assert list(growing(done.sizes, done.series[0])) == []


def test_an_adjoint_that_is_not_solved_is_a_note_and_a_column() -> None:
    row = run("bar[n=100]", squared, timing=False).iloc[0]
    assert row["adjoint_residual"] > 1e-9
    assert f"squared: |R_u^T lam + J_u| / |J_u| = {row['adjoint_residual']:.2g}, wanted 1e-12: " in row["note"]


@pytest.mark.parametrize(
    ("problem", "solver"),
    [(name, solver) for name in ("bar[n=20]", "block[n=2]") for solver in ("auto", "krylov", "cg-amg")]
    + [("advection[n=4]", "auto"), ("advection[n=4]", "krylov")],
)
def test_every_solver_reports_the_residual_of_its_adjoint(problem: str, solver: str) -> None:
    if solver == "cg-amg":
        pytest.importorskip("pyamg")
    rows = run(problem, ["adjoint", "implicit-ad", "tangent"], timing=False, linear_solver=solver, rtol=1e-9)
    assert list(rows["status"]) == ["ok"] * 3, list(rows["reason"])
    assert (rows["adjoint_residual"][:2] <= 1.01e-12).all()
    assert rows["adjoint_residual"].isna().tolist() == [False, False, True]


def test_a_stale_adjoint_says_so() -> None:
    row = run("block[n=2]", "adjoint[factors=stale]", timing=False).iloc[0]
    assert row["adjoint_residual"] > 1e-9
    assert "the adjoint is not solved" in row["note"]
