"""Checks: the verdict on every gradient, and the curves it rests on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.point_values import shown
from gradient_routes.bench.render.figure import Figure, Section, Told
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.verification.page import LOOKS, OFF, QUOTIENTS, STEP, TIGHTENED


def section(source: Source) -> Section | None:
    checks = sorted(source.table("checks"), key=lambda check: check["verdict"] == "agrees")
    if not checks:
        return None
    points = source.table("points")
    figures = (verdicts(checks), *([curves(checks, points)] if points else []))
    says = (
        "Is the gradient right? Difference quotients at every step: where it is, their error falls with slope 1"
        " (one-sided) or 2 (central) until round-off."
    )
    return Section("vcurves", "V-curves and verdicts", says, figures)


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


def curves(checks: Sequence[Row], points: Sequence[Row]) -> Figure:
    """One panel a check, worst verdicts first: a line for each quotient along each line."""
    order = {named(check): k for k, check in enumerate(checks)}
    points = sorted(points, key=lambda row: order.get(named(row), len(order)))
    floors = [check["floor"] for check in checks if check["verdict"] == "agrees" and check["floor"] is not None]
    reached = f" Gradients that agree reach {number(min(floors), 2)} at best." if floors else ""
    lines = {key: k for k, key in enumerate(dict.fromkeys(map(line, points)))}
    columns = "problem route at line line_says tightened step error_one_sided error_central slope"
    return Figure(
        "v-curves",
        "Error of difference quotients against the step",
        "Each line is one direction v in the space of parameters. A wrong gradient shows as a plateau that no step"
        f" removes.{reached}",
        tabulate("points", points, columns),
        "line",
        x=(STEP,),
        y=(OFF,),
        series=tuple("" if row["tightened"] in (1.0, None) else TIGHTENED for row in points),
        panels=tuple(map(named, points)),
        lines=tuple(lines[line(row)] for row in points),
        fold=QUOTIENTS,
        looks=LOOKS,
        told={named(check): told(check) for check in checks},
    )


def line(row: Row) -> tuple[str, str, float | None]:
    return named(row), row["line"], row["tightened"]


def named(row: Row) -> str:
    name = f"{row['problem']} by {row['route']}" if row["route"] else str(row["problem"])
    return name if row["at"] in ("start", None) else f"{name}, at {shown(row['at'])}"


def told(check: Row) -> Told:
    said = [check["says"], f"Next: {check['next']}" if check["next"] else None]
    return Told(check["verdict"] or "", " ".join(f"{part.rstrip('.')}." for part in said if part))
