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

WHAT = (
    Column("problem", "TEXT", "", "selector of the problem, or whose code was checked"),
    Column("route", "TEXT", "", "selector of the route that gave the gradient; NULL for other people's code"),
    Column("at", "TEXT", "", "the p it was asked at: start, true or a file"),
)

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
    Column("refined_plateau", "REAL", "1", "the same along smooth fields on a mesh of half the size"),
    Column("order_in_mesh_size", "REAL", "1", "k of a plateau ~ h^k"),
    Column("active_set_changes", "INTEGER", "1", "inside the stencil of the deciding line"),
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

KINK = (
    *WHAT,
    Column("kind", "TEXT", "", "event, side (a route just beside it), stencil (over it), point (of the sweep), trade"),
    Column("status", "TEXT", "", "ok, none (no event in the range), skipped or failed"),
    Column("reason", "TEXT", "", "why there is no event or no number"),
    Column("s", "REAL", "1", "common factor on all parameters, on their exponentials where they are logarithms"),
    Column("side", "TEXT", "", "of the event: left or right"),
    Column("active_set", "TEXT", "", "which smooth branch holds at s; of an event, on its left"),
    Column("active_set_right", "TEXT", "", "the same on its right"),
    Column("objective", "REAL", "problem's", "J"),
    Column("tip", "REAL", "m", "displacement of a bar's tip"),
    Column("slope", "REAL", "problem's", "dJ/ds = g . dp/ds; of an event, on its left"),
    Column("slope_right", "REAL", "problem's", "the same on its right"),
    Column("jump", "REAL", "problem's", "slope_right - slope"),
    Column("gradient_error", "REAL", "1", "|g - g_ref| / |g_ref|, of the whole gradient at s"),
    Column("reference", "TEXT", "", "whose g_ref or slope that is, or why nobody judges"),
    Column("quotient_forward", "REAL", "problem's", "(J(s + h) - J(s)) / h, h = 1.5e-8 s"),
    Column("quotient_backward", "REAL", "problem's", "(J(s) - J(s - h)) / h"),
    Column("step", "REAL", "1", "of a stencil, relative to s"),
    Column("quotient_central", "REAL", "problem's", "over the event"),
    Column("off_left", "REAL", "problem's", "distance of that from the slope on the left"),
    Column("off_right", "REAL", "problem's", "distance of that from the slope on the right"),
    Column("width", "REAL", "m", "over which the law of a stop is rounded"),
    Column("k_c", "REAL", "N/m", "stiffness of the stop"),
    Column("penetration", "REAL", "m", "u_N - gap"),
    Column("off_objective", "REAL", "problem's", "|J - J of exact contact|, the data being the same"),
    Column("off_slope", "REAL", "problem's", "the same of dJ/ds; at the event, of the nearer of its two"),
    Column("curvature", "REAL", "problem's", "d2J/ds2"),
    Column("newton_iterations", "INTEGER", "1", "of the forward solve"),
)

STUDIES: dict[str, tuple[Column, ...]] = {"checks": CHECKS, "points": POINTS, "kink": KINK}
