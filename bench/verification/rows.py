"""A check as tidy rows: one for the verdict, one for every step of every line."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check


def rows(check: Check, what: Row) -> dict[str, list[Row]]:
    """The rows of the tables `checks` and `points`; `what` holds problem, route and at."""
    readings = [(1.0, r) for r in check.readings] + [(t.factor, t.reading) for t in check.tightened]
    points = [what | point for factor, reading in readings for point in _points(factor, reading)]
    return {"checks": [what | check.as_dict()], "points": points}


def _points(factor: float, reading: Reading) -> Iterator[Row]:
    made, scale = reading.sweep, reading.scale or 1.0
    with np.errstate(invalid="ignore"):
        columns = {
            "step": made.h,
            "quotient_one_sided": made.forward,
            "quotient_central": made.central,
            "error_one_sided": np.abs(made.off_forward) / scale,
            "error_central": np.abs(made.off_central) / scale,
        }
    fixed = {
        "line": made.line.name,
        "line_says": reading.says,
        "tightened": factor,
        "slope": reading.slope,
        "scale": reading.scale,
    }
    for values in zip(*columns.values(), strict=True):
        yield fixed | dict(zip(columns, map(float, values), strict=True))
