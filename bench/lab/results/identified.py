"""Rows of `routes identify`: how many directions of p the data determine, and what they say of every parameter."""

from __future__ import annotations

import html
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, Range1d, Span

from gradient_routes.bench.lab.drawing import INK, colour, offer_picture, plot, span
from gradient_routes.bench.lab.numbers import number, table
from gradient_routes.bench.lab.results.estimates import MOST

KINDS = {"seen": "circle", "weak": "triangle", "blind": "x"}


class Identified:
    """Singular values beside the noise, the null share of every parameter."""

    def __init__(self) -> None:
        self.tables: dict[str, list[dict[str, Any]]] = {}
        self.said = pn.pane.HTML("", sizing_mode="stretch_width")
        self._values = ColumnDataSource({"x": [], "value": []})
        self._shares = ColumnDataSource({"x": [], "share": [], "name": [], "kind": [], "marker": []})
        self._spectrum = plot(
            "number", "singular value of H", height=240, y_axis_type="log", x_range=Range1d(0.4, 8.6),
            y_range=Range1d(1e-3, 1), title="Singular values; rule: the noise", hover=[("", "@x"), ("value", "@value")],
        )  # fmt: skip
        self._spectrum.scatter("x", "value", source=self._values, color=colour("adjoint"), size=9)
        self._noise = Span(dimension="width", location=1, line_color=INK, line_dash="dashed", visible=False)
        self._spectrum.add_layout(self._noise)
        self._of_p = plot(
            "parameter", "null share", height=240, x_range=Range1d(0.4, 8.6), y_range=Range1d(-0.05, 1.05),
            title="Null share; triangle: weak, cross: blind",
            hover=[("", "@name"), ("null share", "@share"), ("", "@kind")],
        )  # fmt: skip
        self._of_p.segment("x", 0, "x", "share", source=self._shares, color=INK)
        self._of_p.scatter("x", "share", source=self._shares, marker="marker", color=INK, size=9)

    def panel(self) -> pn.Column:
        figures = [
            pn.pane.Bokeh(offer_picture(drawn, name), sizing_mode="stretch_width")
            for drawn, name in ((self._spectrum, "spectrum"), (self._of_p, "null_share"))
        ]
        return pn.Column(self.said, *figures, sizing_mode="stretch_width")

    def clear(self) -> None:
        self.tables = {}
        self.close()

    def take(self, row: dict[str, Any]) -> None:
        self.tables.setdefault(row["table"], []).append(row)

    def close(self) -> None:
        spectrum, each = (self.tables.get(name, []) for name in ("spectrum", "identified"))
        whole = self.tables.get("experiments", [])
        self.said.object = listed(self.tables)
        self._values.data = {"x": [r["index_"] for r in spectrum], "value": [r["singular_value"] for r in spectrum]}
        self._shares.data = {
            "x": [*range(1, len(each) + 1)],
            "share": [row["null_share"] for row in each],
            "name": [row["parameter"] for row in each],
            "kind": [row["kind"] for row in each],
            "marker": [KINDS.get(row["kind"], "circle") for row in each],
        }
        noise = whole[0]["sigma"] if whole else None
        self._noise.visible, self._noise.location = bool(noise), noise or 1.0
        for drawn, count in ((self._spectrum, len(spectrum)), (self._of_p, len(each))):
            drawn.x_range.end = max(count, 1) + 0.6
        span(self._spectrum.y_range, [*self._values.data["value"], noise], log=True)


def listed(tables: dict[str, list[dict[str, Any]]]) -> str:
    """What the data determine, and a row a parameter."""
    if not tables.get("experiments"):
        return ""
    whole, each = tables["experiments"][0], tables.get("identified", [])
    found = (
        f'<p id="rank">{whole["rank"]} of {len(each)} directions identifiable from {whole["data"]} data, above the '
        f"noise {number(whole['sigma'], 3)}; parameters: {len(each) - whole['blind'] - whole['weak']} seen, "
        f"{whole['weak']} weak, {whole['blind']} blind</p>"
        if whole["sigma"] is not None
        else f'<p id="rank">{whole["rank"]} of {len(each)} directions identifiable from {whole["data"]} data</p>'
    )
    lines = [
        [
            html.escape(row["parameter"]),
            *("" if row[k] is None else number(row[k], 3) for k in ("column_norm", "null_share", "posterior_sd")),
            html.escape(row["kind"]),
        ]
        for row in each[:MOST]
    ]
    return f'<div class="judged">{found}</div>' + table(["parameter", "|H e|", "null share", "+/-", ""], lines)
