"""How much to regularize: L-curves, and bias against variance."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Guide, Series
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import bare, grouped, sorted_by, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import of_route, others

PARTS = {"bias": "bias²", "variance": "variance", "total": "total"}
ALPHA = Axis("alpha", "α, weight of Φ", scale="log")


def figures(source: Source) -> list[Figure | None]:
    return [lcurve(source.table("lcurve")), tradeoff(source.table("tradeoff"))]


def _panel(row: Row) -> str:
    return f"{row['problem']} by {row['route']}, {row['optimizer']}"


def lcurve(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    panels = grouped(rows, _panel)
    columns = "problem route optimizer alpha misfit phi curvature discrepancy distance iterations forward_solves chosen"
    return Figure(
        "l-curve",
        "L-curve",
        "; ".join(dict.fromkeys(_choices(rows))) or "Misfit against regularizer, over the weight.",
        tabulate("lcurve", rows, columns),
        x=(Axis("misfit", "misfit ½|Su − d|²", scale="log"), ALPHA),
        y=(
            Axis("phi", "Φ", scale="log"),
            Axis("curvature", "curvature"),
            Axis("discrepancy", "discrepancy |Su − d| / (σ√m)", scale="log"),
            Axis("distance", "distance to the truth, relative", scale="log"),
        ),
        series=tuple(
            Series(rows[places[0]]["route"], of_route(bare(rows[places[0]]["route"])), line, facet)
            for facet, places in enumerate(panels.values())
            if (line := sorted_by(rows, places, "alpha"))
        ),
        facets=tuple(Facet(name, guides=(Guide("y", 1.0, "noise", "discrepancy"),)) for name in panels),
        note="chosen",
    )


def _choices(rows: Sequence[Row]) -> list[str]:
    return [
        f"{row['chosen']} at α = {number(row['alpha'])}"
        + ("" if row["distance"] is None else f", {number(row['distance'], 2)} from the truth")
        for row in rows
        if row["chosen"]
    ][:4]


def tradeoff(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    panels = grouped(rows, _panel)
    styles = others(PARTS.values())
    known = [row for row in rows if row["total"] is not None]
    best = min(known, key=lambda row: row["total"], default=None)
    says = "" if best is None else f" The least total error is at α = {number(best['alpha'])}: {number(best['total'])}."
    return Figure(
        "tradeoff",
        "Bias against variance",
        f"Over draws of the noise: more weight trades variance for bias.{says}",
        tabulate("tradeoff", rows, "problem route optimizer alpha draws bias variance total"),
        x=(ALPHA,),
        y=(Axis("total", "mean square error a parameter", scale="log"),),
        series=tuple(
            Series(name, styles[name], sorted_by(rows, places, "alpha"), facet, y=column)
            for facet, places in enumerate(panels.values())
            for column, name in PARTS.items()
        ),
        facets=tuple(Facet(name) for name in panels),
    )
