"""Checks: the verdict on every gradient, and the curves it rests on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Section, Series
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import grouped, sorted_by, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import Style, of_route

QUOTIENTS = {"error_one_sided": ("one-sided", "fd-one-sided"), "error_central": ("central", "fd-central")}
TIGHTENED = Style("#0072B2", "circle", "5 3", hollow=True)
WHAT = ("problem", "route", "at")


def section(source: Source) -> Section | None:
    checks = sorted(source.table("checks"), key=lambda check: check["verdict"] == "agrees")
    if not checks:
        return None
    figures = (verdicts(checks), curves(checks, source.table("points")))
    says = "Is the gradient right? Difference quotients at every step, read as a curve: slopes 1 and 2, then round-off."
    return Section("vcurves", "V-curves and verdicts", says, tuple(f for f in figures if f is not None))


def verdicts(checks: Sequence[Row]) -> Figure:
    counted = Counter(check["verdict"] for check in checks if check["verdict"] != "agrees")
    agree = sum(check["verdict"] == "agrees" for check in checks)
    others = "".join(f", {count} {verdict}" for verdict, count in counted.most_common())
    columns = "problem route at verdict says next floor best_step slope_one_sided slope_central roundoff_slope window"
    return Figure(
        "verdicts",
        "Verdicts",
        f"{agree} of {len(checks)} gradients agree with difference quotients{others}.",
        tabulate("checks", checks, f"{columns} noise plateau culprit calls gradient_calls"),
    )


def curves(checks: Sequence[Row], points: Sequence[Row]) -> Figure | None:
    """One panel a check, worst verdicts first: a line for each quotient along each line."""
    if not points:
        return None
    known = {tuple(check[name] for name in WHAT): check for check in checks}
    panels = grouped(points, lambda row: tuple(row[name] for name in WHAT))
    order = sorted(panels, key=lambda what: known.get(what, {}).get("verdict") == "agrees")
    facets, series = [], []
    for facet, what in enumerate(order):
        facets.append(_facet(what, known.get(what)))
        of = [points[i] for i in panels[what]]
        for (_, tightened), places in grouped(of, lambda row: (row["line"], row["tightened"])).items():
            line = sorted_by(points, (panels[what][i] for i in places), "step")
            series += _series(points, line, tightened, facet)
    floors = [check["floor"] for check in checks if check["verdict"] == "agrees" and check["floor"] is not None]
    says = f" Gradients that agree reach {number(min(floors), 2)} at best." if floors else ""
    return Figure(
        "v-curves",
        "Error of difference quotients against the step",
        f"|quotient − g·v|, relative; a wrong gradient shows as a plateau that no step removes.{says}",
        tabulate(
            "points", points, "problem route at line line_says tightened step error_one_sided error_central slope"
        ),
        x=(Axis("step", "h, relative", scale="log"),),
        y=(Axis("error_central", "error", scale="log"),),
        series=tuple(series),
        facets=tuple(facets),
    )


def _facet(what: tuple[str, ...], check: Row | None) -> Facet:
    problem, route, at = what
    name = f"{problem} by {route}" if route else str(problem)
    name += "" if at in ("start", None) else f", at {at}"
    if check is None:
        return Facet(name)
    said = [check["says"], f"Next: {check['next']}" if check["next"] else None]
    return Facet(name, check["verdict"] or "", " ".join(f"{part.rstrip('.')}." for part in said if part))


def _series(points: Sequence[Row], line: tuple[int, ...], tightened: float | None, facet: int) -> list[Series]:
    made = []
    for column, (name, route) in QUOTIENTS.items():
        if any(points[i][column] is not None for i in line):
            if tightened in (1.0, None):
                made.append(Series(name, of_route(route), line, facet, y=column))
            elif column == "error_central":
                made.append(Series("central, solve tightened", TIGHTENED, line, facet, y=column))
    return made
