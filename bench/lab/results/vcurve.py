"""What `routes vcurve` says: the verdict in its words, error of difference quotients against the step, the evidence."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, Range1d, Span

from gradient_routes.bench.lab.drawing import INK, colour, marker, plot, span, swatch
from gradient_routes.bench.lab.numbers import number, table
from gradient_routes.bench.render.html import badge, kind_of

QUOTIENTS = {"error_one_sided": ("one-sided", "fd-one-sided"), "error_central": ("central", "fd-central")}
MARKS = {"good": "\u2713", "bad": "\u2717", "unsure": "?"}
SOUND = {True: "ok", False: "NO", None: "?"}
FACTS = {
    "floor": "floor, least error", "best_step": "best step", "slope_one_sided": "slope, one-sided",
    "slope_central": "slope, central", "roundoff_slope": "slope of round-off", "window": "decades of usable steps",
    "plateau": "plateau", "calls": "objective calls", "gradient_calls": "gradients",
}  # fmt: skip


class VCurve:
    """The verdict, the curves with floor and best step, facts and evidence."""

    def __init__(self) -> None:
        self.verdict = pn.pane.HTML("", sizing_mode="stretch_width")
        self.facts = pn.pane.HTML("", sizing_mode="stretch_width")
        self._legend = " &nbsp; ".join(swatch(route, f"{name} quotient") for name, route in QUOTIENTS.values())
        self._lines, self._points = ColumnDataSource(lines([])), ColumnDataSource(points([]))
        self._drawn = plot(
            "step h, relative", "error |quotient - g.v|, relative", height=360, x_axis_type="log", y_axis_type="log",
            hover=[("", "@line"), ("quotient", "@kind"), ("h", "@h{0.0e}"), ("error", "@error{0.00e}")],
            x_range=Range1d(1e-17, 10), y_range=Range1d(1e-12, 10),
        )  # fmt: skip
        self._drawn.multi_line("xs", "ys", source=self._lines, color="colour", line_dash="dash", line_width=1.5)
        self._drawn.scatter("h", "error", source=self._points, marker="marker", color="colour", size=5)
        look = {"line_color": INK, "line_dash": "dashed", "visible": False}
        self._floor, self._best = (
            Span(dimension="width", location=1, **look),
            Span(dimension="height", location=1, **look),
        )
        self._drawn.add_layout(self._floor)
        self._drawn.add_layout(self._best)

    def panel(self) -> pn.Column:
        legend = pn.pane.HTML(
            f"<p>{self._legend}; broken lines: with a tightened solve; rules: floor, best step.</p>",
            sizing_mode="stretch_width",
        )
        return pn.Column(
            self.verdict, legend, pn.pane.Bokeh(self._drawn, sizing_mode="stretch_width"), self.facts,
            sizing_mode="stretch_width",
        )  # fmt: skip

    def clear(self) -> None:
        self.verdict.object = self.facts.object = ""
        self._lines.data, self._points.data = lines([]), points([])
        self._floor.visible = self._best.visible = False

    def close(self) -> None:
        """All rows have come; they are drawn already."""

    def take(self, check: dict[str, Any]) -> None:
        self.verdict.object, self.facts.object = judged(check), facts(check)
        self._lines.data, self._points.data = lines(check["points"]), points(check["points"])
        span(self._drawn.x_range, self._points.data["h"], log=True, margin=0.02)
        span(self._drawn.y_range, self._points.data["error"], log=True)
        for rule, value in ((self._floor, check["floor"]), (self._best, check["best_step"])):
            rule.visible = bool(value)
            rule.location = value or 1.0


def judged(check: dict[str, Any]) -> str:
    """The sentences of `routes vcurve`, word for word, with a colour and a mark."""
    verdict = check["verdict"]
    name, says, todo = (html.escape(check[key] or "") for key in ("name", "says", "next"))
    mark = f'<span aria-hidden="true">{MARKS[kind_of(verdict)]}</span>'
    return (
        f'<div class="judged" role="status"><p>{mark} <span id="verdict">{name}: {badge(verdict)}'
        f'</span></p><p id="says">{says}</p><p id="next">next: {todo}</p></div>'
    )


def facts(check: dict[str, Any]) -> str:
    """Numbers of the deciding line, and one row a test."""
    known = [[words, number(check[key], 3)] for key, words in FACTS.items() if check[key] is not None]
    tests = [
        [
            html.escape(f["name"]),
            *("" if f["claim"] or f[key] is None else number(f[key], 2) for key in ("value", "limit")),
            SOUND[f["sound"]], html.escape("; ".join(filter(None, (f["says"], f["culprit"])))),
        ]
        for f in check["findings"]
    ]  # fmt: skip
    wrong = [
        [html.escape(w["name"]), *(number(w[key], 6) for key in ("given", "found"))] for w in check["worst_components"]
    ]
    parts = [table(["of the deciding line", ""], known)]
    parts += [table(["component that differs", "gradient", "differences"], wrong)] if wrong else []
    evidence = table(["evidence", "value", "limit", "", "says"], tests)
    parts += [f"<details><summary>evidence: {len(tests)} tests</summary>{evidence}</details>"] if tests else []
    return "".join(parts) + "".join(f"<p>note: {html.escape(remark)}</p>" for remark in check["remarks"])


def lines(points: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """A line for each quotient along each direction, solves as they are and tightened."""
    found: dict[str, list[Any]] = {name: [] for name in ("xs", "ys", "colour", "dash")}
    for of in dict.fromkeys((p["line"], p["tightened"]) for p in points):
        own = [p for p in points if (p["line"], p["tightened"]) == of]
        for key, (_, route) in QUOTIENTS.items():
            drawn = [(p["step"], p[key]) for p in own if p[key]]
            found["xs"].append([h for h, _ in drawn])
            found["ys"].append([e for _, e in drawn])
            found["colour"].append(colour(route))
            found["dash"].append("solid" if of[1] in (1.0, None) else "dashed")
    return found


def points(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """A point for each quotient at each step whose error has a logarithm."""
    found: dict[str, list[Any]] = {name: [] for name in ("h", "error", "line", "kind", "marker", "colour")}
    for row in rows:
        for key, (kind, route) in QUOTIENTS.items():
            if row[key]:
                values = row["step"], row[key], row["line"], kind, marker(route)[0], colour(route)
                for column, value in zip(found.values(), values, strict=True):
                    column.append(value)
    return found
