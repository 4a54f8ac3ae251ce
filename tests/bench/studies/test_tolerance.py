"""Loose solves: how far gradients are off, by which tolerance, and what the command says of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.declared import with_declared
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.tolerance.columns import TOLERANCE
from gradient_routes.bench.studies.tolerance.measure import (
    Experiment,
    Tolerance,
    ToleranceSweep,
    decades,
    default_solver,
    tolerance,
)
from gradient_routes.bench.studies.tolerance.view import estimates, order, remarks
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.routes.solvers.iterative import DESCENT, solver
from gradient_routes.routes.solvers.registry import linear_solver

ROUGH = "bar[n=24,sensors=24,noise=0.01]"  # at its true moduli conjugate gradients take many steps, not n


LOOSE = ToleranceSweep((1e-2,))


def study(problem: str, *routes: str, sweep: ToleranceSweep | None = None, **options) -> Tolerance:
    (spec,) = case.problems([problem])
    return tolerance(spec, case.routes(routes), sweep or ToleranceSweep(decades(1e-1, 1e-13)), **options)


def column(done: Tolerance, name: str, route: str = "adjoint") -> np.ndarray:
    return np.array([row[name] for row in done.rows if row["route"] == route], dtype=float)


@pytest.mark.parametrize(("problem", "at", "linear_solver"), [("bar", "start", "descent"), (ROUGH, "true", "krylov")])
def test_the_adjoints_error_falls_with_the_tolerance_and_is_not_the_residual(
    problem: str, at: str, linear_solver
) -> None:
    done = study(problem, "adjoint", at=at, linear_solver=linear_solver)
    error, residual, rtol = (column(done, name) for name in ("gradient_error", "residual", "rtol"))
    assert (residual <= rtol).all()
    assert (column(done, "adjoint_residual") <= 2 * rtol).all()  # 2: the last is rounding
    assert error[0] > 1e-3 > 1e-9 > error[-1]
    assert (error[1:] <= 3 * error[:-1]).all()  # 3: not every iterate is better than the one before
    ratio = error / residual
    assert ratio.max() > 10, "the residual is no bound of the error: cond(K) stands between"


def test_routes_are_wrong_in_their_own_ways() -> None:
    routes, sweep = ("adjoint", "implicit-ad", "complex-step", "fd-central"), ToleranceSweep((1e-1, 1e-3, 1e-5, 1e-13))
    done = study("bar", *routes, sweep=sweep, linear_solver=None)
    assert done.linear_solver == "descent"
    errors = {route: column(done, "gradient_error", route) for route in ("adjoint", "implicit-ad", "complex-step")}
    np.testing.assert_allclose(errors["adjoint"], errors["implicit-ad"], rtol=1e-3)
    loose = slice(0, 3)
    np.testing.assert_allclose(
        column(done, "gradient_error", "fd-central")[loose], errors["complex-step"][loose], rtol=1e-2
    )  # both differentiate the iterate
    assert column(done, "gradient_error", "fd-central").min() > 10 * errors["complex-step"].min()  # noise / h


def test_unrolled_ad_iterates_longer_the_tighter_the_tolerance() -> None:
    """Two of the tolerances: every k compiles anew."""
    done = study("bar", "unrolled-ad", sweep=ToleranceSweep((1e-1, 1e-8)), linear_solver=None)
    assert done.linear_solver == "descent"
    k = [row["route_options"]["iterations"] for row in done.rows]
    assert {row["route_options"]["inner"] for row in done.rows} == {"richardson"}
    assert k == sorted(k)
    assert k[0] < k[-1] / 10


@pytest.mark.parametrize("problem", ["bar", "block[n=2,law=linear]"])
def test_the_adjoint_tolerance_alone_spoils_the_gradient_and_not_J(problem: str) -> None:
    done = study(problem, "adjoint", "tangent", sweep=ToleranceSweep((1e-2, 1e-5), forward=1e-13))
    for route in ("adjoint", "tangent"):
        assert (column(done, "objective_error", route) < 1e-9).all()
        error = column(done, "gradient_error", route)
        assert error[0] > 1e-4
        assert error[0] > 10 * error[1]
    both = study(problem, "adjoint", sweep=ToleranceSweep((1e-2, 1e-5), adjoint=1e-13))
    assert (column(both, "adjoint_residual") < 1e-12).all()
    assert column(both, "objective_error")[0] > 1e-4


def test_nonlinear_problems_are_solved_as_ever() -> None:
    assert (default_solver(Block(n=2)), default_solver(Bar(n=33)), default_solver(Bar())) == (
        "auto",
        "krylov",
        "descent",
    )
    done = study("block[n=2]", "adjoint", sweep=ToleranceSweep((1e-1, 1e-12)))
    assert column(done, "gradient_error")[0] > 1e-3 > 1e-9 > column(done, "gradient_error")[1]


def test_what_cannot_run_or_fails_is_a_row_with_its_reason(monkeypatch) -> None:
    done = study(
        "block[n=2]", "unrolled-ad[inner=jacobi]", "adjoint", sweep=ToleranceSweep((1e-2,)), linear_solver="descent"
    )
    skipped, loose = done.rows
    assert (skipped["status"], skipped["rtol"]) == ("skipped", None)
    assert "iterates on linear problems" in skipped["reason"]
    assert (loose["status"], loose["reason"]) == ("ok", None)
    dear = study("bar", "fd-central", sweep=ToleranceSweep((1e-3,)), budget=1e-9)
    assert dear.rows[0]["status"] == "skipped"
    assert "--budget inf" in dear.rows[0]["reason"]
    singular = study("bar", "adjoint", "fd-central[step=1e3]", sweep=ToleranceSweep((1e-2, 1e-3)))
    assert [row["status"] for row in singular.rows] == ["ok", "ok", "failed", "failed"]
    (line,) = remarks(singular.rows)
    assert line.plain.startswith("failed at 0.01, 0.001: fd-central")
    shorter = solver("descent", replace(DESCENT, at_most=200), gradual=True)
    monkeypatch.setattr(
        "gradient_routes.routes.solvers.factorization.linear_solver",
        lambda name: shorter if name == shorter.name else linear_solver(name),
    )
    unmet = study("bar", "adjoint", sweep=ToleranceSweep((1e-1, 1e-12)), linear_solver="descent").rows
    assert [row["status"] for row in unmet] == ["ok", "failed"]
    assert unmet[1]["reason"].startswith("bar: steepest descent: |b - A x| = ")


@pytest.mark.parametrize(("problem", "advised"), [("bar[stop=penalty]", True), ("bar[stop=multiplier]", False)])
def test_descent_is_advised_where_it_ends(cli, problem: str, advised: bool) -> None:
    out = cli("tolerance", "--problem", problem, "--route", "adjoint", "--tightest", "1e-2", "--no-plot").out
    assert "note: forward solves are exact at the loosest tolerance" in out
    assert ("--linear-solver descent" in out) == advised


@pytest.mark.parametrize("verb", ["tolerance", "unrolling"])
def test_a_problem_that_cannot_be_solved_is_one_line(cli, verb: str) -> None:
    hopeless = (verb, "--problem", "bar[stop=penalty,k_c=1e20]")
    ran = cli(*hopeless)
    assert (ran.code, ran.out, ran.err.count("\n")) == (1, "", 1)
    assert ran.err.startswith("routes: bar: not converged in 50 steps")
    assert "NotConverged" in cli(*hopeless, "--debug").err


def test_an_interrupt_leaves_what_was_measured(cli, monkeypatch) -> None:
    measure, left = Experiment._point, iter(range(4))

    def interrupted(*arguments):
        if next(left) == 3:
            raise KeyboardInterrupt
        return measure(*arguments)

    monkeypatch.setattr(Experiment, "_point", interrupted)
    arguments = ("tolerance", "--problem", "bar", "--route", "adjoint", "--route", "tangent", "--tightest", "1e-2")
    ran = cli(*arguments)
    assert (ran.code, ran.err.count("\n")) == (130, 1)
    assert ran.err.startswith("routes: interrupted - what is finished is printed, and kept")
    table = ran.out[ran.out.index("tolerance residual") :].splitlines()
    assert [len(line.split()) for line in table[1:3]] == [6, 5]
    assert len(Store(Path("results/routes.sqlite")).table("tolerance")[1]) == 3


def test_the_command_prints_rows_and_keeps_them(cli) -> None:
    arguments = ("tolerance", "--problem", "bar", "--route", "adjoint", "--route", "fd-central", "--tightest", "1e-3")
    ran = cli(*arguments, "--json")
    assert (ran.code, ran.err) == (0, "")
    assert len(ran.rows) == 2 * 3
    for row in ran.rows:
        assert list(row) == ["table", *sorted_as(row)]
        assert row["table"] == "tolerance"
        assert row["status"] == "ok"
        assert row["gradient_error"] > 0 < row["residual"] <= row["rtol"] == row["adjoint_rtol"]
    names, kept = Store(Path("results/routes.sqlite")).table("tolerance")
    assert names == ["study_id", *(c.name for c in with_declared(TOLERANCE))]
    assert [record[names.index("gradient_error")] for record in kept] == [row["gradient_error"] for row in ran.rows]
    exported = json.loads(cli("export", "--table", "tolerance", "--format", "json").out)
    assert len(exported) == 6


def sorted_as(row: dict) -> list[str]:
    """The columns of the table, in the order of the row: none is missing, none is too many."""
    assert {c.name for c in TOLERANCE} == row.keys() - {"table"}
    return [name for name in row if name != "table"]


def test_the_screen_shows_a_plot_and_residuals_beside_errors(cli) -> None:
    ran = cli(
        "tolerance", "--problem", "bar", "--route", "adjoint", "--no-store", "--loosest", "1e-2", "--tightest", "1e-4"
    )
    assert ran.code == 0
    assert "bar: |g - g_ref| / |g_ref|" in ran.out
    assert "A adjoint" in ran.out
    table = ran.out[ran.out.index("tolerance residual") :].splitlines()
    assert [line.split()[0] for line in table[1:5]] == ["0.01", "0.001", "0.0001", "floor"]
    only = cli(
        "tolerance", "--problem", "bar", "--route", "adjoint", "--no-store", "--tightest", "1e-2", "--no-plot"
    ).out
    assert "A adjoint" not in only
    assert "note:" not in only
    direct = ("--linear-solver", "auto", "--no-plot", "--tightest", "1e-2", "--no-store")
    assert "note: forward solves are exact" in cli("tolerance", "--problem", "bar", "--route", "adjoint", *direct).out


WRONG = {
    "--route adjiont": "did you mean 'adjoint'?",
    "--loosest 2": "--loosest 2 - give a number > 0 and < 1",
    "--loosest 1e-9 --tightest 1e-3": "give 1 > loosest >= tightest > 0",
    "--tightest 0": "--tightest 0 - give a number > 0 and < 1",
    "--per-decade 0": "give a whole number from 1 to 1000",
    "--rtol 1e-9": "add --sweep adjoint",
    "--sweep both --adjoint-rtol 1e-9": "take --sweep forward",
    "--adjoint-rtol 3": "--adjoint-rtol 3 - give a number > 0 and < 1",
    "--budget 0": "--budget",
    "--problem bar[n=8|9]": "names 2 problems",
    "--linear-solver gauss": "'gauss'",
}


@pytest.mark.parametrize("arguments", WRONG)
def test_wrong_usage_is_one_line(cli, arguments: str) -> None:
    ran = cli("tolerance", "--problem", "bar", "--no-store", *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert WRONG[arguments] in ran.err


def test_estimates_come_near_the_errors_and_the_corrected_adjoint_is_of_second_order() -> None:
    done = study("bar", "adjoint", "adjoint[correct=yes]", sweep=ToleranceSweep(decades(1e-1, 1e-8)))
    ratio = column(done, "gradient_error_estimate") / column(done, "gradient_error")
    loose = column(done, "gradient_error") > 1e-12
    assert loose.sum() >= 10
    assert ((ratio > 1 / 3) & (ratio < 3))[loose].all()
    assert estimates(done.rows).startswith("estimated error / error: ")
    assert estimates(done.rows).endswith(f"for {loose.sum()} of {loose.sum()} errors above 1e-12")
    assert order(done.rows) == "the error of adjoint[correct=yes] falls like that of adjoint to the power 2"
    assert order([row for row in done.rows if row["route_options"]["correct"] == "no"]) == ""
