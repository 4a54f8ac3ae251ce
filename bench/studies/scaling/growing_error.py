"""Gradients whose error grows with the size: a solver that squares the condition number is right on small problems."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from gradient_routes.bench.cases.row import measured
from gradient_routes.bench.render.format import number
from gradient_routes.bench.studies.scaling.climbing import Series
from gradient_routes.bench.studies.scaling.sizes import Sizes

DECADE = 10.0
ROUNDING = 1e-12  # errors below are rounding, which may scatter by decades


def growing(sizes: Sizes, series: Series) -> Iterator[str]:
    """A sentence for every two sizes in a row between which the error of the gradient grows by more than a decade."""
    known = [(sizes.label(spec), row) for spec, row in series.cases if measured(row) and row["gradient_error"]]
    for (before, one), (after, other) in pairwise(known):
        error, larger = one["gradient_error"], other["gradient_error"]
        if larger > DECADE * max(error, ROUNDING):
            residual = number(other["adjoint_residual"], 2)
            beside = f", where the adjoint's residual is {residual}" if residual else ""
            yield f"error of the gradient: {number(error, 2)} at {before}, {number(larger, 2)} at {after}{beside}"
