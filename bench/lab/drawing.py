"""Figures of the pages: Bokeh draws them in the colours of the reports, on paper and at night."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from bokeh.models import HoverTool, Legend, Range1d
from bokeh.plotting import figure

from gradient_routes.bench.render.style import of_route

LABELS = ".bk-label { color: var(--ink, inherit) !important }"  # a legend is no canvas: --bk-* do not reach it
INK = "#7d858e"  # seen on paper and at night


def colour(route: str) -> str:
    """That of a route, to be seen on paper and at night."""
    return of_route(route).light


def plot(
    x: str, y: str, *, title: str = "", height: int = 260, hover: Iterable[tuple[str, str]] = (), **options: Any
) -> figure:
    """An empty figure, as wide as there is room, its legend above; its ink is that of the page, see lab.css.

    hover   pairs of a label and what is shown, as Bokeh writes it
    """
    drawn = figure(
        title=title or None,
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
