"""Rows of `routes run --gradient`: gradients beside their reference, their errors, what they cost."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, FixedTicker, Range1d

from gradient_routes.bench.lab.drawing import INK, colour, marker, plot, span, swatch
from gradient_routes.bench.lab.numbers import number, table
from gradient_routes.bench.render.format import bytes_

WORK = {
    "forward_solves": "forward solves",
    "linearized_solves": "linearized solves",
    "transposed_solves": "transposed solves",
    "matvecs": "products with R_u",
}
NOTHING = 1e-18  # where an error of exactly 0 is drawn
SPREAD = 0.6  # of the routes at one component
LEAST = 0.5  # below the first count
HEAD = ("route", "error", "estimated", *WORK.values(), "memory", "tape", "status")


class Bill:
    """A table with a row a route; dJ/dp, its error and the counted work, drawn in the routes' colours and markers."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.table = pn.pane.HTML("", sizing_mode="stretch_width")
        self._reference = ColumnDataSource({"x": [], "g": [], "name": []})
        self._points = ColumnDataSource(self._columns([]))
        self._counts = ColumnDataSource(self._counted([]))
        hover = [
            ("route", "@route"),
            ("parameter", "@name"),
            ("dJ/dp", "@g{0.000000e}"),
            ("reference", "@exact{0.000000e}"),
        ]
        self._g = plot(
            "parameter", "dJ/dp", title="dJ/dp; bars: the reference", hover=hover,
            x_range=Range1d(0.4, 1.6), y_range=Range1d(-1, 1),
        )  # fmt: skip
        self._g.vbar("x", 0.85, "g", source=self._reference, color=INK, fill_alpha=0.25, line_color=INK)
        self._off = plot(
            "parameter", "|g - g_ref| / max |g_ref|", title="Error by component; 0 stands at 1e-18",
            y_axis_type="log", hover=[*hover, ("error", "@error{0.0e}")], x_range=self._g.x_range,
            y_range=Range1d(NOTHING, 1),
        )  # fmt: skip
        for drawn, y in ((self._g, "g"), (self._off, "shown")):
            drawn.scatter("x", y, source=self._points, marker="marker", angle="angle", color="colour", size=9)
        self._work = plot(
            "", "count", title="Counted work", y_axis_type="log", hover=[("route", "@route"), ("@kind", "@count")],
            x_range=Range1d(0.4, len(WORK) + 0.6), y_range=Range1d(LEAST, 10),
        )  # fmt: skip
        self._work.segment("x", "low", "x", "count", source=self._counts, color="colour", line_width=3)
        self._work.scatter("x", "count", source=self._counts, marker="marker", angle="angle", color="colour", size=10)
        self._work.xaxis.ticker = FixedTicker(ticks=[*range(1, len(WORK) + 1)])
        self._work.xaxis.major_label_overrides = {
            i: words.replace(" ", "\n", 1) for i, words in enumerate(WORK.values(), start=1)
        }
        self._work.xgrid.visible = False

    def panel(self) -> pn.Column:
        figures = [pn.pane.Bokeh(drawn, sizing_mode="stretch_width") for drawn in (self._g, self._off, self._work)]
        return pn.Column(self.table, *figures, sizing_mode="stretch_width")

    def clear(self) -> None:
        self.rows = []
        self._draw()

    def close(self) -> None:
        """All rows have come; they are drawn already."""

    def take(self, row: dict[str, Any]) -> None:
        self.rows.append(row)
        self._draw()

    def _draw(self) -> None:
        self.table.object = listed(self.rows)
        judged = next((row for row in self.rows if row.get("gradient_reference")), None)
        given = next((row for row in self.rows if row.get("parameters")), None)
        labels: list[str] = [] if given is None else given["parameters"]
        reference: list[float] = [] if judged is None else judged["gradient_reference"]
        x = [*range(1, len(reference) + 1)]
        self._reference.data = {"x": x, "g": reference, "name": labels[: len(reference)]}
        points, counts = self._columns(self.rows), self._counted(self.rows)
        self._points.data, self._counts.data = points, counts
        self._g.x_range.end = max(len(labels), 1) + 0.6
        span(self._g.y_range, [*points["g"], *reference, 0.0])
        span(self._off.y_range, [*points["shown"], NOTHING], log=True)
        span(self._work.y_range, [*counts["count"], LEAST, 10], log=True)
        if given is not None:
            units = "".join(f" [{unit}]" for unit in dict.fromkeys(given["units"]) if unit)
            self._g.xaxis.axis_label = self._off.xaxis.axis_label = f"parameter, {labels[0]} to {labels[-1]}{units}"

    @staticmethod
    def _columns(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
        """A point for every component by every route."""
        found: dict[str, list[Any]] = {
            name: [] for name in ("x", "g", "exact", "error", "shown", "route", "name", "marker", "angle", "colour")
        }
        measured = [row for row in rows if row.get("parameters") and row["gradient"]]
        for k, row in enumerate(measured):
            g, n = row["gradient"], len(row["gradient"])
            errors = off(row)
            shift = SPREAD * ((k + 0.5) / len(measured) - 0.5)
            drawn, angle = marker(row["route"])
            found["x"] += [i + 1 + shift for i in range(n)]
            found["g"] += g
            found["exact"] += row["gradient_reference"] or [None] * n
            found["error"] += errors
            found["shown"] += [None if e is None else max(e, NOTHING) for e in errors]
            found["name"] += row["parameters"]
            for name, value in (
                ("route", named(row)),
                ("marker", drawn),
                ("angle", angle),
                ("colour", colour(row["route"])),
            ):
                found[name] += [value] * n
        return found

    @staticmethod
    def _counted(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
        """A count for every kind of work by every route; no work is not drawn."""
        found: dict[str, list[Any]] = {
            name: [] for name in ("x", "low", "count", "route", "kind", "marker", "angle", "colour")
        }
        measured = [row for row in rows if row["work"]]
        for k, row in enumerate(measured):
            drawn, angle = marker(row["route"])
            counts = work(row)
            for i, (name, words) in enumerate(WORK.items(), start=1):
                if counts[name]:
                    values = (
                        i + SPREAD * ((k + 0.5) / len(measured) - 0.5), LEAST, counts[name], named(row), words,
                        drawn, angle, colour(row["route"]),
                    )  # fmt: skip
                    for column, value in zip(found.values(), values, strict=True):
                        column.append(value)
        return found


def off(row: dict[str, Any]) -> list[float | None]:
    """|g_i - g_ref,i| / max |g_ref| of every component; absolute where the reference is 0."""
    reference = row["gradient_reference"]
    if reference is None:
        return [None] * len(row["gradient"])
    exact = np.array(reference)
    scale = float(np.abs(exact).max(initial=0.0)) or 1.0
    return [float(e) for e in np.abs(np.array(row["gradient"]) - exact) / scale]


def named(row: dict[str, Any]) -> str:
    """A route with the options that a page sets."""
    shown = {key: (row["route_options"] or {}).get(key) for key in ("step", "iterations", "fault")}
    said = ",".join(f"{key}={value}" for key, value in shown.items() if value is not None)
    return f"{row['route']}[{said}]" if said else str(row["route"])


def work(row: dict[str, Any]) -> dict[str, int]:
    """Counts of WORK; linear solves of Newton's method belong to the forward solves."""
    counted = row["work"]
    return counted | {"linearized_solves": counted["solves"] - counted["newton_iterations"]} if counted else {}


def listed(rows: Sequence[dict[str, Any]]) -> str:
    """The table."""
    return table(HEAD, [cells(row) for row in rows], "error: |g - g_ref| / |g_ref|") if rows else ""


def cells(row: dict[str, Any]) -> list[str]:
    counts = work(row)
    status = html.escape(row["status"] if row["status"] == "ok" else f"{row['status']}: {row['reason'] or ''}")
    return [
        swatch(named(row)),
        *("" if row[name] is None else number(row[name], 2) for name in ("gradient_error", "gradient_error_estimate")),
        *(str(counts.get(name, "")) for name in WORK),
        bytes_(row["peak_bytes"], 2**20), bytes_(row["tape_bytes"]),
        f'<span class="{"quiet" if row["status"] == "ok" else "bad"}">{status}</span>',
    ]  # fmt: skip
