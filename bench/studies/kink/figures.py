"""What becomes of dJ/dp where the active set changes, or where its kink is rounded."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Guide, Section, Series
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import by_column, grouped, in_order, sorted_by, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import of_route, of_routes, others, variant

OFF = {"off_left": "from the left slope", "off_right": "from the right slope"}
ROUNDING = 1e-12
J, SLOPE = Axis("objective", "J"), Axis("slope", "dJ/ds")


def section(source: Source) -> Section | None:
    rows = source.table("kink")
    figures = (sides(rows), stencils(rows), trade(rows))
    drawn = tuple(f for f in figures if f is not None)
    says = "A contact that opens or closes leaves J continuous and its slope not."
    return Section("kink", "Kinks", says, drawn) if drawn else None


def sides(rows: Sequence[Row]) -> Figure | None:
    """J and dJ/ds over s, both sides of the event."""
    drawn = [row for row in rows if row["kind"] in ("point", "side") and row["objective"] is not None]
    if not drawn:
        return None
    panels = grouped(drawn, lambda row: row["problem"])
    events = {row["problem"]: row for row in rows if row["kind"] == "event"}
    styles = of_routes(in_order(row["route"] for row in drawn if row["route"]))
    series = []
    for facet, places in enumerate(panels.values()):
        for route, of in by_column([drawn[i] for i in places], "route").items():
            style = styles[route] if route else of_route("")
            line = sorted_by(drawn, (places[i] for i in of), "s")
            series += [Series(route or "J alone", style, part, facet) for part in _branches(drawn, line)]
    facets = tuple(_facet(problem, events.get(problem)) for problem in panels)
    said = next((facet.says for facet in facets if facet.guides), facets[0].says)
    columns = "problem route at kind s side active_set objective slope gradient_error quotient_forward"
    return Figure(
        "kink",
        "Both sides of the event",
        said,
        tabulate("kink", drawn, f"{columns} quotient_backward tip reference status"),
        x=(Axis("s", "s, common factor"),),
        y=(SLOPE, J, Axis("gradient_error", "|g − g_ref| / |g_ref|", scale="log")),
        series=tuple(series),
        facets=facets,
    )


def _branches(rows: Sequence[Row], line: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Pieces of a line that one active set holds: nothing is drawn across the jump."""
    pieces: list[list[int]] = []
    for i in line:
        if pieces and rows[pieces[-1][-1]]["active_set"] == rows[i]["active_set"]:
            pieces[-1].append(i)
        else:
            pieces.append([i])
    return [tuple(piece) for piece in pieces]


def _facet(problem: str, event: Row | None) -> Facet:
    if event is None or event["s"] is None:
        return Facet(problem, says=(event or {}).get("reason") or "")
    sides = f"{event['active_set']} to {event['active_set_right']}"
    slopes = ""
    if event["jump"] is not None:
        left, right = (_rounded(event[side], event["jump"]) for side in ("slope", "slope_right"))
        slopes = f" and dJ/ds jumps from {left} to {right}"
    says = f"At s = {event['s']:.6g} the active set changes, {sides}{slopes}."
    return Facet(problem, says=says, guides=(Guide("x", event["s"], "event"),))


def _rounded(slope: float, jump: float) -> str:
    """What rounding leaves of a zero is none."""
    return number(slope if abs(slope) > ROUNDING * abs(jump) else 0.0, 4)


def stencils(rows: Sequence[Row]) -> Figure | None:
    """How far central quotients over the event are from either slope, whatever the step."""
    drawn = [row for row in rows if row["kind"] == "stencil" and row["off_left"] is not None]
    if not drawn:
        return None
    panels = grouped(drawn, lambda row: row["problem"])
    styles = others(OFF.values())
    finest = min(drawn, key=lambda row: row["step"])
    return Figure(
        "stencils",
        "Central differences over the event",
        f"At h = {finest['step']:.0e} they are still {number(finest['off_left'])} off the left slope and"
        f" {number(finest['off_right'])} off the right one: no step helps.",
        tabulate("kink", drawn, "problem at step quotient_central off_left off_right s"),
        x=(Axis("step", "h / s", scale="log"),),
        y=(Axis("off_left", "distance of the quotient", "problem's", "log"),),
        series=tuple(
            Series(name, styles[name], sorted_by(drawn, places, "step"), facet, y=column)
            for facet, places in enumerate(panels.values())
            for column, name in OFF.items()
        ),
        facets=tuple(Facet(problem) for problem in panels),
    )


def trade(rows: Sequence[Row]) -> Figure | None:
    """What rounding a stop costs and buys."""
    drawn = [row for row in rows if row["kind"] == "trade" and row["off_objective"] is not None]
    if not drawn:
        return None
    panels = grouped(drawn, lambda row: row["problem"])
    over = "k_c" if len({row["k_c"] for row in drawn}) > 1 else "width"
    axes = {"k_c": Axis("k_c", "stiffness of the stop", "N/m", "log"), "width": Axis("width", "width", "m", "log")}
    names = list(dict.fromkeys(f"{row['route']}, s = {row['s']:.3g}" for row in drawn))
    styles = {name: variant(of_route(name.partition(",")[0]), k) for k, name in enumerate(names)}
    return Figure(
        "rounding",
        "What rounding the kink costs",
        "Distance of J and of its slope from those of exact contact, and the curvature an optimizer meets.",
        tabulate(
            "kink",
            drawn,
            "problem route width k_c off_objective off_slope curvature penetration newton_iterations s",
        ),
        x=(axes.pop(over), *axes.values()),
        y=(
            Axis("off_objective", "|J − J of exact contact|", "problem's", "log"),
            Axis("off_slope", "|dJ/ds − that of exact contact|", "problem's", "log"),
            Axis("curvature", "d²J/ds²", "problem's"),
            Axis("newton_iterations", "Newton iterations"),
        ),
        series=tuple(
            Series(name, styles[name], sorted_by(drawn, (places[i] for i in of), over), facet)
            for facet, places in enumerate(panels.values())
            for name, of in grouped([drawn[i] for i in places], lambda r: f"{r['route']}, s = {r['s']:.3g}").items()
        ),
        facets=tuple(Facet(problem) for problem in panels),
    )
