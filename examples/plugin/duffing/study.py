"""Is R_u symmetric? Then a transposed solve is a plain one. A study in one file."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes import Column, Found, Kept, Model, Say, Study, Table, at_option, problem_at, problem_option

COLUMNS = (
    Column("problem", "TEXT", "", "selector of the problem"),
    Column("at", "TEXT", "", "the p it was asked at: start, true or a file"),
    Column("n_state", "INTEGER", "1", "n_u, free unknowns"),
    Column("asymmetry", "REAL", "1", "|R_u v - R_u^T v| / |R_u v|, the largest of 8 random directions v"),
)

STUDY = Study(
    name="symmetry",
    question="Is R_u symmetric at the solved state, so that a transposed solve is a plain one?",
    help="Exit code: 0 symmetric to rounding, 1 not, 2 wrong usage.",
    options=(problem_option, at_option),
    tables={"symmetry": Table(COLUMNS, question=("problem", "at"))},
    run="duffing.study:run",
    view="duffing.study:show",
    plots=False,
)


def run(say: Say, *, selector: str, at: str, **others: Any) -> int:
    problem, p = problem_at(selector, at)
    state = Model(problem).solve(p)
    R_u = problem.tangent(state.u, p)
    V = np.random.default_rng(0).standard_normal((8, problem.n_state))
    off = max(float(np.linalg.norm(R_u @ v - R_u.T @ v) / np.linalg.norm(R_u @ v)) for v in V)
    row = {"problem": selector, "at": at, "n_state": problem.n_state, "asymmetry": off}
    say(Kept("symmetry", row))
    say(Found(row))
    return 0 if off < 1e-12 else 1


def show(out: Any, row: dict[str, Any], plots: bool) -> None:
    out.print(f"{row['problem']}: |R_u v - R_u^T v| / |R_u v| = {row['asymmetry']:.2g}")
