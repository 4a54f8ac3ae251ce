"""How much to regularize: L-curves, and bias against variance."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Guide
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import each, tabulate
from gradient_routes.bench.render.source import Source

PARTS = {"bias": "bias²", "variance": "variance", "total": "total"}
ALPHA = Axis("alpha", "α, weight of Φ", scale="log")


def figures(source: Source) -> list[Figure | None]:
    return [lcurve(source.table("lcurve")), tradeoff(source.table("tradeoff"))]


def panel(row: Row) -> str:
    return f"{row['problem']} by {row['route']}, {row['optimizer']}"


def lcurve(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    columns = "problem route optimizer alpha misfit phi curvature discrepancy distance iterations forward_solves chosen"
    return Figure(
        "l-curve",
        "L-curve",
        "; ".join(dict.fromkeys(choices(rows))) or "Misfit against regularizer, over the weight α.",
        tabulate("lcurve", rows, columns),
        "line",
        x=(Axis("misfit", "misfit ½|Su − d|²", "unit of J", "log"), ALPHA),
        y=(
            Axis("phi", "regularizer Φ", scale="log"),
            Axis("curvature", "curvature of the L-curve"),
            Axis("discrepancy", "discrepancy |Su − d| / (σ√m)", scale="log"),
            Axis("distance", "distance to the truth, relative", scale="log"),
        ),
        series=each(rows, "route"),
        panels=tuple(map(panel, rows)),
        routes=True,
        guides=(Guide("y", 1.0, "noise", column="discrepancy"),),
        note="chosen",
        order="alpha",
    )


def choices(rows: Sequence[Row]) -> list[str]:
    return [
        f"{row['chosen']} at α = {number(row['alpha'])}"
        + ("" if row["distance"] is None else f", {number(row['distance'], 2)} from the truth")
        for row in rows
        if row["chosen"]
    ][:4]


def tradeoff(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    known = [row for row in rows if row["total"] is not None]
    best = min(known, key=lambda row: row["total"], default=None)
    says = "" if best is None else f" The least total error is at α = {number(best['alpha'])}: {number(best['total'])}."
    return Figure(
        "tradeoff",
        "Bias against variance",
        f"Over draws of the noise: more weight trades variance for bias.{says}",
        tabulate("tradeoff", rows, "problem route optimizer alpha draws bias variance total"),
        "line",
        x=(ALPHA,),
        y=(Axis("", "mean square error of a parameter", scale="log"),),
        panels=tuple(map(panel, rows)),
        fold=PARTS,
    )
