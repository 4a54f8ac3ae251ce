"""Unrolled AD iteration by iteration: where it meets implicit AD, what its tape is made of."""

from __future__ import annotations

from pathlib import Path

import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.registry import study_tables
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.unrolling.measure import ROUNDING, Unrolling, unrolling

TABLES = ("unrolling", "unrolling_fits")


def study(problem: str, **options) -> Unrolling:
    (spec,) = case.problems([problem])
    return unrolling(spec, **options)


@pytest.fixture(scope="module")
def jacobi() -> Unrolling:
    return study("bar[n=2]", inner="jacobi", checkpoint=8)


def test_it_meets_implicit_ad_once_converged() -> None:
    done = study("bar[n=4]")
    assert done.meets == 4, "conjugate gradients end after n_u steps"
    last = done.iterates[-1]
    assert last.gradient_error <= done.enough == ROUNDING  # implicit AD's own error is 2e-16
    assert [p.iterations for p in done.iterates] == [1, 2, 3, 4]
    assert all(p.gradient_error > 0.1 for p in done.iterates[:-1])


def test_the_least_k_is_found(jacobi: Unrolling) -> None:
    plain = {p.iterations: p for p in jacobi.iterates if p.checkpoint is None}
    assert plain[jacobi.meets].gradient_error <= jacobi.enough < plain[jacobi.meets - 1].gradient_error
    errors = [plain[2**j].gradient_error for j in range(4, 8)]
    assert errors == sorted(errors, reverse=True)


def test_the_fitted_slope_is_the_tape_of_an_iteration(jacobi: Unrolling, cli) -> None:
    """As `routes run` divides it, once the fixed part no longer counts; checkpoints keep a share of 1 / C."""
    every, thinned = jacobi.curves
    run = ("run", "--json", "--no-store", "--min-time", "0", "--problem", "bar[n=2]")
    (row,) = cli(*run, "--route", "unrolled-ad[inner=jacobi,iterations=2000]").rows
    assert every.bytes_per_iteration == pytest.approx(row["tape_bytes_per_iteration"], rel=0.02)
    assert every.fit_residual < 1e-6
    assert thinned.bytes_per_iteration == pytest.approx(every.bytes_per_iteration / 8, rel=0.02)
    assert thinned.products_ratio == pytest.approx(1.5)
    assert thinned.tape_ratio < 0.5
    assert thinned.time_ratio > 0


def test_newton_steps_are_counted_one_by_one() -> None:
    done = study("block[n=2]")
    assert (done.inner, done.meets) == ("direct", 5)
    assert [p.iterations for p in done.iterates] == [1, 2, 3, 4, 5]


def test_it_may_never_meet() -> None:
    done = study("bar", inner="jacobi", max_iterations=5)
    assert done.meets is None
    assert [p.iterations for p in done.iterates] == [1, 2, 4, 5]
    dear = study("bar", budget=1e-9)
    assert [p.status for p in dear.iterates] == ["skipped"]
    assert dear.curves[0].bytes_per_iteration is None


def test_the_command_prints_rows_and_keeps_them(cli) -> None:
    ran = cli("unrolling", "--problem", "bar[n=2]", "--json")
    assert (ran.code, ran.err) == (0, "")
    for row in ran.rows:
        assert row.keys() - {"table"} == {c.name for c in study_tables()[row["table"]].columns}
    assert {row["table"] for row in ran.rows} == set(TABLES)
    for name in TABLES:
        _, kept = Store(Path("results/routes.sqlite")).table(name)
        assert len(kept) == sum(row["table"] == name for row in ran.rows)


def test_the_screen_tells_where_they_meet(cli) -> None:
    out = cli("unrolling", "--problem", "bar[n=2]", "--checkpoint", "2", "--no-store").out
    for words in (
        "g g",
        "T all kept",
        "C one in 2 kept",
        "meets implicit-ad at k = 2",
        "an iteration",
        "products x 1.5",
    ):
        assert words in out
    out = cli("unrolling", "--problem", "bar", "--max-iterations", "2", "--no-store", "--no-plot").out
    assert "does not meet implicit-ad up to k = 2" in out
    assert "T all kept" not in out


WRONG = {
    "--checkpoint 0": "--checkpoint 0 - give a whole number from 1",
    "--max-iterations 0": "give a whole number from 1",
    "--within 0.5": "give a number >= 1",
    "--budget nan": "--budget",
    "--inner newton": "'newton'",
    "--inner direct --checkpoint 4": "inner=direct",
    "--problem block[n=1] --inner jacobi": "is nonlinear - take inner=cg",
    "--problem all": "names 10 problems",
}


@pytest.mark.parametrize("arguments", WRONG)
def test_wrong_usage_is_one_line(cli, arguments: str) -> None:
    ran = cli("unrolling", "--problem", "bar", "--no-store", *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert WRONG[arguments] in ran.err
