"""What inversions found: estimate, truth and start, parameter by parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render import fields
from gradient_routes.bench.render.figure import Axis, Figure, Series
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import bare
from gradient_routes.bench.render.style import INK, Style, of_route

COLUMNS = "problem route optimizer alpha run parameter number slice x y z start estimate truth gradient blind"
START = Style("#8a9099", "cross", "2 3")
VALUES = (Axis("estimate", "estimate"), Axis("truth", "truth"))


def figures(rows: Sequence[Row]) -> list[Figure]:
    if not rows:
        return []
    says = facets(rows)
    figure = Figure(
        "estimates",
        "What was found",
        "Hatched or grey: blind, no datum depends on it, so that its estimate is its start or the regularizer's.",
        fields.columns("estimates", COLUMNS),
        y=(Axis("estimate", "parameter"),),
        values=VALUES,
        hatched="blind",
    )
    flat = fields.along(figure, rows, _lines, says)
    deep = fields.over(figure, rows, says)
    return [f for f in (flat and replace(flat, values=()), deep) if f is not None]


def _lines(row: Row) -> dict[str, Series]:
    return {
        "truth": Series("truth", INK, ()),
        "start": Series("start", START, ()),
        "estimate": Series(f"estimate by {row['route']}", of_route(bare(row["route"])), ()),
    }


def facets(rows: Sequence[Row]) -> dict[str, str]:
    """How far each run ends from the truth, over what can be seen."""
    said = {}
    for panel, places in fields.by_panel(rows).items():
        seen = [rows[i] for i in places if not rows[i]["blind"] and rows[i]["truth"] is not None]
        blind = sum(1 for i in places if rows[i]["blind"])
        text = f"{blind} of {len(places)} blind." if blind else ""
        both = [(r["estimate"], r["truth"]) for r in seen if r["estimate"] is not None]
        size = math.sqrt(sum(t * t for _, t in both))
        if both and size:
            off = math.sqrt(sum((e - t) ** 2 for e, t in both)) / size
            text = f"Off by {number(off, 2)}, relative, where seen. {text}"
        said[panel] = text.strip()
    return said
