"""Columns of the table `tolerance`."""

from __future__ import annotations

from gradient_routes.bench.cases.column import JUDGED, PROBLEM, Column

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
