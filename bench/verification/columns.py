"""Columns of a check: one row for the verdict, one for every step of every line."""

from __future__ import annotations

from gradient_routes.bench.cases.column import WHAT, Column

CHECKS = (
    *WHAT,
    Column("verdict", "TEXT", "", "agrees, wrong-gradient, inconsistent-discretization, solver-limited ..."),
    Column("says", "TEXT", "", "the verdict in one sentence, with the numbers it rests on"),
    Column("next", "TEXT", "", "the next thing to do"),
    Column("floor", "REAL", "1", "least relative error of the deciding line's quotients"),
    Column("best_step", "REAL", "1", "step there, relative to max(|p_i|, s_i)"),
    Column("slope_one_sided", "REAL", "1", "of log error over log step on the truncation branch: 1"),
    Column("slope_central", "REAL", "1", "the same of central quotients: 2"),
    Column("roundoff_slope", "REAL", "1", "the same on the round-off branch: -1"),
    Column("window", "REAL", "decade", "steps with an error below 1e-3"),
    Column("noise", "REAL", "problem's", "standard deviation of one evaluation of J"),
    Column("plateau", "REAL", "1", "difference of gradient and quotients that no step removes"),
    Column("tightened_plateau", "REAL", "1", "the same with the forward solve tightened"),
    Column("refined_plateau", "REAL", "1", "|(g - exact) w| / |exact w| on a mesh of half the size"),
    Column("order_in_mesh_size", "REAL", "1", "k of a plateau ~ h^k"),
    Column(
        "active_set_changes",
        "INTEGER",
        "1",
        "inside the stencil of the deciding line; of a march, steps whose set flips",
    ),
    Column("culprit", "TEXT", "", "the factor, component or functional that is wrong"),
    Column("worst_components", "TEXT", "", "wrong components: given and found", json=True),
    Column("findings", "TEXT", "", "second evidence: name, value, limit", json=True),
    Column("calls", "INTEGER", "1", "objective calls"),
    Column("gradient_calls", "INTEGER", "1", "gradient calls"),
    Column("remarks", "TEXT", "", "what was odd about the subject", json=True),
)

POINTS = (
    *WHAT,
    Column("line", "TEXT", "", "component or random direction along which J was differenced"),
    Column("line_says", "TEXT", "", "agrees, plateau, kink, noise or nothing"),
    Column("tightened", "REAL", "1", "factor on the forward tolerance; 1 as given"),
    Column("step", "REAL", "1", "h, relative to max(|p_i|, s_i)"),
    Column("slope", "REAL", "problem's", "g . v, of the gradient that is checked"),
    Column("quotient_one_sided", "REAL", "problem's", "(J(p + h v) - J(p)) / h"),
    Column("quotient_central", "REAL", "problem's", "(J(p + h v) - J(p - h v)) / 2 h"),
    Column("error_one_sided", "REAL", "1", "|quotient - slope| / scale"),
    Column("error_central", "REAL", "1", "|quotient - slope| / scale"),
    Column("scale", "REAL", "problem's", "what errors are relative to: the component's own slope, or |g w|"),
)
