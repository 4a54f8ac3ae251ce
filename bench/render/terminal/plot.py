"""A log-log plot in plain characters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from string import ascii_letters, digits

from rich.text import Text

from gradient_routes.bench.render.terminal.palette import MARKS

Number = float | None
NARROWEST = 40
GAP = 2  # columns between labels of the x axis, at least
SEVERAL = "*"  # where there is no room for marks side by side


@dataclass(frozen=True)
class Series:
    """Points (x, y) drawn with one character in one rich style.

    y = 0 has a line of its own at the bottom. Points with x <= 0, y < 0, None or not finite are left out and counted in
    the legend.
    """

    name: str
    x: Sequence[Number]
    y: Sequence[Number]
    mark: str
    style: str = ""

    @property
    def points(self) -> list[tuple[float, float]]:
        """The points that can be drawn."""
        pairs = zip(self.x, self.y, strict=True)
        return [(x, y) for x, y in pairs if x and y is not None and 0.0 < x < math.inf and 0.0 <= y < math.inf]

    @property
    def legend(self) -> str:
        missing = len(self.x) - len(self.points)
        return f"{self.mark} {self.name}" + (f" ({missing} not drawn)" if missing else "")


@dataclass(frozen=True)
class Axis:
    """Decades 10^low to 10^high over `cells` characters."""

    low: int
    high: int
    cells: int

    @classmethod
    def of(cls, values: Sequence[float], cells: int) -> Axis:
        low, high = (math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))) if values else (0, 1)
        return cls(low, max(high, low + 1), cells)

    def cell(self, value: float) -> int:
        return self._cell(math.log10(value))

    def _cell(self, exponent: float) -> int:
        return round((exponent - self.low) / (self.high - self.low) * (self.cells - 1))

    def ticks(self, room: int) -> dict[int, str]:
        """Labels of decades by cell, as many as have `room` cells each."""
        per_decade = (self.cells - 1) / (self.high - self.low)
        every = max(1, math.ceil(room / per_decade))
        return {self._cell(e): label(e) for e in range(self.low, self.high + 1) if e % every == 0}


def label(exponent: int) -> str:
    """10^exponent: 1 to 1000 in full, others as 1e6."""
    return str(10**exponent) if 0 <= exponent <= 3 else f"1e{exponent}"


def plot(series: Sequence[Series], x_label: str, y_label: str, width: int, height: int = 16) -> Text:
    """Plot in `height` rows and `width` columns, with ticks at decades and a legend below.

    Marks of several series at the same place are put side by side.
    """
    points = [point for s in series for point in s.points]
    if not points:
        return Text(f"nothing to plot: {y_label} against {x_label}", style="dim")
    positive = [y for _, y in points if y > 0.0]
    y_axis = Axis.of(positive, height)
    ticks = y_axis.ticks(2)
    margin = max(map(len, ticks.values()))
    x_axis = Axis.of([x for x, _ in points], max(width, NARROWEST) - margin - 2)
    rows = _drawn(series, x_axis, y_axis)

    text = Text(f"{y_label}\n")
    for r in reversed(range(height if positive else 0)):
        _append_row(text, f"{ticks.get(r, ''):>{margin}} {'+' if r in ticks else '|'}", rows[r])
    if rows[-1]:
        _append_row(text, f"{0:>{margin}} +", rows[-1])
    text.append(f"{'':>{margin}} +{_rule(x_axis)}\n")
    text.append(f"{_labels(x_axis, margin + 2)}\n{x_label:>{margin + 2 + x_axis.cells}}\n")
    text.append(_legend(series, max(width, NARROWEST)))
    return text


Cells = dict[int, tuple[str, str]]  # column -> mark and style


def _drawn(series: Sequence[Series], x_axis: Axis, y_axis: Axis) -> list[Cells]:
    """The rows from the bottom up, the line of zeros last."""
    rows: list[Cells] = [{} for _ in range(y_axis.cells + 1)]
    for s in series:
        for x, y in s.points:
            row, column = rows[y_axis.cell(y) if y > 0.0 else -1], x_axis.cell(x)
            near = [*range(column, column + len(series)), *range(column - 1, column - len(series), -1)]
            free = [c for c in near if 0 <= c < x_axis.cells and row.get(c, (s.mark, ""))[0] == s.mark]
            row[free[0] if free else column] = (s.mark, s.style) if free else (SEVERAL, "")
    return rows


def _append_row(text: Text, margin: str, cells: Cells) -> None:
    text.append(margin, style="dim")
    for column in range(max(cells, default=-1) + 1):
        text.append(*cells.get(column, (" ", "")))
    text.append("\n")


def _rule(axis: Axis) -> str:
    ticks = axis.ticks(_room(axis))
    return "".join("+" if c in ticks else "-" for c in range(axis.cells))


def _labels(axis: Axis, margin: int) -> str:
    """Each label centred below its tick."""
    line = ""
    for column, text in axis.ticks(_room(axis)).items():
        start = min(max(margin + column - len(text) // 2, 0), margin + axis.cells - len(text))
        line = line.ljust(start) + text
    return line


def _room(axis: Axis) -> int:
    return max(len(label(e)) for e in (axis.low, axis.high)) + GAP


def _legend(series: Sequence[Series], width: int) -> Text:
    """Marks and names, filling lines."""
    text, used = Text(), 0
    for s in series:
        if used and used + 3 + len(s.legend) > width:
            text.append("\n")
            used = 0
        gap = "   " if used else ""
        text.append(gap).append(s.legend, style=s.style)
        used += len(gap) + len(s.legend)
    return text


def marks(names: Sequence[str]) -> list[str]:
    """One character for each name, all different: the mark of the route, else a letter of the name, else any."""
    taken: list[str] = []
    for name in names:
        letters = [c for c in name.upper() + name if c.isalnum() and c.isascii()]
        wanted = [MARKS.get(name, ""), *letters, *ascii_letters, *digits]
        taken.append(next((c for c in wanted if c and c not in taken), SEVERAL))
    return taken
