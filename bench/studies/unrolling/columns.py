"""Columns of the tables `unrolling` and `unrolling_fits`."""

from __future__ import annotations

from gradient_routes.bench.cases.column import JUDGED, PROBLEM, Column

INNER = Column("inner", "TEXT", "", "the iteration of unrolled-ad: cg, richardson, jacobi or direct")

CHECKPOINT = Column("checkpoint", "INTEGER", "1", "every C-th iterate is kept on the tape; NULL: all")

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
