"""The tables of a store: cases, their samples and environments, and those that studies declare."""

from __future__ import annotations

from functools import cache

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.cases.declared import with_declared
from gradient_routes.bench.cases.row import ENVIRONMENTS, KEYS, SAMPLES, STORED

KEY = Column("study_id", "INTEGER", "", "of the row in studies")
STUDY = (
    Column("study_id", "INTEGER PRIMARY KEY", "", "counts the studies of this store"),
    Column("study", "TEXT", "", "its name: the command"),
    Column("environment_id", "TEXT", "", "of the row in environments"),
    Column("started", "TEXT", "UTC", "when it began, ISO 8601"),
    Column("status", "TEXT", "", "ok, or how it ended before it was done: timeout, interrupted, failed ..."),
    Column("reason", "TEXT", "", "why it is not ok"),
    Column("stderr", "TEXT", "", "the last lines on stderr of one that is not ok"),
)


@cache
def tables() -> dict[str, tuple[Column, ...]]:
    """Columns of every table, by name."""
    return {
        "cases": (KEYS[0], KEYS[1], *STORED),
        "samples": SAMPLES,
        "environments": ENVIRONMENTS,
        "studies": STUDY,
        **{name: (KEY, *with_declared(table.columns)) for name, table in registry.study_tables().items()},
    }
