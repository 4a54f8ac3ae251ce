"""Every run is kept: an append-only SQLite file with the tables cases, samples, environments and those of studies.

One case, or one study, is one transaction, so a process killed at any moment loses at most the one in flight; writers
wait for each other.
"""

from __future__ import annotations

import json
import os
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.declared import beside
from gradient_routes.bench.cases.environment import Environment, environment, fingerprint
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.row import ENVIRONMENTS, STORED, as_record, from_record, stored
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.store.schema import KEY, tables
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from pandas import DataFrame

APPLICATION = 0x67726164  # "grad": SQLite's mark of whose file this is
SCHEMA = 5  # 2: partial; 3: tables of studies; 4: processes, limits, keys; 5: scaling, inversion, identifiability
SQLITE = b"SQLite format 3\0"  # a database begins with it
CLAIMS = "-claims"
BESIDE = ("-journal", "-wal", "-shm", CLAIMS)  # files that belong to a store
ROOM = 2**16  # [byte] to be free beside it: for a journal and some rows
PATIENCE = 60.0  # [s] to wait for another writer


class Store:
    """What `routes` keeps: an SQLite file, `results/routes.sqlite` unless told otherwise.

    Every call opens the file and closes it. Tables and columns: results/README.md.

    >>> frame = run("bar", ["adjoint", "fd-central"], timing=False, store="routes.sqlite")
    >>> Store("routes.sqlite").cases()[["case_id", "problem", "route", "status", "work_forward_solves"]]
       case_id problem       route status  work_forward_solves
    0        1     bar     adjoint     ok                    1
    1        2     bar  fd-central     ok                   16
    """

    def __init__(self, path: Path | str, patience: float = PATIENCE) -> None:
        self.path, self.patience = Path(path), patience
        self.file = located(path)  # code of others may change the working folder

    @property
    def claims(self) -> Path:
        """The file of locks on its cases, beside it."""
        path = self.file.resolve()
        return path.with_name(path.name + CLAIMS)

    def check_writable(self) -> None:
        """Write to it and to its folder. Raises InputError now rather than after the first case.

        What is not there yet is not made.
        """
        with self._errors():
            self._refuse_others()
            there = next(folder for folder in self.file.resolve().parents if folder.exists())
            with tempfile.TemporaryFile(dir=there) as file:
                file.write(bytes(ROOM))
                file.flush()
                os.fsync(file.fileno())
            if not self.file.exists():
                return
        with self.transaction() as db:
            db.execute(f"PRAGMA user_version = {SCHEMA}")  # writes a page, whatever was there

    def _refuse_others(self) -> None:
        if self.file.is_dir():
            raise InputError(f"store {self.path}: is a directory - name a file in it: {self.path}/routes.sqlite")
        if self.file.exists() and not self.file.is_file():
            raise InputError(f"store {self.path}: is no file of a disk - name one with --store")

    def append(self, row: Row, samples: Samples | None, measured_in: Environment | None = None) -> None:
        """Keep a row and its raw timings, all or nothing, and the environment of its process, this one's if None."""
        self.append_all([(row, samples, measured_in)])

    def append_all(self, cases: Iterable[tuple[Row, Samples | None, Environment | None]]) -> None:
        """Many at once, all or nothing: the disk is waited for once, which is what a row costs."""
        names = ", ".join(["environment_id", *(c.name for c in STORED)])
        marks = ", ".join("?" * (1 + len(STORED)))
        with self.transaction() as db:
            for row, samples, measured_in in cases:
                values = (self._environment_id(db, measured_in), *as_record(row))
                case_id = db.execute(f"INSERT INTO cases ({names}) VALUES ({marks})", values).lastrowid
                if samples is not None:
                    kinds = (("gradient", samples.gradient), ("forward", samples.forward))
                    timings = [(case_id, kind, i, s) for kind, seconds in kinds for i, s in enumerate(seconds)]
                    db.executemany("INSERT INTO samples VALUES (?, ?, ?, ?)", timings)

    def append_study(
        self,
        study: str,
        found: Mapping[str, Sequence[Row]],
        started: str,
        status: str = "ok",
        reason: str | None = None,
        stderr: str | None = None,
    ) -> int:
        """Keep the rows of one study, by table, and how it ended, all or nothing. Returns its study_id."""
        with self.transaction() as db:
            values = (study, self._environment_id(db), started, status, reason, stderr)
            names = "study, environment_id, started, status, reason, stderr"
            cursor = db.execute(f"INSERT INTO studies ({names}) VALUES (?, ?, ?, ?, ?, ?)", values)
            study_id = int(cursor.lastrowid or 0)
            for name, rows in found.items():
                columns = tables()[name][1:]
                marks = ", ".join("?" * (1 + len(columns)))
                names = ", ".join(f'"{c.name}"' for c in (KEY, *columns))
                whole = (beside(row) | row for row in rows)
                records = [(study_id, *(stored(c, row[c.name]) for c in columns)) for row in whole]
                db.executemany(f'INSERT INTO "{name}" ({names}) VALUES ({marks})', records)
            return study_id

    def table(self, name: str) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Column names and rows of a table, oldest first. Raises InputError where there is no store."""
        with self.streamed(name) as (names, records):
            return names, [*records]

    @contextmanager
    def streamed(self, name: str) -> Iterator[tuple[list[str], Iterator[tuple[Any, ...]]]]:
        """The same, the rows one at a time."""
        with self.reading() as db:
            if not db.execute("SELECT count(*) FROM sqlite_master WHERE name = ?", (name,)).fetchone()[0]:
                yield [c.name for c in tables()[name]], iter(())  # a store of an older schema
                return
            cursor = db.execute(f'SELECT * FROM "{name}" ORDER BY rowid')
            yield [d[0] for d in cursor.description], cursor

    def records(self, name: str) -> list[Row]:
        """The rows of a table by column, objects parsed, columns of a newer schema absent. Raises InputError where a
        value is not what its column holds.
        """
        names, values = self.table(name)
        return [self._parsed(name, dict(zip(names, record, strict=True))) for record in values]

    def _parsed(self, table: str, record: Row) -> Row:
        row: Row = dict.fromkeys(column.name for column in tables()[table]) | record
        for column in tables()[table]:
            value = row[column.name]
            if column.json and value is not None:
                try:
                    row[column.name] = json.loads(value)
                except (ValueError, TypeError, RecursionError) as error:
                    key, number = next(iter(record.items()))
                    where = f"{table}, {key} {number}, {column.name}"
                    raise InputError(
                        f"store {self.path}: {where}: no JSON ({error}) - delete that row, or name another store"
                    ) from error
        return row

    def count(self) -> int:
        """Of all runs of cases. Raises InputError where there is no store."""
        with self.reading() as db:
            return int(db.execute("SELECT count(*) FROM cases").fetchone()[0])

    def names(self) -> set[str]:
        """Of its tables. Raises InputError where there is no store."""
        with self.reading() as db:
            return {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}

    def cases(self) -> DataFrame:
        """All cases of `routes run`, oldest first: one row each. An absent value is NA, objects are JSON text.

        Raises InputError where there is no store, or pandas is not installed.
        """
        return self._frame("cases")

    def studies(self, table: str = "studies") -> DataFrame:
        """All studies, oldest first, one row each; or the rows of one of their tables ("checks", "points" ...), which
        belong to the study `study_id`. Raises InputError as `cases` does, and for a table that there is not.
        """
        known = ["studies", *registry.study_tables()]
        if table not in known:
            raise InputError(f"store: no table '{table}' of studies - {did_you_mean(table, known)}")
        return self._frame(table)

    def _frame(self, table: str) -> DataFrame:
        from gradient_routes.bench.store.frames import frame

        return frame(tables()[table], *self.table(table))

    def rows(self) -> list[Row]:
        """The cases as rows again."""
        return [from_record(record) for record in self.records("cases")]

    def latest(self, case_key: str | None = None) -> dict[str, Row]:
        """The newest row of every case by its case_key, or of the one given; none where there is no store yet."""
        one = "" if case_key is None else "AND case_key = :case_key"
        newest = f"SELECT max(case_id) FROM cases WHERE case_key NOT NULL {one} GROUP BY case_key"
        found = self._keyed(f"SELECT * FROM cases WHERE case_id IN ({newest})", case_key)
        rows = [from_record(self._parsed("cases", record)) for record in found]
        return {row["case_key"]: row for row in rows}

    def newest(self, case_key: str | None = None) -> int:
        """The case_id of the row added last, or of the last one of a case; 0 where there is none."""
        one = "" if case_key is None else "WHERE case_key = :case_key"
        found = self._keyed(f"SELECT coalesce(max(case_id), 0) AS case_id FROM cases {one}", case_key)
        return max((int(record["case_id"]) for record in found), default=0)

    def _keyed(self, query: str, case_key: str | None) -> list[Row]:
        """What a query of keys finds; nothing where there is no store yet, or one from before there were keys."""
        if not self.file.is_file() or self.file.stat().st_size == 0:
            return []
        with self.reading() as db:
            if "case_key" not in {column[1] for column in db.execute("PRAGMA table_info(cases)")}:
                return []  # of an older schema
            cursor = db.execute(query, {"case_key": case_key})
            names = [d[0] for d in cursor.description]
            return [dict(zip(names, record, strict=True)) for record in cursor]

    @contextmanager
    def reading(self) -> Iterator[sqlite3.Connection]:
        with self._errors():
            if not self.file.is_file():
                raise InputError(f"store {self.path}: no such file - run `routes run` first, or name one with --store")
            with closing(sqlite3.connect(self._uri("rw"), uri=True, timeout=self.patience)) as db:
                if not self._has_tables(db):
                    raise InputError(f"store {self.path}: is empty - run `routes run` first, or name another")
                self._check_kind(db)
                yield db

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """The database to write to, all or nothing. Raises InputError."""
        with self._errors():
            self._refuse_others()
            self.file.parent.mkdir(parents=True, exist_ok=True)
            with closing(
                sqlite3.connect(self._uri("rwc"), uri=True, timeout=self.patience, isolation_level=None)
            ) as db:
                db.execute("BEGIN IMMEDIATE")
                if self._has_tables(db):
                    self._check_kind(db)
                    self._migrate(db)
                else:
                    self._create(db)
                yield db
                db.execute("COMMIT")  # an exception before this leaves the file as it was

    def _uri(self, mode: str) -> str:
        return f"{self.file.as_uri()}?mode={mode}"

    @staticmethod
    def _has_tables(db: sqlite3.Connection) -> bool:
        return bool(db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])

    def _create(self, db: sqlite3.Connection) -> None:
        if db.execute("PRAGMA application_id").fetchone()[0] != 0:
            self._check_kind(db)
        db.execute(f"PRAGMA application_id = {APPLICATION}")
        self._migrate(db)

    @staticmethod
    def _migrate(db: sqlite3.Connection) -> None:
        """Tables and columns that the file lacks are added, absent in its rows: of a newer schema, or of a study that
        has been installed since.
        """
        there: dict[str, set[str]] = {}
        for table, column in db.execute("SELECT m.name, c.name FROM sqlite_master m, pragma_table_info(m.name) c"):
            there.setdefault(table, set()).add(column)
        for name, columns in tables().items():
            if name not in there:
                declared = ", ".join(f'"{c.name}" {c.type}' for c in columns)
                db.execute(f'CREATE TABLE "{name}" ({declared})')
            for column in columns if name in there else ():
                if column.name not in there[name]:
                    db.execute(f'ALTER TABLE "{name}" ADD COLUMN "{column.name}" {column.type}')
        db.execute("CREATE INDEX IF NOT EXISTS by_case ON cases (case_key)")
        if db.execute("PRAGMA user_version").fetchone()[0] != SCHEMA:
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
    def _environment_id(db: sqlite3.Connection, measured_in: Environment | None = None) -> str:
        here = measured_in or environment()
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
