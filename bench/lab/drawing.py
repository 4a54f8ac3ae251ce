"""Figures of the pages: Bokeh draws them in the colours of the reports, on paper and at night."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable
from typing import Any

from bokeh.models import HoverTool, Legend, Range1d, SaveTool, Title
from bokeh.plotting import figure

from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.style import of_route

LABELS = ".bk-label { color: var(--ink, inherit) !important }"  # a legend is no canvas: --bk-* do not reach it
INK = "#7d858e"  # seen on paper and at night
QUARTER = math.pi / 2.0
MARKERS = {  # of style.py -> those of Bokeh, turned by an angle
    "triangle-down": ("inverted_triangle", 0.0),
    "triangle-up": ("triangle", 0.0),
    "triangle-right": ("triangle", -QUARTER),
    "triangle-left": ("triangle", QUARTER),
    "cross": ("plus", 0.0),
}
SIGNS = {
    "triangle-down": "\u25bc", "triangle-up": "\u25b2", "triangle-right": "\u25b6", "triangle-left": "\u25c0",
    "cross": "\u271a", "diamond": "\u25c6", "square": "\u25a0", "circle": "\u25cf",
}  # fmt: skip


def colour(route: str) -> str:
    """That of a route, to be seen on paper and at night."""
    return of_route(bare(route)).light


def plot(
    x: str, y: str, *, title: str = "", height: int = 260, hover: Iterable[tuple[str, str]] = (), **options: Any
) -> figure:
    """An empty figure, as wide as there is room, its legend above; its ink is that of the page, see lab.css.

    hover   pairs of a label and what is shown, as Bokeh writes it
    """
    drawn = figure(
        title=Title(text=title, text_font_size="12px") if title else None,
        x_axis_label=x,
        y_axis_label=y,
        height=height,
        sizing_mode="stretch_width",
        toolbar_location=None,
        tools="",
        **options,
    )
    legend = Legend(orientation="horizontal", border_line_color=None, background_fill_alpha=0.0, stylesheets=[LABELS])
    drawn.add_layout(legend, "above")
    if hover:
        drawn.add_tools(HoverTool(tooltips=[*hover]))
    return drawn


def marker(route: str) -> tuple[str, float]:
    """That of a route, as Bokeh names it, and the angle by which it is turned."""
    name = of_route(bare(route)).marker
    return MARKERS.get(name, (name, 0.0))


def swatch(route: str, said: str = "") -> str:
    """The name of a route, or what is said in its place, behind its marker, in HTML: a legend."""
    style = of_route(bare(route))
    ink, sign = f"color: light-dark({style.light}, {style.dark})", SIGNS[style.marker]
    return f'<span aria-hidden="true" style="{ink}">{sign}</span> {html.escape(said or route)}'


def span(axis: Range1d, values: Iterable[float | None], log: bool = False, margin: float = 0.06) -> None:
    """Let an axis show all values; those that are no numbers, or have no logarithm, are left out."""
    found = [v for v in values if v is not None and math.isfinite(v) and (v > 0.0 or not log)]
    if not found:
        return
    low, high = min(found), max(found)
    if log:
        wide = max((high / low) ** margin, 1.5)
        axis.start, axis.end = low / wide, high * wide
    else:
        wide = margin * (high - low) or margin * abs(high) or 1.0
        axis.start, axis.end = low - wide, high + wide


def offer_picture(drawn: figure, name: str) -> figure:
    """The figure with a button that saves it as NAME.png, as the browser draws it."""
    for hover in drawn.select(HoverTool):
        hover.visible = False
    drawn.add_tools(SaveTool(filename=name))
    drawn.toolbar_location, drawn.toolbar.logo = "right", None
    return drawn
