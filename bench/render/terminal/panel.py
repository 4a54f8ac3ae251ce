"""A plot on linear axes in plain characters, for quantities that change sign or jump."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

NARROWEST = 40
WALL = ":"


def panel(
    points: Sequence[tuple[float, float, str]],
    title: str,
    x_label: str,
    width: int,
    height: int = 9,
    wall: float | None = None,
) -> Text:
    """Plot points (x, y, mark) in `width` columns and `height` rows.

    A vertical line marks x = `wall`, a horizontal one y = 0. Labels are the ends of both axes and the wall.
    """
    xs, ys = [x for x, _, _ in points], [y for _, y, _ in points]
    low, high = min(ys), max(ys)
    labels = {0: f"{low:.3g}", height - 1: f"{high:.3g}"} if high > low else {0: f"{low:.3g}"}
    if low < 0.0 < high:
        labels.setdefault(_cell(0.0, low, high, height), "0")
    margin = max(map(len, labels.values()))
    cells = max(width, NARROWEST) - margin - 2
    rows = [[" "] * cells for _ in range(height)]
    if low < 0.0 < high:
        rows[_cell(0.0, low, high, height)] = ["-"] * cells
    walls = [] if wall is None else [_cell(wall, min(xs), max(xs), cells)]
    for row in rows:
        for column in walls:
            row[column] = WALL
    for x, y, mark in points:
        rows[_cell(y, low, high, height)][_cell(x, min(xs), max(xs), cells)] = mark
    text = Text(f"{title}\n")
    for r in reversed(range(height)):
        tick = labels.get(r, "")
        text.append(f"{tick:>{margin}} {'+' if tick else '|'}{''.join(rows[r]).rstrip()}\n")
    text.append(f"{'':>{margin}} +{'-' * cells}\n")
    text.append(_x_axis(x_label, min(xs), max(xs), wall, margin + 2, cells))
    return text


def _cell(value: float, low: float, high: float, cells: int) -> int:
    return round((value - low) / (high - low) * (cells - 1)) if high > low else 0


def _x_axis(name: str, low: float, high: float, wall: float | None, margin: int, cells: int) -> str:
    """Labels of the ends and, where there is room, of the wall."""
    line = " " * margin + f"{low:.3g}"
    end = f"{name} = {high:.3g}"
    if wall is not None:
        label = f"{wall:.4g}"
        start = margin + _cell(wall, low, high, cells) - len(label) // 2
        if len(line) + 1 < start < margin + cells - len(end) - len(label) - 1:
            line = line.ljust(start) + label
    return line.ljust(margin + cells - len(end)) + end
