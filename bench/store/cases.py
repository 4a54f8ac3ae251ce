"""Cases read one at a time, some of their columns: a store of 100 000 rows is read in seconds and little memory."""

from __future__ import annotations

import gc
import json
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import COLUMNS, WORK_PREFIX
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.tally import KINDS

IDS = ("case_id", "environment_id")
EVERY = tuple(column.name for column in COLUMNS)
JSON = {column.name for column in COLUMNS if column.json} - {*WORK_PREFIX.values()}
PREFIX = {name: prefix for prefix, name in WORK_PREFIX.items()}  # of the columns that a row has as one object
OLD = "rowid"  # a store of an older schema has no keys: every row is a case
# rows of one case are joined by its key; cases come in the order in which they were first asked for
NEWEST = (
    "JOIN (SELECT max(rowid) AS newest, min({asked}) AS asked, min(rowid) AS first FROM cases"
    " GROUP BY ifnull({key}, rowid)) ON cases.rowid = newest ORDER BY asked, first"
)
AT_ONCE = 500  # rows that are asked for by number


@contextmanager
def uncollected() -> Iterator[None]:
    """Without garbage collections: what is read lives on, and to look through it takes half of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def cases(store: Store, names: Sequence[str], parse: bool = True) -> Iterator[Row]:
    """These columns of the newest row of every case, objects as JSON text unless they are to be parsed.

    Rows from before there were keys all come. Equal objects are one object. Raises InputError.
    """
    yield from _selected(store, names, None, parse)


def numbered(store: Store, ids: Sequence[int], names: Sequence[str] = EVERY) -> Iterator[Row]:
    """The rows of these case_ids, in their order, with the numbers of their environments."""
    for start in range(0, len(ids), AT_ONCE):
        some = ids[start : start + AT_ONCE]
        found = {row["case_id"]: row for row in _selected(store, (*names, *IDS), some, True)}
        yield from (found[number] for number in some if number in found)


def _selected(store: Store, names: Sequence[str], ids: Collection[int] | None, parse: bool) -> Iterator[Row]:
    plain = [name for name in names if name not in PREFIX]
    counted = [name for name in names if name in PREFIX]
    stored = ["case_id", *names, *(f"{PREFIX[name]}_{kind}" for name in counted for kind in KINDS)]
    parsed = [name for name in plain if parse and name in JSON]
    with store.reading() as db:
        there = {column[1] for column in db.execute("PRAGMA table_info(cases)")}
        columns = ", ".join(f'"{name}"' if name in there else f"NULL AS {name}" for name in stored)
        known = (name if name in there else OLD for name in ("case_key", "started"))
        which = NEWEST.format(**dict(zip(("key", "asked"), known, strict=True)))
        if ids is not None:
            which = f"WHERE rowid IN ({', '.join('?' * len(ids))})"
        for values in db.execute(f"SELECT {columns} FROM cases {which}", [*(ids or ())]):
            row = dict(zip(names, values[1:], strict=False))
            for name in parsed:
                row[name] = _parsed(store, values[0], name, row[name])
            for k, name in enumerate(counted):
                first = 1 + len(names) + k * len(KINDS)
                row[name] = _work(values[first : first + len(KINDS)])
            yield row


def _parsed(store: Store, number: int, name: str, value: Any) -> Any:
    try:
        return None if value is None else _object(value)
    except (ValueError, TypeError, RecursionError) as error:
        where = f"cases, case_id {number}, {name}"
        raise InputError(
            f"store {store.path}: {where}: no JSON ({error}) - delete that row, or name another store"
        ) from error


@lru_cache(maxsize=1 << 14)
def _object(text: str) -> Any:
    return json.loads(text)


@lru_cache(maxsize=1 << 14)
def _work(counts: tuple[int | None, ...]) -> dict[str, int] | None:
    """Kinds of work that are newer than a row were counted 0 times."""
    return None if counts[0] is None else {kind: count or 0 for kind, count in zip(KINDS, counts, strict=True)}
