"""Parameters where they live: along a line as points, over a body as slices of coloured cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Series, Table
from gradient_routes.bench.render.picking import grouped, real, text
from gradient_routes.bench.render.source import schema
from gradient_routes.bench.render.style import INK

SLICES = 6  # of a body that are drawn
LAYERS = 12  # heights of centroids; beyond, they are no layers and are put into slabs
SLABS = 4
SPARSE = 4  # places of a grid for each point: beyond, the points lie on none
OWN = {
    "number": real("number", "1", "of the parameter"),
    "run": text("run", "route and optimizer"),
    "blind": Column("blind", "INTEGER", "1", "1 where no datum depends on it"),
    "slice": text("slice", "where the body is cut"),
}


def along(
    figure: Figure, rows: Sequence[Row], lines: Callable[[Row], dict[str, Series]], facets: dict[str, str]
) -> Figure | None:
    """The rows of groups on a line; `lines` gives series by the column they draw, `facets` says by group name."""
    panels = {name: places for name, places in by_panel(rows).items() if not spread(rows[i] for i in places)}
    if not panels:
        return None
    drawn = [rows[i] | {"number": k} for places in panels.values() for k, i in enumerate(places)]
    placed = all(row["x"] is not None for row in drawn)
    x = Axis("x", "x", "m") if placed else Axis("number", "parameter")
    series, first = [], 0
    for facet, places in enumerate(panels.values()):
        of = tuple(range(first, first + len(places)))
        series += [
            replace(line, rows=of, facet=facet, y=column)
            for column, line in lines(drawn[first]).items()
            if any(drawn[i][column] is not None for i in of)
        ]
        first += len(places)
    return replace(
        figure,
        table=_table(figure, drawn),
        x=(x,),
        series=tuple(series),
        facets=tuple(Facet(name, says=facets.get(name, "")) for name in panels),
    )


def over(figure: Figure, rows: Sequence[Row], facets: dict[str, str]) -> Figure | None:
    """The rows of groups in a body, a panel a slice and value."""
    panels = {name: places for name, places in by_panel(rows).items() if spread(rows[i] for i in places)}
    if not panels:
        return None
    drawn: list[Row] = []
    series: list[Series] = []
    made: list[Facet] = []
    across: tuple[str, str] = ("x", "y")
    for name, places in panels.items():
        of = [rows[i] for i in places]
        across, cut = _plane(of)
        for label, slice_ in _slices(of, cut, across).items():
            first = len(drawn)
            drawn += [row | {"slice": label} for row in slice_]
            series.append(Series(name, INK, tuple(range(first, len(drawn))), len(made)))
            said = "" if any(s.name == name for s in series[:-1]) else facets.get(name, "")
            made.append(Facet(", ".join(filter(None, (name, label))), says=said, cell=_sides(slice_, across)))
    return replace(
        figure,
        id=f"{figure.id}-cells",
        title=f"{figure.title}, in slices",
        table=_table(figure, drawn),
        x=(Axis(across[0], across[0], "m"),),
        y=(Axis(across[1], across[1], "m"),),
        series=tuple(series),
        facets=tuple(made),
        mark="cells",
    )


def by_panel(rows: Sequence[Row]) -> dict[str, tuple[int, ...]]:
    return grouped(rows, lambda row: str(row["panel"]))


def spread(rows: Iterable[Row]) -> bool:
    """Whether they differ in more than one coordinate."""
    of = list(rows)
    return sum(len(heights(of, axis)) > 1 for axis in "xyz") > 1


def heights(rows: Sequence[Row], axis: str) -> list[float]:
    return sorted({float(f"{row[axis]:.9g}") for row in rows if row[axis] is not None})


def _plane(rows: Sequence[Row]) -> tuple[tuple[str, str], str]:
    """The two axes to draw over, and the one to cut along, "" where there is none."""
    varying = [axis for axis in "xyz" if len(heights(rows, axis)) > 1]
    if len(varying) == 3:
        return ("x", "y"), "z"
    return (varying[0], varying[1]), ""


def _slices(rows: Sequence[Row], cut: str, across: tuple[str, str]) -> dict[str, list[Row]]:
    """Layers of a grid, or slabs of centroids; parameters at the same place apart."""
    levels = heights(rows, cut) if cut else []
    if len(levels) > LAYERS:
        low, high = levels[0], levels[-1]
        width = (high - low) / SLABS
        labelled = [(f"{cut} about {low + width * (_slab(row[cut], low, width) + 0.5):.3g}", row) for row in rows]
    else:
        labelled = [(f"{cut} = {row[cut]:.3g}" if cut else "", row) for row in rows]
        levels = levels[:: -(-len(levels) // SLICES)] if levels else levels
        shown = {f"{cut} = {level:.3g}" for level in levels} or {""}
        labelled = [(label, row) for label, row in labelled if label in shown]
    found: dict[str, list[Row]] = {}
    for label, row in labelled:
        there = sum(all(o[axis] == row[axis] for axis in (*across, cut or "x")) for o in found.get(label, ()))
        name = label if there == 0 else ", ".join(filter(None, (label, f"component {there + 1}")))
        found.setdefault(name, []).append(row)
    return dict(sorted(found.items(), key=lambda item: [row[cut] for row in item[1][:1]] if cut else [0.0]))


def _slab(height: float, low: float, width: float) -> int:
    return min(SLABS - 1, int((height - low) / width))


def _sides(rows: Sequence[Row], across: tuple[str, str]) -> tuple[float, float]:
    """Of a cell of the grid that they lie on; of as many equal squares, where they do not."""
    x, y = (heights(rows, axis) for axis in across)
    if len(x) * len(y) > SPARSE * len(rows):
        side = math.sqrt((x[-1] - x[0]) * (y[-1] - y[0]) / len(rows))
        return side, side
    gaps = [min((b - a for a, b in pairwise(levels)), default=0.0) for levels in (x, y)]
    return gaps[0] or gaps[1] or 1.0, gaps[1] or gaps[0] or 1.0


def _table(figure: Figure, rows: Sequence[Row]) -> Table:
    return Table.of(figure.table.columns, rows)


def columns(table: str, names: str) -> Table:
    """An empty table with these columns, for a figure whose rows come later."""
    known = schema(table) | OWN
    return Table.of([known[name] for name in names.split()], [])
