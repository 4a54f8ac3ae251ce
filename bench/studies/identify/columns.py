"""Columns of what the data determine: spectra, parameters, experiments, sensor placement."""

from __future__ import annotations

from gradient_routes.bench.cases.column import PLACE, PROBLEM, Column

EXPERIMENT = (
    *PROBLEM,
    Column("experiment", "TEXT", "", "selector of the problem, as a person reads it"),
)

SPECTRUM = (
    *EXPERIMENT,
    Column("index_", "INTEGER", "1", "k, largest first"),
    Column("singular_value", "REAL", "problem's", "of H = d(S u)/dp times natural changes of p"),
    Column("relative_to_noise", "REAL", "1", "singular_value / sigma; NULL where no noise is known"),
    Column("identifiable", "INTEGER", "1", "1 where above the noise, or above rounding where there is none"),
)

IDENTIFIED = (
    *EXPERIMENT,
    Column("parameter", "TEXT", "", "its name"),
    *PLACE,
    Column("column_norm", "REAL", "problem's", "|H e_i|, of a natural change of it"),
    Column("kind", "TEXT", "", "seen, weak (below the noise) or blind (exactly zero)"),
    Column("null_share", "REAL", "1", "|P_0 e_i|^2, P_0 onto the directions that are not identifiable"),
    Column("posterior_sd", "REAL", "its own", "standard deviation after the data, Gaussian; NULL where unbounded"),
    Column("prior_sd", "REAL", "its own", "before them; NULL where there is no prior"),
)

EXPERIMENTS = (
    *EXPERIMENT,
    Column("data", "INTEGER", "1", "m"),
    Column("sigma", "REAL", "problem's", "of the noise"),
    Column("rank", "INTEGER", "1", "identifiable directions"),
    Column("blind", "INTEGER", "1", "parameters no datum depends on"),
    Column("weak", "INTEGER", "1", "parameters below the noise"),
    Column("gained", "INTEGER", "1", "rank less that of the first experiment"),
)

PLACEMENT = (
    *EXPERIMENT,
    Column("criterion", "TEXT", "", "D: log det, A: trace of the posterior covariance"),
    Column("step", "INTEGER", "1", "sensors chosen so far"),
    Column("sensor", "TEXT", "", "what is read"),
    *PLACE,
    Column("value", "REAL", "1", "of the criterion with it"),
    Column("rank", "INTEGER", "1", "identifiable directions with it"),
)
