"""Rows of `routes invert`: how it ended, estimates with error bars, blind parameters, residuals against the noise."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import panel as pn
from bokeh.models import BoxAnnotation, ColumnDataSource, Range1d

from gradient_routes.bench.lab.drawing import INK, colour, offer_picture, plot, span
from gradient_routes.bench.lab.inverted import blind
from gradient_routes.bench.lab.numbers import number, table

NOISE = 2.0  # standard deviations within which residuals of a right model mostly lie
MOST = 200  # rows of a table


class Inversion:
    """Sentences of the command, what was found, how well the data are met."""

    def __init__(self) -> None:
        self.steps: list[dict[str, Any]] = []
        self.tables: dict[str, list[dict[str, Any]]] = {}
        self.said = pn.pane.HTML("", sizing_mode="stretch_width")
        self.found = pn.pane.HTML("", sizing_mode="stretch_width")
        self._estimates = ColumnDataSource(estimates([]))
        self._blind = ColumnDataSource(blind([]))
        self._residuals = ColumnDataSource(residuals([]))
        self._of_p = plot(
            "parameter", "estimate, its own unit", height=300, x_range=Range1d(0.4, 8.6), y_range=Range1d(-1, 1),
            title="Estimates; squares: start; hatched: blind",
            hover=[("", "@name"), ("estimate", "@estimate"), ("+/-", "@sd"), ("start", "@start")],
        )  # fmt: skip
        self._of_p.vstrip(
            "left", "right", source=self._blind, fill_alpha=0.0, line_alpha=0.0, hatch_pattern="right_diagonal_line",
            hatch_color=INK, hatch_alpha=0.5,
        )  # fmt: skip
        self._of_p.scatter("x", "start", source=self._estimates, marker="square", color=INK, size=6, fill_alpha=0.0)
        self._of_p.segment("x", "low", "x", "high", source=self._estimates, color=colour("adjoint"), line_width=2)
        for end in ("low", "high"):
            self._of_p.scatter("x", end, source=self._estimates, marker="dash", color=colour("adjoint"), size=14)
        self._of_p.scatter("x", "estimate", source=self._estimates, color=colour("adjoint"), size=6)
        self._of_r = plot(
            "datum", "(S u - d) / noise", height=240, x_range=Range1d(0.4, 8.6), y_range=Range1d(-3, 3),
            title="Residuals; band: 2 sd of the noise",
            hover=[("", "@name"), ("measured", "@measured"), ("residual", "@residual")],
        )  # fmt: skip
        self._band = BoxAnnotation(bottom=-NOISE, top=NOISE, fill_color=INK, fill_alpha=0.12, line_color=None)
        self._of_r.add_layout(self._band)
        self._of_r.segment("x", 0, "x", "shown", source=self._residuals, color=INK)
        self._of_r.scatter("x", "shown", source=self._residuals, color=INK, size=7)

    def panel(self) -> pn.Column:
        figures = [
            pn.pane.Bokeh(offer_picture(drawn, name), sizing_mode="stretch_width")
            for drawn, name in ((self._of_p, "estimates"), (self._of_r, "residuals"))
        ]
        return pn.Column(self.said, figures[0], self.found, figures[1], sizing_mode="stretch_width")

    def clear(self) -> None:
        self.steps, self.tables = [], {}
        self._draw()

    def take(self, row: dict[str, Any]) -> None:
        if row["table"] == "inversion":
            self.steps.append(row)
            self.said.object = said(self.steps, [])
        else:
            self.tables.setdefault(row["table"], []).append(row)

    def close(self) -> None:
        self._draw()

    def _draw(self) -> None:
        p, r = estimates(self.tables.get("estimates", [])), residuals(self.tables.get("residuals", []))
        self.said.object = said(self.steps, self.tables.get("fit", []))
        self.found.object = listed(self.tables)
        self._estimates.data, self._residuals.data = p, r
        self._blind.data = blind(self.tables.get("estimates", []))
        for drawn, data in ((self._of_p, p), (self._of_r, r)):
            drawn.x_range.end = max(len(data["x"]), 1) + 0.6
        span(self._of_p.y_range, [*p["low"], *p["high"], *p["start"]])
        scaled = any(row["standardized"] is not None for row in self.tables.get("residuals", []))
        self._band.visible = scaled
        self._of_r.yaxis.axis_label = "(S u - d) / noise" if scaled else "S u - d, unit of the data"
        span(self._of_r.y_range, [*r["shown"], *([-1.5 * NOISE, 1.5 * NOISE] if scaled else [0.0])])


def said(steps: Sequence[dict[str, Any]], fits: Sequence[dict[str, Any]]) -> str:
    """How far it is, or how it ended and whether the model explains the data, in the words of the command."""
    if not steps:
        return ""
    last = steps[-1]
    if not last["says"]:
        return (
            f"<p>step {last['iteration']}: J = {number(last['objective'])}, {last['forward_solves']} forward solves</p>"
        )
    lines = [f'<p id="ended">{html.escape(last["says"])}</p>']
    for fit in fits:
        kind = "good" if fit["verdict"] == "explained" else "bad"
        noise = (
            "" if fit["noise"] is None else f", noise {number(fit['noise'], 2)} ({html.escape(fit['noise_source'])})"
        )
        chi2 = "" if fit["chi2"] is None else f", chi<sup>2</sup> per datum {number(fit['chi2'], 3)}"
        mark = f'<span aria-hidden="true">{"✓" if kind == "good" else "✗"}</span>'
        word = f'<span class="verdict {kind}">{html.escape(fit["verdict"])}</span>'
        rms = number(fit["rms"], 2)
        lines.append(
            f'<p id="fit">{mark} {"the data are " if kind == "good" else ""}{word}: {fit["data"]} data, '
            f"rms of residuals {rms}{noise}{chi2}</p>"
        )
    return f'<div class="judged" role="status">{"".join(lines)}</div>'


def listed(tables: dict[str, list[dict[str, Any]]]) -> str:
    """Estimates, and constants where the problem has some."""
    rows = tables.get("estimates", [])
    lines = [
        [
            html.escape(row["parameter"]),
            *("" if row[k] is None else number(row[k], 6) for k in ("start", "estimate")),
            "" if row["sd"] is None else number(row["sd"], 3), "blind" if row["blind"] else "",
        ]
        for row in rows[:MOST]
    ]  # fmt: skip
    found = table(["parameter", "start", "estimate", "+/-", ""], lines) if lines else ""
    found += f"<p>{len(rows) - MOST} further ones are in the CSV file.</p>" if len(rows) > MOST else ""
    constants = [
        [html.escape(row["constant"]), number(row["value"], 6), "" if row["sd"] is None else number(row["sd"], 3)]
        for row in tables.get("constants", [])
    ]
    return (table(["constant", "value", "+/-"], constants) if constants else "") + found


def estimates(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """A point a parameter, with the ends of its error bar."""
    sd = [row["sd"] or 0.0 for row in rows]
    values = [row["estimate"] for row in rows]
    return {
        "x": [*range(1, len(rows) + 1)],
        "name": [row["parameter"] for row in rows],
        "start": [row["start"] for row in rows],
        "estimate": values,
        "sd": [row["sd"] for row in rows],
        "low": [v - s for v, s in zip(values, sd, strict=True)],
        "high": [v + s for v, s in zip(values, sd, strict=True)],
    }


def residuals(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """In standard deviations of the noise, where it is known."""
    shown = [row["residual"] if row["standardized"] is None else row["standardized"] for row in rows]
    return {
        "x": [*range(1, len(rows) + 1)],
        "shown": shown,
        "name": [row["datum"] for row in rows],
        "measured": [row["measured"] for row in rows],
        "residual": [row["residual"] for row in rows],
    }
