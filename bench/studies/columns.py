"""The tidy tables of studies: one line a measured point, columns with types, units and meanings."""

from __future__ import annotations

from gradient_routes.bench.cases.row import Column

KEY = Column("study_id", "INTEGER", "", "of the row in studies")
STUDY = (
    Column("study_id", "INTEGER PRIMARY KEY", "", "counts the studies of this store"),
    Column("study", "TEXT", "", "name of the table that holds its rows"),
    Column("environment_id", "TEXT", "", "of the row in environments"),
    Column("started", "TEXT", "UTC", "when it began, ISO 8601"),
    Column("status", "TEXT", "", "ok, or what ended it before it was done: timeout, out-of-memory, crashed"),
    Column("reason", "TEXT", "", "why it is not ok"),
    Column("stderr", "TEXT", "", "the last lines on stderr of one that is not ok"),
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
    Column("refined_plateau", "REAL", "1", "|(g - exact) w| / |exact w| on a mesh of half the size"),
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

INNER = Column("inner", "TEXT", "", "the iteration of unrolled-ad: cg, richardson, jacobi or direct")
CHECKPOINT = Column("checkpoint", "INTEGER", "1", "every so-manieth iterate kept on the tape; NULL: all")
UNROLLING = (
    *PROBLEM,
    INNER,
    CHECKPOINT,
    Column("iterations", "INTEGER", "1", "k, of each Newton step; direct: Newton steps"),
    Column("newton", "INTEGER", "1", "Newton steps around them; NULL on linear problems and for direct"),
    *JUDGED,
    Column("tape_bytes", "INTEGER", "byte", "arrays AD holds between its forward and its backward sweep"),
    Column("products", "INTEGER", "1", "products with R_u or R_u^T, both sweeps"),
    Column("seconds", "REAL", "s", "one gradient, median of up to 3 steady calls"),
)
UNROLLING_FITS = (
    *PROBLEM,
    INNER,
    CHECKPOINT,
    Column("implicit_error", "REAL", "1", "gradient_error of implicit-ad"),
    Column("enough", "REAL", "1", "gradient_error at which unrolled-ad has met it, at least 1e3 eps"),
    Column("meets", "INTEGER", "1", "the least k found with at most that error"),
    Column("points", "INTEGER", "1", "tapes fitted"),
    Column("bytes_per_iteration", "REAL", "byte", "slope of tape_bytes over iterations x newton, least squares"),
    Column("fixed_bytes", "REAL", "byte", "tape_bytes of that line at no iterations"),
    Column("fit_residual", "REAL", "1", "largest distance of a tape from the line, relative to the largest tape"),
    Column("compared_at", "INTEGER", "1", "k at which checkpoints are compared with none"),
    Column("tape_ratio", "REAL", "1", "tape_bytes with them / without"),
    Column("products_ratio", "REAL", "1", "products with them / without"),
    Column("time_ratio", "REAL", "1", "seconds with them / without, in the same rounds"),
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

PLACE = tuple(Column(axis, "REAL", "m", "where it lives") for axis in "xyz")
RUN = (
    *PROBLEM,
    Column("route", "TEXT", "", "name of the route that gives gradients"),
    Column("route_options", "TEXT", "", "its options", json=True),
    Column("optimizer", "TEXT", "", "lbfgs, gauss-newton, levenberg-marquardt, trust, descent, adam or one-shot"),
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
    Column("says", "TEXT", "", "what happened there: a stall, a step out of the domain, why it stopped"),
)
ESTIMATES = (
    *RUN,
    Column("parameter", "TEXT", "", "its name"),
    *PLACE,
    Column("start", "REAL", "its own", "p_0"),
    Column("estimate", "REAL", "its own", "p at the end"),
    Column("truth", "REAL", "its own", "p behind synthetic data"),
    Column("gradient", "REAL", "problem's", "dJ/dp at the end"),
    Column("blind", "INTEGER", "1", "1 where no datum depends on it"),
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
)
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
SCALING_FITS = (
    Column("problem", "TEXT", "", "name of the problem"),
    Column("problem_options", "TEXT", "", "its options but for those that make its size", json=True),
    Column("at", "TEXT", "", "the p it was differentiated at: start, true or a file"),
    Column("route", "TEXT", "", "name of the route"),
    Column("route_options", "TEXT", "", "its options as asked for; data-dependent ones NULL", json=True),
    Column("quantity", "TEXT", "", "column of cases, iterations (of all Newton steps), substitutions or products"),
    Column("against", "TEXT", "", "x: n_state, n_param or iterations; n_state alone where n_p is a multiple of n_u"),
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

STUDIES: dict[str, tuple[Column, ...]] = {
    "checks": CHECKS,
    "points": POINTS,
    "tolerance": TOLERANCE,
    "unrolling": UNROLLING,
    "unrolling_fits": UNROLLING_FITS,
    "kink": KINK,
    "inversion": INVERSION,
    "estimates": ESTIMATES,
    "lcurve": LCURVE,
    "tradeoff": TRADEOFF,
    "spectrum": SPECTRUM,
    "identified": IDENTIFIED,
    "experiments": EXPERIMENTS,
    "placement": PLACEMENT,
    "scaling_fits": SCALING_FITS,
    "break_even": BREAK_EVEN,
}
