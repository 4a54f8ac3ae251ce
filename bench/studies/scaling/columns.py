"""Columns of fitted growth and of break-even points."""

from __future__ import annotations

from gradient_routes.bench.cases.column import PROBLEM, Column

SCALING_FITS = (
    Column("problem", "TEXT", "", "name of the problem"),
    Column("problem_options", "TEXT", "", "its options but for those that make its size", json=True),
    Column("at", "TEXT", "", "the p it was differentiated at: start, true, values or a file"),
    Column("route", "TEXT", "", "name of the route"),
    Column("route_options", "TEXT", "", "its options as asked for; data-dependent ones NULL", json=True),
    Column(
        "quantity",
        "TEXT",
        "",
        "column of cases, iterations (of all Newton steps), or substitutions, products, steps recomputed",
    ),
    Column("against", "TEXT", "", "x: n_state (alone where n_p is a multiple of n_u), n_param, steps or iterations"),
    Column("law", "TEXT", "", "quantity = constant + prefactor x^exponent: affine, exactly; power, fitted; NULL, none"),
    Column("no_law", "TEXT", "", "why there is none"),
    Column("exponent", "REAL", "1", "of x; 0 or 1 where exact"),
    Column("exponent_low", "REAL", "1", "lower end of its 95 % confidence interval, by Student's t"),
    Column("exponent_high", "REAL", "1", "upper end"),
    Column("prefactor", "REAL", "quantity's", "factor of x^exponent"),
    Column(
        "constant", "REAL", "quantity's", "at x = 0: overhead where fitted; 0 where it was below a tenth throughout"
    ),
    Column("points", "INTEGER", "1", "sizes fitted: those where the constant is at most a tenth"),
    Column("fitted_from", "REAL", "1", "the smallest x of them"),
    Column("fitted_to", "REAL", "1", "the largest"),
    Column("fit_residual", "REAL", "1", "largest relative distance of one of them from the law"),
    Column("least", "REAL", "quantity's", "the least of it at any size"),
    Column("most", "REAL", "quantity's", "the most"),
    Column("largest", "INTEGER", "1", "the largest x at which the route gave a gradient"),
    Column("stopped_by", "TEXT", "", "why at no larger one"),
)

CHECKPOINTS = (
    *PROBLEM,
    Column("route", "TEXT", "", "name of a route that marches back"),
    Column("route_options", "TEXT", "", "its options", json=True),
    Column("steps", "INTEGER", "1", "T, of the march"),
    Column("interval", "INTEGER", "1", "k: states after 0, k, 2 k, .. steps are kept; NULL for revolve and none"),
    Column("states_kept", "INTEGER", "1", "the most of them at once, by the schedule, u_0 among them"),
    Column("state_bytes", "INTEGER", "byte", "what these hold"),
    Column("recomputed", "INTEGER", "1", "steps that were marched again, counted"),
    Column("seconds", "REAL", "s", "gradient, median of the steady samples"),
    Column("peak_bytes", "INTEGER", "byte", "peak memory of one call, as in cases"),
    Column("least", "TEXT", "", "of all k at this T: measured, the least peak_bytes; counted, the fewest states"),
)

BREAK_EVEN = (
    *PROBLEM,
    Column("route", "TEXT", "", "name of a route"),
    Column("route_options", "TEXT", "", "its options, as resolved", json=True),
    Column("other", "TEXT", "", "name of the route it was compared with"),
    Column("other_options", "TEXT", "", "its options, as resolved", json=True),
    Column("fixed_s", "REAL", "s", "of the route: seconds = fixed_s + each_s m on m of the parameters, least squares"),
    Column("each_s", "REAL", "s", "the same a parameter"),
    Column("other_fixed_s", "REAL", "s", "fixed_s of the other"),
    Column("other_each_s", "REAL", "s", "each_s of the other"),
    Column("points", "INTEGER", "1", "different m"),
    Column("m_largest", "INTEGER", "1", "the largest m"),
    Column("rounds", "INTEGER", "1", "interleaved rounds that times are medians of"),
    Column(
        "break_even", "REAL", "1", "m at which the lines cross, be it below 1; NULL where slopes are not told apart"
    ),
    Column("break_even_low", "REAL", "1", "lower end of its 95 % confidence interval (Fieller 1954)"),
    Column("break_even_high", "REAL", "1", "upper end"),
    Column("says", "TEXT", "", "which is cheaper, and from which n_p on"),
    Column("predicted", "REAL", "1", "break_even of the cost model: declared work at measured prices"),
    Column("predicted_says", "TEXT", "", "what that says"),
)
