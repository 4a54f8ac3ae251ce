"""From rows of the store to tables and series of a figure."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any, TypeVar

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.render.figure import Table
from gradient_routes.bench.render.source import schema

Key = TypeVar("Key", bound=Hashable)


def tabulate(table: str, rows: Sequence[Row], names: str, own: Iterable[Column] = ()) -> Table:
    """Columns of a table of the store, in the order of `names`, and those of the figure's own."""
    known = schema(table) | {column.name: column for column in own}
    return Table.of([known[name] for name in names.split()], rows)


def grouped(rows: Sequence[Row], key: Callable[[Row], Key]) -> dict[Key, tuple[int, ...]]:
    """Places of rows by their key, in the order in which keys appear."""
    found: dict[Key, list[int]] = {}
    for place, row in enumerate(rows):
        found.setdefault(key(row), []).append(place)
    return {name: tuple(places) for name, places in found.items()}


def by_column(rows: Sequence[Row], column: str) -> dict[Any, tuple[int, ...]]:
    return grouped(rows, lambda row: row[column])


def sorted_by(rows: Sequence[Row], places: Iterable[int], column: str) -> tuple[int, ...]:
    """Places in the order of a number, so that a line runs one way; what has none is left out."""
    return tuple(sorted((i for i in places if rows[i][column] is not None), key=lambda i: rows[i][column]))


def bare(selector: str | None) -> str:
    """`bar` of `bar[n=8], at true`."""
    return (selector or "").partition("[")[0].partition(",")[0]


def in_order(selectors: Iterable[str]) -> list[str]:
    """Each once, routes and problems in the order of the story."""
    return sorted(dict.fromkeys(selectors), key=lambda text: registry.place(bare(text)))


def least(rows: Iterable[Row], column: str) -> Row | None:
    """The row with the least of a number."""
    return min((row for row in rows if row[column] is not None), key=lambda row: row[column], default=None)


def text(name: str, meaning: str = "") -> Column:
    return Column(name, "TEXT", "", meaning)


def real(name: str, unit: str, meaning: str) -> Column:
    return Column(name, "REAL", unit, meaning)
