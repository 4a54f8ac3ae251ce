"""What a figure is: a table of numbers, and which of its columns are drawn how. Nothing here draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.style import Style

Scale = Literal["linear", "log", "category"]


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

    @property
    def known(self) -> list[int]:
        """Places of the columns that have any value."""
        return [k for k, name in enumerate(self.names) if any(value is not None for value in self.column(name))]

    def column(self, name: str) -> list[Any]:
        """Its values, row by row."""
        place = self.names.index(name)
        return [row[place] for row in self.rows]


@dataclass(frozen=True)
class Axis:
    """A column on an axis, and what is written beside it; without a column, the values of `Figure.fold`.

    `ends`: columns with the ends of an interval about each value, absent where it is unbounded. `domain`: what is
    shown at least.
    """

    column: str
    label: str
    unit: str = ""
    scale: Scale = "linear"
    ends: tuple[str, str] | None = None
    domain: tuple[float, float] | None = None


@dataclass(frozen=True)
class Guide:
    """A labelled line across a panel, or all, at a number of one axis.

    `column`: where that is what the axis shows. `below`: what is less is shaded, for it means nothing.
    """

    axis: Literal["x", "y"]
    value: float
    label: str
    panel: str = ""
    column: str = ""
    below: bool = False


@dataclass(frozen=True)
class Told:
    """What is said of a panel: a verdict, a sentence."""

    verdict: str = ""
    says: str = ""


@dataclass(frozen=True)
class Figure:
    """A table, and how its rows are drawn; the first of several axes is the one shown first. No mark: no plot.

    series, panels, lines  of every row: its name in the legend, its panel, what a line joins (else: its series)
    fold     columns drawn as series of their own, by the names of those
    routes   series are named by routes, or begin with a route's name: they have its colour
    looks    the styles of other series, where they are not to be of the palette
    told     what is said of panels
    hollow   column that is true where a point is not to be relied on, or a cell says nothing
    note     column of words written beside a point
    order    column along which lines run, in place of x
    front    the points of a problem that no other beats on both axes are joined
    diagonal the line y = x
    z, sides what the colour of a cell shows, columns with its width and height
    """

    id: str
    title: str
    says: str
    table: Table
    mark: Literal["points", "line", "bars", "cells"] | None = None
    x: tuple[Axis, ...] = ()
    y: tuple[Axis, ...] = ()
    series: tuple[str, ...] = ()
    panels: tuple[str, ...] = ()
    lines: tuple[int, ...] = ()
    fold: Mapping[str, str] = field(default_factory=dict)
    routes: bool = False
    looks: Mapping[str, Style] = field(default_factory=dict)
    told: Mapping[str, Told] = field(default_factory=dict)
    guides: tuple[Guide, ...] = ()
    hollow: str = ""
    note: str = ""
    order: str = ""
    front: bool = False
    diagonal: bool = False
    z: Axis = Axis("", "")
    sides: tuple[str, str] = ("", "")

    @cached_property
    def names(self) -> list[str]:
        """Of all series that have a value; routes in the order of the story, others in that of rows."""
        ends = list(dict.fromkeys(self.series or [""]))
        if self.routes:
            ends.sort(key=lambda name: registry.place(bare(name)))
        if not self.fold:
            return ends
        rows = self.series or ("",) * len(self.table.rows)
        values = {name: self.table.column(column) for column, name in self.fold.items()}
        known = {name + end for name, of in values.items() for end, v in zip(rows, of, strict=True) if v is not None}
        return [name + end for end in ends for name in values if name + end in known]


@dataclass(frozen=True)
class Note:
    """A line about one case that opens to show what it said: (heading, text) of its last words and its traceback."""

    title: str
    says: str
    problem: str = ""
    route: str = ""
    words: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Section:
    """Figures under one heading. `facts`: a number or a word, and what it counts."""

    id: str
    title: str
    says: str
    figures: tuple[Figure, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[Note, ...] = ()
