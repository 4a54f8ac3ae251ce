"""Rows of `routes kink`: J and dJ/ds over a common factor s on all moduli, and both sides of the event."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, Range1d, Span

from gradient_routes.bench.lab.drawing import INK, colour, marker, plot, span, swatch
from gradient_routes.bench.lab.numbers import number, table
from gradient_routes.bench.studies.kink.figures import said

NEAR = 1.6  # an event is shown from s / NEAR to s NEAR
REACH = 0.12  # of the tangents beside the event, relative to s


class Kink:
    """The event in a sentence, two curves that break there, slopes from either side by every route."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.table = pn.pane.HTML("", sizing_mode="stretch_width")
        self._x = Range1d(0.25, 4.0)
        self._J = ColumnDataSource({"xs": [], "ys": []})
        self._values = ColumnDataSource({"s": [], "J": [], "set": []})
        self._tangents = ColumnDataSource({"x0": [], "x1": [], "y0": [], "y1": []})
        self._lines = ColumnDataSource({"xs": [], "ys": [], "colour": []})
        self._slopes = ColumnDataSource(slopes([]))
        hover = [("s", "@s{0.0000}"), ("active set", "@set")]
        self._of_J = plot(
            "s, factor on all moduli", "J", title="J(s); short lines: slopes at the event", x_axis_type="log",
            hover=[*hover, ("J", "@J{0.000000e}")], x_range=self._x, y_range=Range1d(0, 1),
        )  # fmt: skip
        self._of_J.multi_line("xs", "ys", source=self._J, color=INK, line_width=2)
        self._of_J.scatter("s", "J", source=self._values, color=INK, size=5)
        self._of_J.segment("x0", "y0", "x1", "y1", source=self._tangents, color=colour("fd-central"), line_width=3)
        self._of_slope = plot(
            "s, factor on all moduli", "dJ/ds", title="dJ/ds by every route", x_axis_type="log",
            hover=[*hover, ("route", "@route"), ("dJ/ds", "@slope{0.000000e}")], x_range=self._x, y_range=Range1d(0, 1),
        )  # fmt: skip
        self._of_slope.multi_line("xs", "ys", source=self._lines, color="colour", line_width=1.5)
        self._of_slope.scatter(
            "s", "slope", source=self._slopes, marker="marker", angle="angle", color="colour", size=7
        )
        self._event = [
            Span(dimension="height", location=1, line_color=INK, line_dash="dashed", visible=False) for _ in "12"
        ]
        for drawn, event in zip((self._of_J, self._of_slope), self._event, strict=True):
            drawn.add_layout(event)

    def panel(self) -> pn.Column:
        figures = [pn.pane.Bokeh(drawn, sizing_mode="stretch_width") for drawn in (self._of_J, self._of_slope)]
        return pn.Column(self.table, *figures, sizing_mode="stretch_width")

    def clear(self) -> None:
        self.rows = []
        self.close()

    def take(self, row: dict[str, Any]) -> None:
        self.rows.append(row)

    def close(self) -> None:
        """All rows have come: draw them."""
        self.table.object = listed(self.rows)
        at = {row["s"]: row for row in self.rows if row["kind"] in ("point", "side") and row["objective"] is not None}
        visits = [at[s] for s in sorted(at)]
        sets = dict.fromkeys(v["active_set"] for v in visits)
        branches = [[v for v in visits if v["active_set"] == name] for name in sets]
        xs, ys = ([[v[key] for v in branch] for branch in branches] for key in ("s", "objective"))
        self._J.data = {"xs": xs, "ys": ys}
        columns = zip(self._values.data, ("s", "objective", "active_set"), strict=True)
        self._values.data = {name: [v[key] for v in visits] for name, key in columns}
        found = slopes(self.rows)
        self._slopes.data, self._lines.data = found, joined(found)
        event = next((row for row in self.rows if row["kind"] == "event"), None)
        s = None if event is None else event["s"]
        for rule in self._event:
            rule.visible, rule.location = s is not None, s or 1.0
        self._tangents.data = tangents(event)
        near = (0.0, float("inf")) if s is None else (s / NEAR, s * NEAR)
        span(self._x, [v["s"] for v in visits] if s is None else near, log=True, margin=0.02)
        span(self._of_J.y_range, [v["objective"] for v in visits if near[0] <= v["s"] <= near[1]])
        seen = [y for x, y in zip(found["s"], found["slope"], strict=True) if near[0] <= x <= near[1]]
        span(self._of_slope.y_range, seen)


def slopes(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """dJ/ds by every route, in the order of s."""
    found: dict[str, list[Any]] = {name: [] for name in ("s", "slope", "set", "route", "marker", "angle", "colour")}
    for row in sorted((r for r in rows if r["route"] and r["slope"] is not None), key=lambda row: row["s"]):
        values = row["s"], row["slope"], row["active_set"], row["route"], *marker(row["route"]), colour(row["route"])
        for column, value in zip(found.values(), values, strict=True):
            column.append(value)
    return found


def joined(found: dict[str, list[Any]]) -> dict[str, list[Any]]:
    """A line a route and active set: nothing is drawn across the jump."""
    lines: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for s, slope, of, route, *_ in zip(*found.values(), strict=True):
        lines.setdefault((route, of), []).append((s, slope))
    xs, ys = ([[point[k] for point in line] for line in lines.values()] for k in (0, 1))
    return {"xs": xs, "ys": ys, "colour": [colour(route) for route, _ in lines]}


def tangents(event: dict[str, Any] | None) -> dict[str, list[float]]:
    """From the event along the slopes on either side."""
    if event is None or event["s"] is None or event["slope"] is None or event["slope_right"] is None:
        return {"x0": [], "x1": [], "y0": [], "y1": []}
    s, J, ds = event["s"], event["objective"], (-REACH * event["s"], REACH * event["s"])
    ends = [J + d * slope for d, slope in zip(ds, (event["slope"], event["slope_right"]), strict=True)]
    return {"x0": [s, s], "x1": [s + d for d in ds], "y0": [J, J], "y1": ends}


def listed(rows: Sequence[dict[str, Any]]) -> str:
    """The sentence of the reports, then a row a route: dJ/ds beside the event and how wrong it is there."""
    event = next((row for row in rows if row["kind"] == "event"), None)
    if event is None:
        return ""
    text = f'<p id="event">{html.escape(said(event))}</p>'
    sides = {(row["route"], row["side"]): row for row in rows if row["kind"] == "side"}
    lines = []
    for route in dict.fromkeys(name for name, _ in sides):
        both = [sides[route, side] for side in ("left", "right")]
        numbers = [
            ["" if row[key] is None else number(row[key], digits) for row in both]
            for key, digits in (("slope", 6), ("gradient_error", 2))
        ]
        lines.append([swatch(route), *numbers[0], *numbers[1]])
    skipped = [
        f"<p>{swatch(row['route'])}: {html.escape(row['reason'])}</p>" for row in rows if row["status"] == "skipped"
    ]
    head = ["route", "dJ/ds left", "dJ/ds right", "error left", "error right"]
    return text + (table(head, lines) if lines else "") + "".join(skipped)
