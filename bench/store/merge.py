"""What one store holds, added to another: once, however often it is asked for."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import Any

from gradient_routes.bench.store.schema import KEY, tables
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

OWN = ("cases", "samples", "environments", "studies")  # the others are tables of studies
Records = tuple[list[str], list[tuple[Any, ...]]]


def merge(store: Store, other: Store) -> tuple[int, int]:
    """Add cases and studies with all their rows, all or nothing; those that are there already are not added again.

    Returns how many of each were added. Raises InputError.
    """
    if other.path.exists() and store.path.exists() and other.path.samefile(store.path):
        raise InputError(f"merge: {other.path} is the store itself - name another with --store")
    unknown = other.names() - tables().keys()
    if unknown:
        raise InputError(f"merge: {other.path} has a table '{min(unknown)}' - install the study that it is of")
    held = {name: other.table(name) for name in tables()}
    with store.transaction() as db:
        names, environments = held["environments"]
        db.executemany(f"INSERT OR IGNORE {_into('environments', names)}", environments)
        cases = _added(db, "cases", held["cases"])
        _belonging(db, "samples", held["samples"], cases)
        studies = _added(db, "studies", held["studies"])
        for name in tables().keys() - set(OWN):
            _belonging(db, name, held[name], studies)
    return len(cases), len(studies)


def _added(db: sqlite3.Connection, table: str, records: Records) -> dict[int, int]:
    """Of rows that are not there: their number in the other store and the new one."""
    names, values = records
    assert names[0] == tables()[table][0].name  # the number
    there = " AND ".join(f'"{name}" IS ?' for name in names[1:])
    numbers = {}
    for number, *record in values:
        if not db.execute(f'SELECT 1 FROM "{table}" WHERE {there}', record).fetchone():
            numbers[number] = int(db.execute(f"INSERT {_into(table, names[1:])}", record).lastrowid or 0)
    return numbers


def _belonging(db: sqlite3.Connection, table: str, records: Records, numbers: dict[int, int]) -> None:
    names, values = records
    assert names[0] in ("case_id", KEY.name)
    of = [(numbers[number], *record) for number, *record in values if number in numbers]
    db.executemany(f"INSERT {_into(table, names)}", of)


def _into(table: str, names: Sequence[str]) -> str:
    columns = ", ".join(f'"{name}"' for name in names)
    return f'INTO "{table}" ({columns}) VALUES ({", ".join("?" * len(names))})'
