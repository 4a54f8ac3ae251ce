"""Figures for a paper: what the page shows first, drawn by Matplotlib as PNG, SVG and PDF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from gradient_routes.bench.render.figure import Axis, Figure, Section
from gradient_routes.bench.render.marks import SOFT, Panel, draw, plain
from gradient_routes.problems.errors import InputError

FORMATS = ("png", "svg", "pdf")
PANELS = 6  # of a figure, at most
COLUMN, PAGE = 4.2, 8.4  # [in] of one panel, of two
INK, GRID = "#1b1f24", "#e4e7ea"
STYLE: Any = {
    "font.size": 8.0,
    "axes.edgecolor": "#b9bfc6",
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlesize": 8.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "grid.color": GRID,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.0,
    "legend.frameon": False,
    "legend.fontsize": 7.0,
    "svg.hashsalt": "routes",
    "pdf.fonttype": 42,
}
WHEN = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}  # the same bytes from the same numbers


def check(folder: Path) -> None:
    """Raise InputError where nothing can be drawn, before anything is."""
    if find_spec("matplotlib") is None:
        raise InputError("--figures: needs Matplotlib - pip install 'gradient-routes[pictures]'")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".routes").touch()
        (folder / ".routes").unlink()
    except OSError as error:
        raise InputError(f"--figures {folder}: {error.strerror} - name a folder you may write") from error


def write(sections: Sequence[Section], folder: Path) -> list[str]:
    """Every figure in every format; the names of what was drawn. Raises InputError."""
    import matplotlib

    drawn = []
    with matplotlib.rc_context(STYLE):
        for figure in (figure for section in sections for figure in section.figures if figure.series):
            made = picture(figure)
            made.draw_without_rendering()  # what takes the time is the layout: once for all formats
            made.set_layout_engine("none")
            for format in FORMATS:
                path = folder / f"{figure.id}.{format}"
                try:
                    made.savefig(path, dpi=200, metadata=WHEN[format])
                except OSError as error:
                    raise InputError(f"--figures {path}: {error.strerror} - name a folder you may write") from error
            drawn.append(figure.id)
    return drawn


def panels(figure: Figure) -> list[Panel]:
    """Those that are drawn."""
    facets = dict.fromkeys(series.facet for series in figure.series)
    return [Panel(facet, figure.facets[facet], value) for facet in facets for value in valued(figure, facet)][:PANELS]


def valued(figure: Figure, facet: int) -> list[Axis | None]:
    """What cells of a panel are coloured by: what is known of them."""
    if figure.mark != "cells":
        return [None]
    rows = [i for series in figure.series if series.facet == facet for i in series.rows]
    return [v for v in figure.values if any(figure.table.column(v.column)[i] is not None for i in rows)]


def picture(figure: Figure) -> Any:
    """A Matplotlib figure."""
    from matplotlib.figure import Figure as Canvas

    shown = panels(figure)
    columns = min(2, len(shown))
    rows = math.ceil(len(shown) / columns)
    canvas = Canvas(figsize=(PAGE if columns == 2 else 1.3 * COLUMN, 2.9 * rows), layout="constrained")
    for k, panel in enumerate(shown):
        axes = canvas.add_subplot(rows, columns, k + 1)
        axes.set_title(plain(panel.title), wrap=True)
        draw(axes, figure, panel)
    _legend(canvas, figure, shown)
    return canvas


def _legend(canvas: Any, figure: Figure, shown: Sequence[Panel]) -> None:
    """Each name once, below."""
    entries: dict[str, Any] = {}
    for axes in canvas.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if len(entries) > 1:
        columns = min(4, len(entries))
        canvas.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=columns)
