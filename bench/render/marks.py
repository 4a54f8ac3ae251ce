"""Marks of a figure on the axes of Matplotlib: points and lines, bars, ranges, cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gradient_routes.bench.render.figure import Axis, Facet, Figure, Series
from gradient_routes.bench.render.style import Marker, Style

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
SOFT = "#596069"


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


def plain(words: str) -> str:
    """Nothing in it is mathematics to Matplotlib."""
    return words.replace("$", r"\$")


def draw(axes: Any, figure: Figure, panel: Panel) -> None:
    """All that one panel holds."""
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
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.patches import Rectangle

    assert panel.value is not None
    table, runs = figure.table, {series.name for series in own}
    rows = [i for series in figure.series if series.name in runs for i in series.rows]
    every = [w for v in figure.values for i in rows if (w := table.column(v.column)[i]) is not None]
    points = [point for series in own for point in _values(figure, series)]
    c = table.column(panel.value.column)
    blind = table.column(figure.hatched) if figure.hatched else [None] * len(c)
    colours = ScalarMappable(Normalize(min(every, default=0.0), max(every, default=1.0)), "cividis")
    width, height = panel.about.cell
    for i, x, y in points:
        look: Any = {"facecolor": "white" if c[i] is None else colours.to_rgba(c[i]), "edgecolor": "white"}
        hatch = "////" if blind[i] else None
        axes.add_patch(Rectangle((x - width / 2, y - height / 2), width, height, linewidth=0.4, hatch=hatch, **look))
    axes.figure.colorbar(colours, ax=axes, shrink=0.8)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_ylabel(figure.y[0].titled)
