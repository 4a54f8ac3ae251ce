"""How wrong a gradient is where the solves are loose."""

from __future__ import annotations

import math

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Section, Series
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import bare, by_column, grouped, in_order, real, sorted_by, tabulate
from gradient_routes.bench.render.source import Source, selector
from gradient_routes.bench.render.style import of_routes
from gradient_routes.bench.studies.tolerance import view as tolerance

SWEPT = real("tolerance", "1", "the one that is varied")
ERROR = Axis("gradient_error", "|g − g_ref| / |g_ref|", scale="log")
OTHERS = (
    Axis("residual", "residual |R| / |R_0|", scale="log"),
    Axis("adjoint_residual", "adjoint residual", scale="log"),
    Axis("objective_error", "|J − J_ref| / |J_ref|", scale="log"),
)
FOLLOWING = ("iterations", "newton")
LOOSE = 1e-3  # tolerance at which routes are compared in words


def section(source: Source) -> Section | None:
    rows = source.table("tolerance")
    measured = [row for row in rows if row["rtol"] is not None]
    skipped = [row for row in rows if row["rtol"] is None]
    if not rows:
        return None
    figures = ([curves(measured)] if measured else []) + ([left_out(skipped)] if skipped else [])
    says = (
        "Differences differentiate the solver's noise; the adjoint relies on an identity that a loose solve violates."
    )
    return Section("tolerance", "Tolerance of the solves", says, tuple(figures))


def left_out(rows: list[Row]) -> Figure:
    table = tabulate("tolerance", rows, "problem route linear_solver sweep status reason")
    return Figure("tolerance-skipped", "Routes that were not swept", f"{len(rows)}, each with its reason.", table)


def curves(rows: list[Row]) -> Figure:
    rows = _labelled(rows)
    panels = grouped(rows, _panel)
    styles = of_routes(in_order(row["route"] for row in rows))
    series = []
    for facet, places in enumerate(panels.values()):
        for route, of in by_column([rows[i] for i in places], "route").items():
            line = sorted_by(rows, (places[i] for i in of), "tolerance")
            series.append(Series(route, styles[route], line, facet))
    columns = "problem route linear_solver sweep tolerance rtol adjoint_rtol gradient_error objective_error residual"
    return Figure(
        "tolerance",
        "Error against the tolerance",
        _says(rows),
        tabulate("tolerance", rows, f"{columns} adjoint_residual status reason", (SWEPT,)),
        x=(Axis("tolerance", "tolerance", scale="log"),),
        y=(ERROR, *OTHERS),
        series=tuple(series),
        facets=tuple(Facet(name) for name in panels),
    )


def _labelled(rows: list[Row]) -> list[Row]:
    """k of an unrolled route is no part of its name, for it follows the tolerance."""
    return [
        row | {"route": without_following(bare(row["route"]), row["route_options"]), "tolerance": tolerance.swept(row)}
        for row in rows
    ]


def without_following(route: str, options: Row | None) -> str:
    """The selector of a route without the options that follow the problem or the tolerance."""
    kept = {name: value for name, value in (options or {}).items() if name not in FOLLOWING}
    return selector("route", route, kept)


def _panel(row: Row) -> str:
    fixed = {"adjoint": row["rtol"], "forward": row["adjoint_rtol"]}.get(row["sweep"])
    held = "" if fixed is None else f", the other at {fixed:g}"
    return f"{row['problem']}, {row['linear_solver']}: {row['sweep']}{held}"


def _says(rows: list[Row]) -> str:
    """The best and the worst of routes at a loose tolerance, in words."""
    near = min({row["tolerance"] for row in rows}, key=lambda t: abs(math.log10(t / LOOSE)))
    judged = [r for r in rows if r["tolerance"] == near and r["gradient_error"] is not None]
    if not judged:
        return "Errors of every route at every tolerance."
    good, bad = (f(judged, key=lambda r: r["gradient_error"]) for f in (min, max))
    return (
        f"At {near:.2g}, {good['route']} is off by {number(good['gradient_error'], 2)},"
        f" {bad['route']} by {number(bad['gradient_error'], 2)}."
    )
