"""What a report is made of: the newest row of every case, the newest study of everything that was asked."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.case import selector_of
from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.declared import kinds_of, undeclared
from gradient_routes.bench.cases.registry import Kind
from gradient_routes.bench.cases.row import COLUMNS
from gradient_routes.bench.render.terminal.tables import asked
from gradient_routes.bench.sanitize import plain
from gradient_routes.bench.store.cases import EVERY, IDS, cases, numbered
from gradient_routes.bench.store.filter import EVERYTHING, Filter
from gradient_routes.bench.store.schema import tables as schema_tables
from gradient_routes.bench.store.store import Store

MOST = 2000  # cases that figures and tables show
ASKING = ("problem_options", "settings", "at", "partial")
LIGHT = (
    *IDS,
    "case_key",
    "problem",
    *ASKING,
    "problem_declared",
    "route",
    "route_options",
    "route_declared",
    "status",
)


@dataclass(frozen=True)
class Counts:
    """How many cases, problems and routes there are, and cases by status and by environment."""

    cases: int = 0
    problems: int = 0
    routes: int = 0
    status: Counter[str] = field(default_factory=Counter)
    environments: Counter[str] = field(default_factory=Counter)

    @classmethod
    def of(cls, rows: Sequence[Row]) -> Counts:
        """Of rows whose objects are text."""
        return cls(
            len(rows),
            len({tuple(row[name] for name in ("problem", *ASKING)) for row in rows}),
            len({row["route"] for row in rows}),
            Counter(row["status"] for row in rows),
            Counter(row["environment_id"] for row in rows),
        )


@dataclass(frozen=True)
class Source:
    """Rows by table, as objects; `kept` counts all cases of the store, the newest of which are `cases`; `note` says
    what is not known of them.
    """

    cases: list[Row] = field(default_factory=list)
    kept: int = 0
    environments: list[Row] = field(default_factory=list)
    studies: list[Row] = field(default_factory=list)
    tables: dict[str, list[Row]] = field(default_factory=dict)
    name: str = ""
    note: str = ""
    counts: Counts = field(default_factory=lambda: Counts())

    @property
    def thinned(self) -> str:
        """What is left out of figures and tables, in a sentence."""
        if self.counts.cases <= len(self.cases):
            return ""
        return (
            f"{len(self.cases)} of {self.counts.cases} cases are shown, those of evenly spaced problems;"
            " `routes export` writes all."
        )

    def table(self, name: str) -> list[Row]:
        """The rows of a study's table; none where this store has no such table."""
        return self.tables.get(name, [])

    @property
    def answered(self) -> list[Row]:
        return [row for row in self.cases if row["status"] == "ok"]


def read(store: Store, where: Filter = EVERYTHING) -> Source:
    """Everything a report shows. Raises InputError where there is no store."""
    names = LIGHT if where.empty else (*EVERY, *IDS)
    newest_cases = {row["case_key"] or _unkeyed(row): row for row in cases(store, names, parse=False)}
    every = [row for row in newest_cases.values() if where.keeps(row)]
    shown = latest([*numbered(store, thinned(every))])
    declared = registry.study_tables()
    found = {name: newest(store.records(name), table.question) for name, table in declared.items()}
    named = {name: [_named(row, declared[name].columns) for row in rows] for name, rows in found.items()}
    return Source(
        cases=[_plain(row) for row in shown],
        kept=store.count(),
        environments=[_plain(row) for row in store.records("environments")],
        studies=[_plain(row) for row in store.records("studies")],
        tables={name: [_plain(row) for row in rows if where.keeps(row)] for name, rows in named.items()},
        name=plain(store.path.name),
        note=undeclared(every),
        counts=Counts.of(every),
    )


def _plain(row: Row) -> Row:
    """The row, no text of which has control characters: XML, SVG's language, knows none."""
    return {name: plain(value) if isinstance(value, str) else value for name, value in row.items()}


def thinned(rows: Sequence[Row], most: int = MOST) -> list[int]:
    """case_ids of at most `most` rows: all of them, or those of evenly spaced problems, each with all its routes."""
    if len(rows) <= most:
        return [row["case_id"] for row in rows]
    groups: dict[tuple[Any, ...], list[int]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in ("problem", *ASKING)), []).append(row["case_id"])
    step, ids = 0, list[int]()
    while step < len(groups) and not 0 < len(ids) <= most:
        step = max(step + 1, len(rows) // most)
        ids = [case_id for group in [*groups.values()][::step] for case_id in group]
    return ids[:: -(-len(ids) // most)]


def latest(cases: Sequence[Row]) -> list[Row]:
    """The newest row of every case, in the order in which cases were first asked for.

    `problem` and `route` become selectors, `family` and `by` keep the bare names.
    """

    def key(row: Row) -> str:
        return row["case_key"] or _unkeyed(row)

    newest = {key(row): row for row in cases}
    known: dict[str, str] = {}

    def problem(row: Row) -> str:
        key = json.dumps([row[name] for name in ("problem", *ASKING)])
        if key not in known:
            known[key] = asked(row)
        return known[key]

    return [
        row
        | {"family": row["problem"], "problem": problem(row)}
        | {"by": row["route"], "route": selector("route", row)}
        for row in newest.values()
    ]


def _unkeyed(row: Row) -> str:
    """Of a store older than keys."""
    return json.dumps([row[name] for name in ("problem", *ASKING, "route", "route_options")], sort_keys=True)


def newest(rows: Sequence[Row], columns: Sequence[str]) -> list[Row]:
    """The rows of the newest study of each thing asked."""
    keys = [json.dumps([row.get(column) for column in columns], sort_keys=True) for row in rows]
    last: dict[str, int] = {}
    for key, row in zip(keys, rows, strict=True):
        last[key] = max(last.get(key, 0), row["study_id"])
    return [row for key, row in zip(keys, rows, strict=True) if row["study_id"] == last[key]]


def _named(row: Row, columns: Sequence[Column]) -> Row:
    """Problem and route by their selectors, where the table has names and options apart."""
    named = kinds_of({column.name: column for column in columns})
    given = {"problem": row.get("problem"), "route": row.get("route")}
    return row | given | {column: selector(kind, row, column) for column, kind in named}


def selector(kind: Kind, row: Row, column: str = "") -> str:
    """What names the problem or route of a row, its defaults left out."""
    column = column or kind
    name, options, kept = row[column], row[f"{column}_options"], row.get(f"{column}_declared")
    return "" if name is None else _selector(kind, name, json.dumps(options or {}), json.dumps(kept))


@cache
def _selector(kind: Kind, name: str, options: str, kept: str) -> str:
    return selector_of(kind, name, json.loads(options), json.loads(kept))


def schema(table: str) -> dict[str, Column]:
    """Columns of a table by name."""
    columns = COLUMNS if table == "cases" else ()
    return {column.name: column for column in (*columns, *schema_tables().get(table, ()))}
