"""What inversions found: estimate, truth and start, parameter by parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render import fields
from gradient_routes.bench.render.figure import Axis, Figure
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.style import DASHES, GREY, Style

PLACE = "problem route optimizer alpha run parameter number slice x y z width height"
COLUMNS = f"{PLACE} start estimate truth gradient blind"
LOOKS = {"truth": GREY, "start": Style("#8a9099", "square", DASHES[2]), "estimate": Style("#0072B2")}


def figures(rows: Sequence[Row]) -> list[Figure]:
    if not rows:
        return []
    flat = Figure(
        "estimates",
        "What was found",
        "Hollow: blind, no datum depends on it; the estimate is its start or that of the regularizer.",
        fields.columns("estimates", COLUMNS),
        y=(Axis("", "parameter", "its own unit"),),
        fold={name: name for name in LOOKS},
        looks=LOOKS,
        hollow="blind",
        z=Axis("", "parameter [its own unit]"),
    )
    return fields.figures(flat, rows, {"estimate": "estimate", "truth": "truth"}, says)


def says(rows: Sequence[Row]) -> str:
    """How far a run ends from the truth, over what can be seen."""
    blind = sum(1 for row in rows if row["blind"])
    seen = [(r["estimate"], r["truth"]) for r in rows if not r["blind"] and None not in (r["estimate"], r["truth"])]
    size = math.sqrt(sum(t * t for _, t in seen))
    off = math.sqrt(sum((e - t) ** 2 for e, t in seen)) / size if size else None
    told = [] if off is None else [f"Off by {number(off, 2)}, relative, over parameters that are not blind."]
    return " ".join(told + ([f"{blind} of {len(rows)} blind."] if blind else []))
