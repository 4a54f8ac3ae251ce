"""What a figure is: a table of numbers, and which of its columns are drawn how. Nothing here draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.render.style import Style

Scale = Literal["linear", "log", "category"]
Mark = Literal["points", "line", "bars", "ranges", "cells"]


@dataclass(frozen=True)
class Table:
    """Columns with their units and meanings, and rows (m, n_columns) of finite numbers, texts and None.

    Columns `problem` and `route` hold what the page filters by.
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]

    @classmethod
    def of(cls, columns: Sequence[Column], rows: Sequence[dict[str, Any]]) -> Table:
        names = [column.name for column in columns]
        return cls(tuple(columns), tuple(tuple(clean(row.get(name)) for name in names) for row in rows))

    @property
    def names(self) -> list[str]:
        return [column.name for column in self.columns]

    def column(self, name: str) -> list[Any]:
        """Its values, row by row."""
        place = self.names.index(name)
        return [row[place] for row in self.rows]


@dataclass(frozen=True)
class Axis:
    """A column on an axis, and what is written beside it."""

    column: str
    label: str
    unit: str = ""
    scale: Scale = "linear"

    @property
    def titled(self) -> str:
        return f"{self.label} [{self.unit}]" if self.unit else self.label


@dataclass(frozen=True)
class Series:
    """Rows of the table under one name; x and y where it has columns of its own."""

    name: str
    style: Style
    rows: tuple[int, ...]
    facet: int = 0
    x: str = ""
    y: str = ""


@dataclass(frozen=True)
class Guide:
    """A line across the plot at a number of one axis; `column`: only where that is what the axis shows."""

    axis: Literal["x", "y"]
    value: float
    label: str
    column: str = ""


@dataclass(frozen=True)
class Facet:
    """One panel of a figure: its name, a verdict, what there is to see in it. `cell`: the sides of one."""

    name: str = ""
    verdict: str = ""
    says: str = ""
    guides: tuple[Guide, ...] = ()
    cell: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True)
class Figure:
    """A table, and series of its rows over axes; the first of several axes is the one shown. No series: no plot.

    `note`: column of words written beside a point. `hatched`: column, 1 where a cell says nothing. `interval`: columns
    of the ends of ranges. `front`: the points of a problem that no other beats on both axes are joined. `diagonal`:
    the line y = x.
    """

    id: str
    title: str
    says: str
    table: Table
    x: tuple[Axis, ...] = ()
    y: tuple[Axis, ...] = ()
    series: tuple[Series, ...] = ()
    facets: tuple[Facet, ...] = (Facet(),)
    mark: Mark = "line"
    values: tuple[Axis, ...] = ()
    note: str = ""
    hatched: str = ""
    interval: tuple[str, str] | None = None
    front: bool = False
    diagonal: bool = False


@dataclass(frozen=True)
class Note:
    """A line about one case that opens to show what it said: (heading, text) of its last words and its traceback."""

    title: str
    says: str
    problem: str
    route: str
    words: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Section:
    """Figures under one heading. `facts`: a number or a word, and what it counts."""

    id: str
    title: str
    says: str
    figures: tuple[Figure, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[Note, ...] = ()
