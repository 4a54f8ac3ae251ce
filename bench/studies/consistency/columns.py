"""Columns of the tables `consistency` and `consistency_steps`."""

from __future__ import annotations

from gradient_routes.bench.cases.column import WHAT, Column

RUN = (*WHAT, Column("optimizer", "TEXT", "", "lbfgs or descent"))

CONSISTENCY = (
    *RUN,
    Column("n_state", "INTEGER", "1", "n_u, free unknowns"),
    Column("n_param", "INTEGER", "1", "n_p, parameters"),
    Column("status", "TEXT", "", "ok, skipped or failed"),
    Column("reason", "TEXT", "", "why it was skipped or failed"),
    Column("error_start", "REAL", "1", "|g - g_true|_2 / |g_true|_2 at the start, g_true by the adjoint route"),
    Column("error_end", "REAL", "1", "the same at the end"),
    Column("iterations", "INTEGER", "1", "accepted steps"),
    Column("evaluations", "INTEGER", "1", "of J and its gradient"),
    Column("objective_start", "REAL", "problem's", "J at the start"),
    Column("objective", "REAL", "problem's", "J at the end"),
    Column("objective_minimum", "REAL", "problem's", "least J of all runs, one to 1e-12 by the adjoint route included"),
    Column("above_minimum", "REAL", "problem's", "objective - objective_minimum"),
    Column("gradient_norm_start", "REAL", "problem's", "|g_true|_2 at the start"),
    Column("gradient_norm", "REAL", "problem's", "|g_true|_2 at the end"),
    Column("own_gradient_norm", "REAL", "problem's", "|g|_2 at the end, by the route itself"),
    Column("step_length", "REAL", "1", "of the last accepted step, in natural changes of p"),
    Column(
        "shortest_step", "REAL", "1", "the shortest that a line search tried before it stalled; NULL where it did not"
    ),
    Column("outcome", "TEXT", "", "converged, stalled, or not converged"),
    Column("ended", "TEXT", "", "why it stopped, as `routes invert` says it"),
)

STEPS = (
    *RUN,
    Column("iteration", "INTEGER", "1", "accepted steps so far; 0: the start"),
    Column("forward_solves", "INTEGER", "1", "so far"),
    Column("objective", "REAL", "problem's", "J"),
    Column("above_minimum", "REAL", "problem's", "J less the least J of all runs"),
    Column("own_gradient_norm", "REAL", "problem's", "|g|_2 by the route"),
    Column("step_length", "REAL", "1", "in natural changes of p"),
)
