"""Columns of the table `kink`."""

from __future__ import annotations

from gradient_routes.bench.cases.column import WHAT, Column

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
    Column("reference", "TEXT", "", "whose g_ref or slope that is, or why there is none"),
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
