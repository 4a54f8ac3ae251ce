"""Columns of the table `horizon`."""

from __future__ import annotations

from gradient_routes.bench.cases.column import PROBLEM, Column

HORIZON = (
    *PROBLEM,
    Column("spread", "REAL", "1", "half of the interval of p along v, in natural changes"),
    Column("places", "INTEGER", "1", "places in it"),
    Column("steps", "INTEGER", "1", "T of the march"),
    Column("status", "TEXT", "", "ok, skipped or failed"),
    Column("reason", "TEXT", "", "why it was skipped or failed"),
    Column("objective", "REAL", "problem's", "J at p"),
    Column("gradient_norm", "REAL", "problem's", "|dJ/dp|_2 in natural changes of p, at p"),
    Column("slope", "REAL", "problem's", "dJ/dp . v at p, v a random direction in natural changes"),
    Column("slope_mean", "REAL", "problem's", "mean of the slopes in the interval"),
    Column("slope_scatter", "REAL", "problem's", "their standard deviation"),
    Column("quotient", "REAL", "problem's", "difference of J over the interval / its length"),
    Column("flips", "INTEGER", "1", "steps whose active set differs between its ends; NULL where there are no sets"),
    Column("energy_growth", "REAL", "1", "largest energy after the load / that at its end - 1; NULL if unknown"),
    Column("verdict", "TEXT", "", "smooth, noisy or biased: what slopes say of the quotient"),
)
