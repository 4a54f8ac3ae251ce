"""What gradients say of J the longer a march is."""

from __future__ import annotations

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Section
from gradient_routes.bench.render.picking import each, tabulate
from gradient_routes.bench.render.source import Source


def section(source: Source) -> Section | None:
    rows = [row for row in source.table("horizon") if row["status"] == "ok"]
    if not rows:
        return None
    says = "Contact in time and chaos make gradients scatter: exact ones, which say less and less of J."
    return Section("horizon", "Long marches", says, (curves(rows),))


def curves(rows: list[Row]) -> Figure:
    misled = [f"{row['verdict']} at T = {row['steps']}" for row in rows if row["verdict"] != "smooth"]
    columns = "problem at spread places steps objective gradient_norm slope slope_mean slope_scatter quotient"
    return Figure(
        "horizon",
        "Slopes of J against the length of the march",
        f"{'; '.join(misled[:3])}." if misled else "Slopes are those of J at every length.",
        tabulate("horizon", rows, f"{columns} flips energy_growth verdict"),
        "line",
        x=(Axis("steps", "T, steps", scale="log"),),
        y=(
            Axis("slope_scatter", "standard deviation of slopes", scale="log"),
            Axis("gradient_norm", "|dJ/dp|", scale="log"),
        ),
        series=tuple(str(row["places"]) + " slopes" for row in rows),
        panels=each(rows, "problem"),
    )
