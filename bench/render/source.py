"""What a report is made of: the newest row of every case, the newest study of everything that was asked."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.case import selector_of
from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.declared import kinds_of, undeclared
from gradient_routes.bench.cases.registry import Kind
from gradient_routes.bench.cases.row import COLUMNS, from_record
from gradient_routes.bench.render.terminal.tables import asked
from gradient_routes.bench.store.schema import tables as schema_tables
from gradient_routes.bench.store.store import Store


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

    def table(self, name: str) -> list[Row]:
        """The rows of a study's table; none where this store has no such table."""
        return self.tables.get(name, [])

    @property
    def answered(self) -> list[Row]:
        return [row for row in self.cases if row["status"] == "ok"]


def read(store: Store) -> Source:
    """Everything a report shows. Raises InputError where there is no store."""
    cases = cases_of(store)
    declared = registry.study_tables()
    found = {name: newest(store.records(name), table.question) for name, table in declared.items()}
    named = {name: [_named(row, declared[name].columns) for row in rows] for name, rows in found.items()}
    return Source(
        cases=latest(cases),
        kept=len(cases),
        environments=store.records("environments"),
        studies=store.records("studies"),
        tables=named,
        name=store.path.name,
        note=undeclared(cases),
    )


def cases_of(store: Store) -> list[Row]:
    """The cases, with the numbers of their rows and of their environments."""
    return [
        from_record(row) | {key: row[key] for key in ("case_id", "environment_id")} for row in store.records("cases")
    ]


def latest(cases: Sequence[Row]) -> list[Row]:
    """The newest row of every case, in the order in which cases were first seen.

    `problem` and `route` become selectors, `family` and `by` keep the bare names.
    """
    newest: dict[str, Row] = {}
    for row in cases:
        newest[row["case_key"] or _unkeyed(row)] = row
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


ASKING = ("problem_options", "settings", "at", "partial")


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
