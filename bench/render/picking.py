"""From rows of the store to tables and names of a figure."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import TypeVar

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.figure import Table
from gradient_routes.bench.render.source import schema

Key = TypeVar("Key", bound=Hashable)


def tabulate(table: str, rows: Sequence[Row], names: str, own: Iterable[Column] = ()) -> Table:
    """Columns of a table of the store, in the order of `names`, and those of the figure's own."""
    known = schema(table) | {column.name: column for column in own}
    return Table.of([known[name] for name in names.split()], rows)


def each(rows: Iterable[Row], column: str) -> tuple[str, ...]:
    """The text of a column, row by row; "" where there is none."""
    return tuple("" if row[column] is None else str(row[column]) for row in rows)


def grouped(rows: Iterable[Row], key: Callable[[Row], Key]) -> dict[Key, list[Row]]:
    """Rows by their key, in the order in which keys appear."""
    found: dict[Key, list[Row]] = {}
    for row in rows:
        found.setdefault(key(row), []).append(row)
    return found


def in_order(selectors: Iterable[str]) -> list[str]:
    """Each once, routes and problems in the order of the story."""
    return sorted(dict.fromkeys(selectors), key=lambda text: registry.place(bare(text)))


def doubt(row: Row) -> str | None:
    """Why the time of a case is not to be relied on."""
    if row["forward_ratio"] is None and row["seconds"] is not None:
        return "unresolved: less than the forward solves that it contains"
    return "noisy: quartiles more than 10 % of the median apart" if row["unstable"] else None


def text(name: str, meaning: str = "") -> Column:
    return Column(name, "TEXT", "", meaning)


def real(name: str, unit: str, meaning: str) -> Column:
    return Column(name, "REAL", unit, meaning)
