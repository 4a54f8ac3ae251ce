"""What becomes of dJ/dp where the active set changes, or where its kink is rounded."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Guide, Section, Told
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import each, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.studies.bill.figures import ERROR

OFF = {"off_left": "from the left slope", "off_right": "from the right slope"}
ROUNDING = 1e-12
UNIT = "unit of J"


def section(source: Source) -> Section | None:
    rows = source.table("kink")
    figures = (sides(rows), stencils(rows), trade(rows))
    drawn = tuple(f for f in figures if f is not None)
    says = "Where a contact opens or closes, J is continuous and its slope is not."
    return Section("kink", "Kinks", says, drawn) if drawn else None


def sides(rows: Sequence[Row]) -> Figure | None:
    """J and dJ/ds over s, both sides of the event."""
    drawn = [row for row in rows if row["kind"] in ("point", "side") and row["objective"] is not None]
    if not drawn:
        return None
    events = {row["problem"]: row for row in rows if row["kind"] == "event"}
    told = {problem: Told(says=said(event)) for problem, event in events.items()}
    branches = {key: k for k, key in enumerate(dict.fromkeys(map(branch, drawn)))}
    columns = "problem route at kind s side active_set objective slope gradient_error quotient_forward"
    return Figure(
        "kink",
        "Both sides of the event",
        "All parameters times a common factor s. A line ends where the active set changes.",
        tabulate("kink", drawn, f"{columns} quotient_backward tip reference status"),
        "line",
        x=(Axis("s", "s, factor of all parameters"),),
        y=(Axis("slope", "dJ/ds", UNIT), Axis("objective", "J", UNIT), ERROR),
        series=tuple(row["route"] or "J alone" for row in drawn),
        panels=each(drawn, "problem"),
        lines=tuple(branches[branch(row)] for row in drawn),
        routes=True,
        told=told,
        guides=tuple(
            Guide("x", event["s"], "event", problem) for problem, event in events.items() if event["s"] is not None
        ),
    )


def branch(row: Row) -> tuple[str, str, str]:
    """What one line joins: nothing is drawn across the jump."""
    return row["problem"], row["route"], row["active_set"]


def said(event: Row) -> str:
    if event["s"] is None:
        return event["reason"] or ""
    slopes = ""
    if event["jump"] is not None:
        left, right = (rounded(event[side], event["jump"]) for side in ("slope", "slope_right"))
        slopes = f" and dJ/ds jumps from {left} to {right}"
    sets = f"{event['active_set']} to {event['active_set_right']}"
    return f"At s = {event['s']:.6g} the active set changes, {sets}{slopes}."


def rounded(slope: float, jump: float) -> str:
    """What rounding leaves of a zero is none."""
    return number(slope if abs(slope) > ROUNDING * abs(jump) else 0.0, 4)


def stencils(rows: Sequence[Row]) -> Figure | None:
    """How far central quotients over the event are from either slope, whatever the step."""
    drawn = [row for row in rows if row["kind"] == "stencil" and row["off_left"] is not None]
    if not drawn:
        return None
    finest = min(drawn, key=lambda row: row["step"])
    return Figure(
        "stencils",
        "Central differences over the event",
        f"At h / s = {finest['step']:.0e} they are still {number(finest['off_left'])} off the left slope and"
        f" {number(finest['off_right'])} off the right one: no step helps.",
        tabulate("kink", drawn, "problem at step quotient_central off_left off_right s"),
        "line",
        x=(Axis("step", "step h / s", scale="log"),),
        y=(Axis("", "|quotient − slope|", UNIT, "log"),),
        panels=each(drawn, "problem"),
        fold=OFF,
    )


def trade(rows: Sequence[Row]) -> Figure | None:
    """What rounding a stop costs and buys."""
    drawn = [row for row in rows if row["kind"] == "trade" and row["off_objective"] is not None]
    if not drawn:
        return None
    stiffness = Axis("k_c", "stiffness of the stop", "N/m", "log")
    width = Axis("width", "width of the rounding", "m", "log")
    columns = "problem route width k_c off_objective off_slope curvature penetration newton_iterations s"
    return Figure(
        "rounding",
        "What rounding the kink costs",
        "Distance of J and of its slope from those of exact contact, and the curvature an optimizer meets.",
        tabulate("kink", drawn, columns),
        "line",
        x=(stiffness, width) if len({row["k_c"] for row in drawn}) > 1 else (width, stiffness),
        y=(
            Axis("off_objective", "|J − J of exact contact|", UNIT, "log"),
            Axis("off_slope", "|dJ/ds − that of exact contact|", UNIT, "log"),
            Axis("curvature", "d²J/ds²", UNIT),
            Axis("newton_iterations", "Newton iterations"),
        ),
        series=tuple(f"{row['route']}, s = {row['s']:.3g}" for row in drawn),
        panels=each(drawn, "problem"),
        routes=True,
    )
