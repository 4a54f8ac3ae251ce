"""Every run is kept: an append-only SQLite file with the tables cases, samples and environments.

One case is one transaction, so a process killed at any moment loses at most the case in flight; writers wait
for each other.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from bench.environment import environment, fingerprint
from bench.rows import ENVIRONMENTS, SAMPLES, STORED, Row, as_record, from_record
from bench.timing import Samples
from problems.errors import InputError

APPLICATION = 0x67726164  # "grad": SQLite's mark of whose file this is
SCHEMA = 2  # 2: columns partial and tape_bytes_per_iteration
PATIENCE = 60.0  # [s] to wait for another writer
TABLES = ("cases", "samples", "environments")


class Store:
    """A store on disk. `append` keeps a row, `table` gives one back. Every call opens the file and closes it."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)

    def check_writable(self) -> None:
        """Raise InputError now rather than after the first case."""
        with self._transaction() as db:
            self._environment_id(db)

    def append(self, row: Row, samples: Samples | None) -> None:
        """Keep a row and its raw timings, all or nothing."""
        with self._transaction() as db:
            names = ", ".join(["environment_id", *(c.name for c in STORED)])
            marks = ", ".join("?" * (1 + len(STORED)))
            values = (self._environment_id(db), *as_record(row))
            case_id = db.execute(f"INSERT INTO cases ({names}) VALUES ({marks})", values).lastrowid
            if samples is not None:
                kinds = (("gradient", samples.gradient), ("forward", samples.forward))
                timings = [(case_id, kind, i, s) for kind, seconds in kinds for i, s in enumerate(seconds)]
                db.executemany("INSERT INTO samples VALUES (?, ?, ?, ?)", timings)

    def table(self, name: str) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Column names and rows of one of TABLES, oldest first. Raises InputError where there is no store."""
        with self._errors():
            if not self.path.is_file():
                raise InputError(f"store {self.path}: no such file - run `routes run` first, or name one with --store")
            with closing(sqlite3.connect(self._uri("rw"), uri=True, timeout=PATIENCE)) as db:
                if not self._has_tables(db):
                    raise InputError(f"store {self.path}: is empty - run `routes run` first, or name another")
                self._check_kind(db)
                cursor = db.execute(f"SELECT * FROM {name} ORDER BY rowid")
                return [d[0] for d in cursor.description], cursor.fetchall()

    def rows(self) -> list[Row]:
        """The cases as rows again."""
        names, records = self.table("cases")
        return [from_record(dict(zip(names, record, strict=True))) for record in records]

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._errors():
            if self.path.is_dir():
                raise InputError(f"store {self.path}: is a directory - name a file in it: {self.path}/routes.sqlite")
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with closing(sqlite3.connect(self._uri("rwc"), uri=True, timeout=PATIENCE, isolation_level=None)) as db:
                db.execute("BEGIN IMMEDIATE")
                if self._has_tables(db):
                    self._check_kind(db)
                    self._add_columns(db)
                else:
                    self._create(db)
                yield db
                db.execute("COMMIT")  # an exception before this leaves the file as it was

    def _uri(self, mode: str) -> str:
        return f"{self.path.absolute().as_uri()}?mode={mode}"

    @staticmethod
    def _has_tables(db: sqlite3.Connection) -> bool:
        return bool(db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])

    def _create(self, db: sqlite3.Connection) -> None:
        if db.execute("PRAGMA application_id").fetchone()[0] != 0:
            self._check_kind(db)
        cases = ", ".join(f"{c.name} {c.type}" for c in STORED)
        samples = ", ".join(f"{c.name} {c.type}" for c in SAMPLES)
        environments = ", ".join(f"{c.name} {c.type}" for c in ENVIRONMENTS)
        db.execute(f"CREATE TABLE environments ({environments})")
        db.execute(f"CREATE TABLE cases (case_id INTEGER PRIMARY KEY, environment_id TEXT, {cases})")
        db.execute(f"CREATE TABLE samples ({samples})")
        db.execute(f"PRAGMA application_id = {APPLICATION}")
        db.execute(f"PRAGMA user_version = {SCHEMA}")

    @staticmethod
    def _add_columns(db: sqlite3.Connection) -> None:
        """What an older schema lacks is added, absent in its rows."""
        if db.execute("PRAGMA user_version").fetchone()[0] < SCHEMA:
            there = {column[1] for column in db.execute("PRAGMA table_info(cases)")}
            for column in STORED:
                if column.name not in there:
                    db.execute(f"ALTER TABLE cases ADD COLUMN {column.name} {column.type}")
            db.execute(f"PRAGMA user_version = {SCHEMA}")

    def _check_kind(self, db: sqlite3.Connection) -> None:
        if db.execute("PRAGMA application_id").fetchone()[0] != APPLICATION:
            raise InputError(f"store {self.path}: is a database of another program - name another file with --store")
        schema = db.execute("PRAGMA user_version").fetchone()[0]
        if not 1 <= schema <= SCHEMA:
            raise InputError(
                f"store {self.path}: has schema {schema}, this version knows 1 to {SCHEMA} - name another file"
            )

    @staticmethod
    def _environment_id(db: sqlite3.Connection) -> str:
        here = environment()
        values = [json.dumps(here[c.name]) if c.json else here[c.name] for c in ENVIRONMENTS[1:]]
        marks = ", ".join("?" * len(ENVIRONMENTS))
        key = fingerprint(here)
        db.execute(f"INSERT OR IGNORE INTO environments VALUES ({marks})", (key, *values))
        return key

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """SQLite's and the system's complaints as one line."""
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            what = error.strerror if isinstance(error, OSError) else str(error)
            todo = "try again later" if "locked" in str(what) else "name a file you may write with --store"
            raise InputError(f"store {self.path}: {what} - {todo}") from error
