"""Residuals where they were measured: noise has no pattern, a wrong model has one."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render import fields
from gradient_routes.bench.render.figure import Axis, Figure, Table
from gradient_routes.bench.render.picking import grouped, real

NAMES = (
    "problem route optimizer alpha run number slice x y z width height datum quantity measured residual standardized"
)
SHOWN = real("shown", "1", "residual / noise, of outliers the largest other one")


def fits(rows: Sequence[Row]) -> list[Figure]:
    """A table."""
    if not rows:
        return []
    wrong = [str(row["verdict"]) for row in rows if row["verdict"] != "explained"]
    counted = f"{len(rows) - len(wrong)} of {len(rows)} models explain the data that were measured"
    names = "problem route optimizer alpha run data outliers freedom rms noise noise_source chi2 moran moran_z verdict"
    table = Table.of(fields.columns("fit", names).columns, rows)
    return [Figure("fits", "How well data are met", "; ".join([counted, *dict.fromkeys(wrong)]) + ".", table)]


def constants(rows: Sequence[Row]) -> list[Figure]:
    """A table."""
    if not rows:
        return []
    names = "problem route optimizer alpha run constant value sd third_1 third_2 third_3 bound"
    table = Table.of(fields.columns("constants", names).columns, rows)
    says = "Error bars know the noise; thirds of the data differ by what the model leaves out."
    return [Figure("constants", "Constants", says, table)]


def figures(rows: Sequence[Row]) -> list[Figure]:
    """By quantity: along a line as points, over a body as a map."""
    if not rows:
        return []
    shown = [row for of in grouped(rows, lambda row: str(row["panel"])).values() for row in _shown(of)]
    figure = Figure(
        "residuals",
        "Residuals",
        "Noise has no pattern in space.",
        Table.of([*fields.columns("residuals", NAMES).columns, SHOWN], []),
        y=(Axis("residual", "residual Su − d", "unit of the data"), Axis("standardized", "residual / noise")),
        z=Axis("", "residual / noise"),
    )
    return fields.figures(figure, shown, {"shown": "residual / noise"}, says)


def _shown(rows: Sequence[Row]) -> list[Row]:
    """Panels by quantity, and the values of a map, on which outliers are as large as the largest other one."""
    name = "standardized" if rows[0]["standardized"] is not None else "residual"
    most = max((abs(row[name]) for row in rows if not row["outlier"]), default=0.0)
    return [
        row
        | {"panel": ", ".join(filter(None, (row["panel"], row["quantity"])))}
        | {"shown": max(-most, min(most, row[name]))}
        for row in rows
    ]


def says(rows: Sequence[Row]) -> str:
    inner = [row["residual"] for row in rows if not row["outlier"]]
    rms = math.sqrt(sum(r * r for r in inner) / len(inner)) if inner else math.nan
    return f"Root mean square {rms:.3g} without {len(rows) - len(inner)} outliers."
