"""The tidy tables of studies: one line a measured point, columns with types, units and meanings."""

from __future__ import annotations

from bench.rows import Column

KEY = Column("study_id", "INTEGER", "", "of the row in studies")
STUDY = (
    Column("study_id", "INTEGER PRIMARY KEY", "", "counts the studies of this store"),
    Column("study", "TEXT", "", "name of the table that holds its rows"),
    Column("environment_id", "TEXT", "", "of the row in environments"),
    Column("started", "TEXT", "UTC", "when it began, ISO 8601"),
)

PROBLEM = (
    Column("problem", "TEXT", "", "name of the problem"),
    Column("problem_options", "TEXT", "", "its options, defaults included", json=True),
    Column("at", "TEXT", "", "the p it was studied at: start, true or a file"),
    Column("n_state", "INTEGER", "1", "n_u, free unknowns"),
    Column("n_param", "INTEGER", "1", "n_p, parameters"),
)
JUDGED = (
    Column("status", "TEXT", "", "ok, skipped or failed"),
    Column("reason", "TEXT", "", "why it was skipped or failed"),
    Column("objective", "REAL", "problem's", "J"),
    Column("objective_error", "REAL", "1", "|J - J_ref| / |J_ref|, J_ref solved for directly to 1e-13"),
    Column("gradient_error", "REAL", "1", "|g - g_ref|_2 / |g_ref|_2, where judged in directions V: of V^T g"),
    Column("reference", "TEXT", "", "where g_ref comes from"),
    Column("residual", "REAL", "1", "|R(u, p)|_inf / |R(u_0, p)|_inf achieved"),
)

TOLERANCE = (
    *PROBLEM,
    Column("linear_solver", "TEXT", "", "of the forward and the linearized solves"),
    Column("sweep", "TEXT", "", "which tolerance was varied: forward, adjoint or both"),
    Column("route", "TEXT", "", "name of the route"),
    Column("route_options", "TEXT", "", "its options, as resolved at this tolerance", json=True),
    Column("rtol", "REAL", "1", "tolerance of forward solves; NULL where the route was skipped as a whole"),
    Column("adjoint_rtol", "REAL", "1", "tolerance of linearized and adjoint solves"),
    *JUDGED,
    Column("adjoint_residual", "REAL", "1", "|R_u^T lam + J_u|_inf / |J_u|_inf, of routes that give lam"),
)

STUDIES: dict[str, tuple[Column, ...]] = {
    "tolerance": TOLERANCE,
}
