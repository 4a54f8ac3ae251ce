"""Rows of `routes unrolling`: errors and tape of unrolled AD against its iterations."""

from __future__ import annotations

import html
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, Range1d, Span

from gradient_routes.bench.lab.drawing import INK, colour, plot, span
from gradient_routes.bench.lab.numbers import number, table
from gradient_routes.bench.render.format import bytes_
from gradient_routes.bench.studies.unrolling.figures import says

COLUMNS = ("iterations", "gradient_error", "objective_error", "tape_bytes", "products")
HEAD = ("iterations k", "error of dJ/dp", "error of J", "tape", "products with R_u", "status")
NOTHING = 1e-17  # where an error of exactly 0 is drawn


class Unrolling:
    """A table with a row for every k, the error of the gradient and of J, the tape."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.fits: list[dict[str, Any]] = []
        self.table = pn.pane.HTML("", sizing_mode="stretch_width")
        self._points = ColumnDataSource({name: [] for name in COLUMNS})
        hover = [
            ("k", "@iterations"),
            ("dJ/dp", "@gradient_error{0.0e}"),
            ("J", "@objective_error{0.0e}"),
            ("tape", "@tape_bytes byte"),
        ]
        self._x = Range1d(0.8, 16)
        self._errors = plot(
            "k, iterations on the tape", "error, relative",
            title="dJ/dp; broken: J; rule: implicit-ad", hover=hover,
            x_axis_type="log", y_axis_type="log", x_range=self._x, y_range=Range1d(NOTHING, 1),
        )  # fmt: skip
        self._tape = plot(
            "k, iterations on the tape", "tape [byte]", title="Tape", hover=hover, x_axis_type="log", y_axis_type="log",
            x_range=self._x, y_range=Range1d(100, 10_000),
        )  # fmt: skip
        for drawn, column, dash, ink in (
            (self._errors, "objective_error", "dashed", INK),
            (self._errors, "gradient_error", "solid", colour("unrolled-ad")),
            (self._tape, "tape_bytes", "solid", colour("unrolled-ad")),
        ):
            drawn.line("iterations", column, source=self._points, color=ink, line_dash=dash, line_width=2)
            drawn.scatter("iterations", column, source=self._points, color=ink, size=7)
        self._implicit = Span(
            dimension="width", location=1, line_color=colour("implicit-ad"), line_dash="dotted", visible=False
        )
        self._errors.add_layout(self._implicit)

    def panel(self) -> pn.Column:
        figures = [pn.pane.Bokeh(drawn, sizing_mode="stretch_width") for drawn in (self._errors, self._tape)]
        return pn.Column(self.table, *figures, sizing_mode="stretch_width")

    def clear(self) -> None:
        self.rows, self.fits = [], []
        self._draw()

    def close(self) -> None:
        """All rows have come; they are drawn already."""

    def take(self, row: dict[str, Any]) -> None:
        (self.fits if row["table"] == "unrolling_fits" else self.rows).append(row)
        self._draw()

    def _draw(self) -> None:
        sentence = f'<p id="met">{html.escape(says(self.fits))}</p>' if self.fits else ""
        self.table.object = sentence + (table(HEAD, map(cells, self.rows), "by unrolled-ad") if self.rows else "")
        drawn = [row for row in self.rows if row["checkpoint"] is None and row["gradient_error"] is not None]
        data = {name: [row[name] for row in drawn] for name in COLUMNS}
        for name in ("gradient_error", "objective_error"):
            data[name] = [None if e is None else max(e, NOTHING) for e in data[name]]
        self._points.data = data
        implicit = next((fit["implicit_error"] for fit in self.fits if fit["implicit_error"]), None)
        self._implicit.visible, self._implicit.location = implicit is not None, implicit or 1.0
        span(self._x, data["iterations"], log=True, margin=0.02)
        span(self._errors.y_range, [*data["gradient_error"], *data["objective_error"], implicit, 1.0], log=True)
        span(self._tape.y_range, data["tape_bytes"], log=True)


def cells(row: dict[str, Any]) -> list[str]:
    errors = ("" if row[name] is None else number(row[name], 2) for name in ("gradient_error", "objective_error"))
    status = row["status"] if row["status"] == "ok" else f"{row['status']}: {row['reason'] or ''}"
    return [str(row["iterations"]), *errors, bytes_(row["tape_bytes"]), str(row["products"] or ""), html.escape(status)]
