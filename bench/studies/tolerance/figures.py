"""How wrong a gradient is where the solves are loose."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.figure import Axis, Figure, Section
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import each, real, tabulate
from gradient_routes.bench.render.source import Source, selector
from gradient_routes.bench.studies.bill.figures import ERROR
from gradient_routes.bench.studies.tolerance.view import swept

SWEPT = real("tolerance", "1", "the one that is varied")
OTHERS = (
    Axis("residual", "residual |R| / |R_0|", scale="log"),
    Axis("adjoint_residual", "adjoint residual, relative", scale="log"),
    Axis("objective_error", "error |J − J_ref| / |J_ref|", scale="log"),
)
FOLLOWING = ("iterations", "newton")
LOOSE = 1e-3  # tolerance at which routes are compared in words


def section(source: Source) -> Section | None:
    rows = source.table("tolerance")
    measured = [row for row in rows if row["rtol"] is not None]
    skipped = [row for row in rows if row["rtol"] is None]
    estimated = [row for row in measured if row["gradient_error"] and row.get("gradient_error_estimate")]
    if not rows:
        return None
    figures = [curves(measured)] if measured else []
    figures += [estimates(estimated)] if estimated else []
    figures += [left_out(skipped)] if skipped else []
    says = "Differences differentiate the error of the solver; the adjoint assumes R = 0, which a loose solve violates."
    return Section("tolerance", "Tolerance of the solves", says, tuple(figures))


def left_out(rows: Sequence[Row]) -> Figure:
    table = tabulate("tolerance", rows, "problem route linear_solver sweep status reason")
    return Figure("tolerance-skipped", "Routes that were not swept", f"{len(rows)}, each with its reason.", table)


def curves(rows: Sequence[Row]) -> Figure:
    """k of an unrolled route is no part of its name, for it follows the tolerance."""
    rows = [row | {"route": without_following(row), "tolerance": swept(row)} for row in rows]
    columns = "problem route linear_solver sweep tolerance rtol adjoint_rtol gradient_error objective_error residual"
    return Figure(
        "tolerance",
        "Error against the tolerance",
        says(rows),
        tabulate("tolerance", rows, f"{columns} adjoint_residual status reason", (SWEPT,)),
        "line",
        x=(Axis("tolerance", "tolerance, relative", scale="log"),),
        y=(ERROR, *OTHERS),
        series=each(rows, "route"),
        panels=tuple(map(panel, rows)),
        routes=True,
    )


def estimates(rows: Sequence[Row]) -> Figure:
    return Figure(
        "tolerance-estimates",
        "Estimated error against the error",
        "The estimate needs no reference: one Newton step and one adjoint correction from the state of the gradient.",
        tabulate(
            "tolerance", rows, "problem route linear_solver rtol adjoint_rtol gradient_error gradient_error_estimate"
        ),
        "points",
        x=(ERROR,),
        y=(Axis("gradient_error_estimate", "estimate |g − g'| / |g'|", scale="log"),),
        series=each(rows, "route"),
        panels=each(rows, "problem"),
        routes=True,
        diagonal=True,
    )


def without_following(row: Row) -> str:
    """The selector of its route without the options that follow the problem or the tolerance."""
    kept = {name: value for name, value in (row["route_options"] or {}).items() if name not in FOLLOWING}
    return selector("route", row | {"route": bare(row["route"]), "route_options": kept})


def panel(row: Row) -> str:
    fixed = {"adjoint": row["rtol"], "forward": row["adjoint_rtol"]}.get(row["sweep"])
    held = "" if fixed is None else f", the other at {fixed:g}"
    return f"{row['problem']}, {row['linear_solver']}: {row['sweep']}{held}"


def says(rows: Sequence[Row]) -> str:
    """The best and the worst of routes at a loose tolerance, in words."""
    near = min({row["tolerance"] for row in rows}, key=lambda t: abs(math.log10(t / LOOSE)))
    judged = [r for r in rows if r["tolerance"] == near and r["gradient_error"] is not None]
    if not judged:
        return "Errors of every route at every tolerance."
    good, bad = (f(judged, key=lambda r: r["gradient_error"]) for f in (min, max))
    told = [f"{row['route']} on {row['problem']} {number(row['gradient_error'], 2)}" for row in (good, bad)]
    return f"At tolerance {near:.2g} the least error is that of {told[0]}, the largest that of {told[1]}."
