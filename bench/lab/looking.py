"""What is seen of a store: some rows of a table, a section of its report, as HTML."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render import html
from gradient_routes.bench.render.cell import heading, shown
from gradient_routes.bench.render.figure import Section
from gradient_routes.bench.render.sections import sections
from gradient_routes.bench.render.source import read
from gradient_routes.bench.render.style import of_route
from gradient_routes.bench.sanitize import plain
from gradient_routes.bench.store.filter import COLUMNS, Filter
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import Store

MOST = 100  # rows that are sent
PATIENCE = 5.0  # [s] to wait for a writer of the store
LONGEST = 60  # characters of a cell
INSIDE = "header.title { display: none } section { padding-top: .8rem } figure { margin-top: .8rem }"
Record = tuple[Any, ...]
Choices = dict[str, dict[str, int]]


@dataclass(frozen=True)
class Rows:
    """Of a table: those from number `first` on, counted from 0, of `kept` that a filter leaves of `every` one.

    choices   by column that can be filtered by: its values, and how many rows have them
    """

    text: str
    first: int
    kept: int
    every: int
    choices: Choices


@dataclass(frozen=True)
class Drawn:
    """A section as a page that needs nothing else; ids and titles of all sections; choices as those of rows."""

    page: str
    section: str
    sections: dict[str, str]
    choices: Choices


def rows(store: Store, table: str, where: Filter, first: int) -> Rows:
    """Raises InputError where the store cannot be read."""
    declared = {column.name: column for column in tables()[table]}
    counted: dict[str, Counter[str]] = {name: Counter() for name in COLUMNS if name in declared}
    seen: list[Record] = []
    every = kept = 0
    with store.streamed(table) as (names, records):
        for record in records:
            row = dict(zip(names, record, strict=True))
            every += 1
            _count(counted, row)
            if where.keeps(row):
                kept += 1
                if first < kept <= first + MOST:
                    seen.append(record)
    columns = [declared.get(name, Column(name, "TEXT", "", "")) for name in names]
    return Rows(_table(table, columns, seen), first, kept, every, _plain(counted))


def _count(counted: dict[str, Counter[str]], row: Row) -> None:
    for name, of in counted.items():
        if isinstance(value := row.get(name), str):
            of[bare(value) if name in ("problem", "route") else value] += 1


def _plain(counted: dict[str, Counter[str]]) -> Choices:
    return {name: dict(sorted(of.items())) for name, of in counted.items()}


def _table(name: str, columns: Sequence[Column], records: Sequence[Record]) -> str:
    """Columns that have any value."""
    if not records:
        return ""
    there = [k for k in range(len(columns)) if any(record[k] is not None for record in records)]
    kinds = [' class="t"' if columns[k].type == "TEXT" else "" for k in there]
    head = "".join(
        f'<th scope="col"{kind} title="{escape(columns[k].meaning)}">{escape(heading(columns[k]))}</th>'
        for k, kind in zip(there, kinds, strict=True)
    )
    body = "".join(
        f"<tr>{''.join(f'<td{kind}>{_cell(columns[k], record[k])}</td>' for k, kind in zip(there, kinds, strict=True))}"
        for record in records
    )
    return (
        f'<div class="scroll rows" tabindex="0" role="region" aria-label="rows of {name}">'
        f'<table class="rows"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def _cell(column: Column, value: Any) -> str:
    text = plain(shown(column, value))
    short = text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
    if column.name == "route" and text:
        colour = of_route(bare(text)).light
        return f'<i style="color: {colour}" aria-hidden="true">●</i> {escape(short)}'
    return escape(short)


def drawn(store: Store, where: Filter, section: str) -> Drawn:
    """The section of this id; of another, the first one with a figure. Raises InputError as `rows` does."""
    store.count()
    kept = store.file.stat()
    stamp = kept.st_mtime_ns, kept.st_size
    found = {s.id: s for s in _sections(store.file, stamp, where)}
    chosen = found.get(section) or next((s for s in found.values() if any(f.mark for f in s.figures)), None)
    chosen = chosen or next(iter(found.values()))
    page = html.page(plain(store.path.name), "", [chosen])
    page = page.replace("</style>", f"{INSIDE}</style>", 1)
    return Drawn(page, chosen.id, {s.id: s.title for s in found.values()}, _choices(store.file, stamp))


@lru_cache(maxsize=1)
def _sections(file: Path, stamp: tuple[int, int], where: Filter) -> list[Section]:
    """Of a store as it was; by the stamp one knows whether it has changed."""
    return sections(read(Store(file, PATIENCE), where))


@lru_cache(maxsize=1)
def _choices(file: Path, stamp: tuple[int, int]) -> Choices:
    """Of all tables."""
    counted: dict[str, Counter[str]] = {name: Counter() for name in COLUMNS}
    for table, columns in tables().items():
        if {column.name for column in columns} & {*COLUMNS}:
            with Store(file, PATIENCE).streamed(table) as (names, records):
                for record in records:
                    _count(counted, dict(zip(names, record, strict=True)))
    return _plain(counted)
