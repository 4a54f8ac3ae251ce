"""Figures for a paper: what the page shows first, drawn by Matplotlib as PNG, SVG and PDF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bench.report.figure import Axis, Facet, Figure, Section, Series
from bench.report.style import Marker, Style
from problems.errors import InputError

FORMATS = ("png", "svg", "pdf")
PANELS = 6  # of a figure, at most
COLUMN, PAGE = 4.2, 8.4  # [in] of one panel, of two
SHAPES: dict[Marker, str] = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "up": "^",
    "down": "v",
    "right": ">",
    "plus": "P",
    "cross": "X",
}
INK, SOFT, GRID = "#1b1f24", "#596069", "#e4e7ea"
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


@dataclass(frozen=True)
class Panel:
    """One pair of axes: which facet, and of cells which value."""

    facet: int
    about: Facet
    value: Axis | None = None

    @property
    def title(self) -> str:
        parts = (self.about.name, self.value.label if self.value else "", self.about.verdict)
        return ": ".join(filter(None, parts))


def panels(figure: Figure) -> list[Panel]:
    """Those that are drawn."""
    facets = dict.fromkeys(series.facet for series in figure.series)
    known = [v for v in figure.values if any(w is not None for w in figure.table.column(v.column))]
    values: list[Axis | None] = [*known] if figure.mark == "cells" else [None]
    return [Panel(facet, figure.facets[facet], value) for facet in facets for value in values][:PANELS]


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
        _draw(axes, figure, panel)
    _legend(canvas, figure, shown)
    return canvas


def plain(words: str) -> str:
    """Nothing in it is mathematics to Matplotlib."""
    return words.replace("$", r"\$")


def _draw(axes: Any, figure: Figure, panel: Panel) -> None:
    x, y = figure.x[0], figure.y[0]
    own = [series for series in figure.series if series.facet == panel.facet]
    if figure.mark == "cells":
        _cells(axes, figure, own, panel)
    elif figure.mark in ("bars", "ranges"):
        (_bars if figure.mark == "bars" else _ranges)(axes, figure, own)
    else:
        if figure.front:
            _fronts(axes, figure)
        for series in own:
            _points(axes, figure, series)
        _scaled(axes, "y", y, figure, own)
        axes.set_ylabel(y.titled)
    _scaled(axes, "x", x, figure, own)
    axes.set_xlabel(x.titled)
    for guide in panel.about.guides:
        shown = {"x": x, "y": y}[guide.axis].column
        if not guide.column or guide.column == shown:
            line = axes.axvline if guide.axis == "x" else axes.axhline
            line(guide.value, color=SOFT, linestyle="--", linewidth=0.9)
    if figure.diagonal:
        low, high = max(axes.get_xlim()[0], axes.get_ylim()[0]), min(axes.get_xlim()[1], axes.get_ylim()[1])
        axes.plot([low, high], [low, high], color=SOFT, linestyle="--", linewidth=0.9)


def _values(figure: Figure, series: Series) -> list[tuple[int, Any, Any]]:
    """Row, x and y of what is known."""
    x = figure.table.column(series.x or figure.x[0].column)
    y = figure.table.column(series.y or figure.y[0].column)
    return [(i, x[i], y[i]) for i in series.rows if x[i] is not None and y[i] is not None]


def _look(style: Style, line: bool) -> dict[str, Any]:
    dash = [float(part) / 1.8 for part in style.dash.split()]
    return {
        "color": style.light,
        "marker": SHAPES[style.marker],
        "markerfacecolor": "white" if style.hollow else style.colour,
        "markeredgecolor": style.light,
        "linestyle": "none" if not line else (0, tuple(dash)) if dash else "-",
    }


def _points(axes: Any, figure: Figure, series: Series) -> None:
    points = _values(figure, series)
    if not points:
        return
    _, x, y = zip(*points, strict=True)
    look = _look(series.style, figure.mark == "line")
    axes.plot(x, y, markersize=2.0 if len(x) > 40 and figure.mark == "line" else 4.0, label=plain(series.name), **look)
    if figure.note:
        words = figure.table.column(figure.note)
        for row, *at in points:
            if words[row]:
                axes.annotate(plain(words[row]), at, xytext=(5, 5), textcoords="offset points", fontsize=7)


def _fronts(axes: Any, figure: Figure) -> None:
    """Of each problem: what no other route beats on both axes."""
    problems = figure.table.column("problem")
    points = sorted((x, y, problems[i]) for series in figure.series for i, x, y in _values(figure, series))
    for problem in dict.fromkeys(problems):
        front: list[tuple[float, float]] = []
        for x, y, whose in points:
            if whose == problem and (not front or y < front[-1][1]):
                front.append((x, y))
        if len(front) > 1:
            axes.plot(*zip(*front, strict=True), color=SOFT, linewidth=0.6, alpha=0.5)


def _scaled(axes: Any, which: str, axis: Axis, figure: Figure, own: Sequence[Series]) -> None:
    """Logarithmic, with a place for zeros below the least number."""
    if axis.scale != "log":
        return
    place = 1 if which == "x" else 2
    values = [abs(point[place]) for series in own for point in _values(figure, series)]
    least = min((value for value in values if value > 0.0), default=None)
    scale = axes.set_xscale if which == "x" else axes.set_yscale
    if least is None:
        return
    if 0.0 in values:
        scale("symlog", linthresh=least, linscale=1.0)
    else:
        scale("log")


def _categories(axes: Any, figure: Figure, own: Sequence[Series]) -> dict[Any, int]:
    column = figure.table.column(figure.y[0].column)
    names = list(dict.fromkeys(str(column[i]) for series in own for i in series.rows))
    axes.set_yticks(range(len(names)), [plain(name if len(name) < 32 else f"{name[:31]}…") for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    return {name: k for k, name in enumerate(names)}


def _bars(axes: Any, figure: Figure, own: Sequence[Series]) -> None:
    at = _categories(axes, figure, own)
    height = 0.8 / max(1, len(own))
    for k, series in enumerate(own):
        points = _values(figure, series)
        places = [at[y] + (k - (len(own) - 1) / 2) * height for _, _, y in points]
        bars = axes.barh(places, [x for _, x, _ in points], height, color=series.style.colour, label=plain(series.name))
        axes.bar_label(bars, fmt="%.4g", padding=2, fontsize=6)


def _ranges(axes: Any, figure: Figure, own: Sequence[Series]) -> None:
    at = _categories(axes, figure, own)
    ends = [figure.table.column(name) for name in figure.interval or ()]
    for series in own:
        for row, x, y in _values(figure, series):
            known = [column[row] for column in ends]
            if None not in known:
                axes.plot(known, [at[y]] * 2, color=series.style.light)
            axes.plot([x], [at[y]], label=plain(series.name), **_look(series.style, line=False))


def _cells(axes: Any, figure: Figure, own: Sequence[Series], panel: Panel) -> None:
    """Squares coloured by a value, with the scale of all slices and values of their run; blind ones hatched."""
    assert panel.value is not None
    table, runs = figure.table, {series.name for series in own}
    rows = [i for series in figure.series if series.name in runs for i in series.rows]
    every = [w for v in figure.values for i in rows if (w := table.column(v.column)[i]) is not None]
    points = [point for series in own for point in _values(figure, series)]
    c = table.column(panel.value.column)
    known = [(x, y, c[i]) for i, x, y in points if c[i] is not None]
    if known:
        x, y, colour = zip(*known, strict=True)
        size = (1.1e2 / math.sqrt(len(known))) ** 2
        look = {"vmin": min(every), "vmax": max(every), "cmap": "cividis", "marker": "s"}
        axes.figure.colorbar(axes.scatter(x, y, s=size, c=colour, **look), ax=axes, shrink=0.8)
    blind = [(x, y) for i, x, y in points if figure.hatched and table.column(figure.hatched)[i]]
    if blind:
        axes.scatter(*zip(*blind, strict=True), s=30, color="white", marker="x", linewidths=0.8)
    axes.set_aspect("equal", "datalim")
    axes.grid(visible=False)
    axes.set_ylabel(figure.y[0].titled)


def _legend(canvas: Any, figure: Figure, shown: Sequence[Panel]) -> None:
    """Each name once, below."""
    entries: dict[str, Any] = {}
    for axes in canvas.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if len(entries) > 1:
        columns = min(4, len(entries))
        canvas.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=columns)
