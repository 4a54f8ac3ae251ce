"""Columns of inversions: iterations, estimates, L-curves, bias and variance."""

from __future__ import annotations

from gradient_routes.bench.cases.column import PLACE, PROBLEM, Column

RUN = (
    *PROBLEM,
    Column("route", "TEXT", "", "name of the route that gives gradients"),
    Column("route_options", "TEXT", "", "its options", json=True),
    Column("optimizer", "TEXT", "", "lbfgs, gauss-newton, levenberg-marquardt, trust, descent, adam or linear"),
    Column("alpha", "REAL", "1", "weight of Phi in J"),
    Column("label", "TEXT", "", "selector of problem and route, as a person reads them"),
)

INVERSION = (
    *RUN,
    Column("iteration", "INTEGER", "1", "accepted steps so far; 0: the start"),
    Column("objective", "REAL", "problem's", "J"),
    Column("misfit", "REAL", "problem's", "1/2 |S u - d|^2"),
    Column("regularization", "REAL", "problem's", "alpha Phi"),
    Column("gradient_norm", "REAL", "problem's", "|dJ/dp|_2"),
    Column("step_length", "REAL", "1", "|x_k - x_(k-1)|_2, x being p in natural changes"),
    Column("forward_solves", "INTEGER", "1", "so far"),
    Column("adjoint_solves", "INTEGER", "1", "linearized and transposed solves so far, Newton steps left out"),
    Column("seconds", "REAL", "s", "so far"),
    Column("distance", "REAL", "1", "|p - p_true| / |p_0 - p_true|, where the truth is known"),
    Column("discrepancy", "REAL", "1", "|S u - d| / (sigma sqrt(m)): 1 where the data are met to their noise"),
    Column("chosen", "TEXT", "", "discrepancy: the first step that meets them so, where that principle stops"),
    Column("ending_solves", "INTEGER", "1", "forward solves after the last step, to explain or to confirm the end"),
    Column("says", "TEXT", "", "what happened there: a stall, a step out of the domain, why it stopped"),
)

ESTIMATES = (
    *RUN,
    Column("parameter", "TEXT", "", "its name"),
    *PLACE,
    Column("start", "REAL", "its own", "p_0"),
    Column("estimate", "REAL", "its own", "p at the end"),
    Column("sd", "REAL", "its own", "its standard deviation by the noise of measured data"),
    Column("truth", "REAL", "its own", "p behind synthetic data"),
    Column("gradient", "REAL", "problem's", "dJ/dp at the end"),
    Column("blind", "INTEGER", "1", "1 where no datum depends on it"),
    Column("view", "TEXT", "", "what its problem shows beside it at the end: of the bar E and the strains", json=True),
)

LCURVE = (
    *RUN,
    Column("misfit", "REAL", "problem's", "1/2 |S u - d|^2 at the minimum of J"),
    Column("phi", "REAL", "1", "Phi there"),
    Column("curvature", "REAL", "1", "of log Phi over log misfit"),
    Column("discrepancy", "REAL", "1", "|S u - d| / (sigma sqrt(m)): 1 where the data are met to their noise"),
    Column("distance", "REAL", "1", "|p - p_true| / |p_0 - p_true|"),
    Column("iterations", "INTEGER", "1", "of the optimizer"),
    Column("forward_solves", "INTEGER", "1", "they took"),
    Column("chosen", "TEXT", "", "corner, discrepancy, or both"),
    Column("ended", "TEXT", "", "why the optimizer stopped there"),
)

TRADEOFF = (
    *RUN,
    Column("draws", "INTEGER", "1", "noises drawn"),
    Column("bias", "REAL", "1", "|mean p - p_true|^2 / n_p, over the draws"),
    Column("variance", "REAL", "1", "mean |p - mean p|^2 / n_p"),
    Column("total", "REAL", "1", "their sum: mean |p - p_true|^2 / n_p"),
    Column("mean", "TEXT", "its own", "mean p, over the draws, parameter by parameter", json=True),
    Column("sd", "TEXT", "its own", "sqrt(mean (p - mean p)^2), likewise", json=True),
)

FIT = (
    *RUN,
    Column("data", "INTEGER", "1", "how many were measured"),
    Column("outliers", "INTEGER", "1", "of them, residuals beyond 5 standard deviations"),
    Column("freedom", "REAL", "1", "data without outliers, less what was fitted to them"),
    Column("rms", "REAL", "the data's", "root mean square of residuals, per degree of freedom, without outliers"),
    Column("noise", "REAL", "the data's", "standard deviation of the noise"),
    Column("noise_source", "TEXT", "", "stated, or what it was estimated from"),
    Column("chi2", "REAL", "1", "(rms / noise)^2"),
    Column("moran", "REAL", "1", "Moran's I of residuals: 0 without correlation in space, 1 where neighbours agree"),
    Column("moran_z", "REAL", "1", "standard deviations of it above chance"),
    Column("verdict", "TEXT", "", "explained, or why the model does not explain the data"),
)

CONSTANTS = (
    *RUN,
    Column("constant", "TEXT", "", "as people state it, with its unit, or a parameter"),
    Column("value", "REAL", "its own", "at the end"),
    Column("sd", "REAL", "its own", "its standard deviation by the noise; none where data do not see it"),
    Column("third_1", "REAL", "its own", "what the first third of the data along their longest extent says alone"),
    Column("third_2", "REAL", "its own", "the second"),
    Column("third_3", "REAL", "its own", "the last"),
    Column("bound", "TEXT", "", "of its domain, where it has gone there"),
    Column("correlations", "TEXT", "1", "with the others, by name", json=True),
)

RESIDUALS = (
    *RUN,
    Column("datum", "TEXT", "", "its name"),
    Column("quantity", "TEXT", "", "what it is: ux, uy, a mode of loading"),
    *PLACE,
    Column("measured", "REAL", "its own", "d"),
    Column("residual", "REAL", "its own", "S u - d at the end, without the motion that is eliminated"),
    Column("standardized", "REAL", "1", "residual / noise"),
    Column("outlier", "INTEGER", "1", "1 where it is beyond 5 standard deviations"),
)
