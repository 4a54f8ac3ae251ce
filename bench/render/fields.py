"""Parameters where they live: along a line as points, over a body as slices of coloured cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.render.figure import Axis, Figure, Table, Told
from gradient_routes.bench.render.picking import each, grouped, real, text
from gradient_routes.bench.render.source import schema

SLICES = 6  # of a body that are drawn
LAYERS = 12  # heights of centroids; beyond, they are no layers and are put into slabs
SLABS = 4
SPARSE = 4  # places of a grid for each point: beyond, the points lie on none
OWN = {
    "number": real("number", "1", "of the parameter"),
    "run": text("run", "route and optimizer"),
    "blind": Column("blind", "INTEGER", "1", "1 where no datum depends on it"),
    "slice": text("slice", "where the body is cut"),
    "width": real("width", "m", "of its cell in the slice"),
    "height": real("height", "m", "of its cell in the slice"),
}


def columns(table: str, names: str) -> Table:
    """An empty table with these columns, for a figure whose rows come later."""
    known = schema(table) | OWN
    return Table.of([known[name] for name in names.split()], [])


def figures(
    figure: Figure, rows: Sequence[Row], values: Mapping[str, str], says: Callable[[Sequence[Row]], str]
) -> list[Figure]:
    """Rows by their "panel": one figure of all that lie on a line, and one of `values` for each body."""
    panels = grouped(rows, lambda row: str(row["panel"]))
    told = {name: Told(says=says(of)) for name, of in panels.items()}
    bodies = {name: of for name, of in panels.items() if sum(len(levels(of, axis)) > 1 for axis in "xyz") > 1}
    flat = [row | {"number": k} for name, of in panels.items() if name not in bodies for k, row in enumerate(of)]
    made = []
    if flat:
        placed = all(row["x"] is not None for row in flat)
        x = Axis("x", "x", "m") if placed else Axis("number", "number of the parameter")
        table = Table.of(figure.table.columns, flat)
        made.append(replace(figure, table=table, mark="line", x=(x,), panels=each(flat, "panel"), told=told))
    for k, (name, of) in enumerate(bodies.items()):
        across, cut = _plane(of)
        drawn = [row | {"slice": label} for label, row in _cells(of, cut, across)]
        known = {column: named for column, named in values.items() if any(row[column] is not None for row in of)}
        cells = replace(
            figure,
            id=f"{figure.id}-cells" + (f"-{k + 1}" if k else ""),
            title=f"{figure.title}: {name}",
            says=f"{told[name].says} {figure.says.replace('Hollow', 'Crossed')}",
            table=Table.of(figure.table.columns, drawn),
            mark="cells",
            x=(Axis(across[0], across[0], "m"),),
            y=(Axis(across[1], across[1], "m"),),
            panels=tuple(row["slice"] or "all" for row in drawn),
            fold=known,
            looks={},
            sides=("width", "height"),
        )
        made += [cells] if known else []
    return made


def levels(rows: Sequence[Row], axis: str) -> list[float]:
    return sorted({float(f"{row[axis]:.9g}") for row in rows if row[axis] is not None})


def _plane(rows: Sequence[Row]) -> tuple[tuple[str, str], str]:
    """The two axes to draw over, and the one to cut along, "" where there is none."""
    varying = [axis for axis in "xyz" if len(levels(rows, axis)) > 1]
    return (("x", "y"), "z") if len(varying) == 3 else ((varying[0], varying[1]), "")


def _cells(rows: Sequence[Row], cut: str, across: tuple[str, str]) -> Iterator[tuple[str, Row]]:
    """The rows of every slice with its name and the sides of their cells."""
    for label, of in _slices(rows, cut, across).items():
        width, height = _sides(of, across)
        yield from ((label, row | {"width": width, "height": height}) for row in of)


def _slices(rows: Sequence[Row], cut: str, across: tuple[str, str]) -> dict[str, list[Row]]:
    """Layers of a grid, or slabs of centroids; parameters at the same place apart."""
    heights = levels(rows, cut) if cut else []
    rows = sorted(rows, key=lambda row: row[cut]) if cut else rows
    if len(heights) > LAYERS:
        low, width = heights[0], (heights[-1] - heights[0]) / SLABS
        middles = [low + width * (min(SLABS - 1, int((row[cut] - low) / width)) + 0.5) for row in rows]
        labelled = [(f"{cut} about {middle:.3g} m", row) for middle, row in zip(middles, rows, strict=True)]
    else:
        shown = {f"{cut} = {level:.3g} m" for level in heights[:: -(-len(heights) // SLICES) or 1]} or {""}
        labelled = [(f"{cut} = {row[cut]:.3g} m" if cut else "", row) for row in rows]
        labelled = [(label, row) for label, row in labelled if label in shown]
    found: dict[str, list[Row]] = {}
    there: dict[tuple[str, ...], int] = {}
    for label, row in labelled:
        place = (label, *(str(row[axis]) for axis in (*across, cut or "x")))
        there[place] = there.get(place, 0) + 1
        component = f"component {there[place]}" if there[place] > 1 else ""
        found.setdefault(", ".join(filter(None, (label, component))), []).append(row)
    return found


def _sides(rows: Sequence[Row], across: tuple[str, str]) -> tuple[float, float]:
    """Of a cell of the grid that they lie on; of as many equal squares, where they do not."""
    x, y = (levels(rows, axis) for axis in across)
    if len(x) * len(y) > SPARSE * len(rows):
        side = math.sqrt((x[-1] - x[0]) * (y[-1] - y[0]) / len(rows))
        return side, side
    gaps = [min((b - a for a, b in pairwise(found)), default=0.0) for found in (x, y)]
    return gaps[0] or gaps[1] or 1.0, gaps[1] or gaps[0] or 1.0
