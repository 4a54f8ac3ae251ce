"""The tidy tables of studies: one line a measured point, columns with types, units and meanings."""

from __future__ import annotations

from bench.rows import Column

KEY = Column("study_id", "INTEGER", "", "of the row in studies")
STUDY = (
    Column("study_id", "INTEGER PRIMARY KEY", "", "counts the studies of this store"),
    Column("study", "TEXT", "", "name of the table that holds its rows"),
    Column("environment_id", "TEXT", "", "of the row in environments"),
    Column("started", "TEXT", "UTC", "when it began, ISO 8601"),
)

STUDIES: dict[str, tuple[Column, ...]] = {}
