"""What code named by FILE.py:NAME or module:NAME declares: kept with rows, which are read without running it."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.column import declared as column_of
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.imported import is_reference
from gradient_routes.bench.cases.options import Option
from gradient_routes.bench.cases.registry import Kind
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.cases.sources import Source

KINDS: tuple[Kind, ...] = ("problem", "route")
_KNOWN: dict[tuple[Kind, str], Declared] = {}


@dataclass(frozen=True)
class Declared:
    """The options of a problem or a route, and where its code is: what is needed of it without running it."""

    options: Mapping[str, Option]
    source: Source

    @property
    def defaults(self) -> Row:
        """None left out."""
        return {name: option.default for name, option in self.options.items() if option.default is not None}

    def row(self, name: str) -> Row:
        """As it is kept; a file as the user wrote it."""
        written = Path(name.rpartition(":")[0])
        file = self.source.file
        same = file is not None and written.suffix == ".py" and located(written).resolve() == Path(file)
        kept: Row = clean({"defaults": self.defaults, "file": str(written) if same else file})
        return kept | {"module": self.source.module}


def remember(kind: Kind, name: str, declared: Declared) -> None:
    """What this process knows of it from now on."""
    _KNOWN[kind, name] = declared


def known(kind: Kind, name: str) -> Declared | None:
    """What this process has been told: its code has been imported here or in a process that was started for it."""
    return _KNOWN.get((kind, name))


def kept(kind: Kind, name: str | None) -> Row | None:
    """The column of a row; None for what is registered, which is found by its name."""
    declared = None if name is None or not is_reference(name) else known(kind, name)
    return None if declared is None or name is None else declared.row(name)


def defaults_of(column: Any) -> Row:
    """The defaults in a column that was read, whatever it holds."""
    found = column.get("defaults") if isinstance(column, dict) else None
    return found if isinstance(found, dict) else {}


def source_of(column: Any) -> Source | None:
    """Where the code was, by a column that was read; None where it does not say so."""
    module, file = (column.get(name) for name in ("module", "file")) if isinstance(column, dict) else (None, None)
    if not isinstance(module, str) or not isinstance(file, str | None):
        return None
    return Source(None if file is None else str(located(file)), module)


def undeclared(rows: Iterable[Row]) -> str:
    """A sentence on cases of a version that did not keep what code declares; empty where there is none."""
    cases = [[row[k] for k in KINDS if is_reference(row[k]) and not row.get(f"{k}_declared")] for row in rows]
    count, names = sum(map(bool, cases)), [*dict.fromkeys(itertools.chain(*cases))]
    if not count:
        return ""
    return (
        f"cases of {', '.join(names[:3])}{' ...' if len(names) > 3 else ''}: {count} kept by an older version, without"
        " defaults of options and the place of the code: shown with all options, not checked for changes - run again"
    )


def kinds_of(columns: Mapping[str, Any]) -> list[tuple[str, Kind]]:
    """(column, kind) of what rows with these columns name by name and options apart."""
    named: tuple[tuple[str, Kind], ...] = (("problem", "problem"), ("route", "route"), ("other", "route"))
    return [(column, kind) for column, kind in named if f"{column}_options" in columns]


def with_declared(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Columns of a table, one of these beside every name that has options."""
    return (*columns, *(column_of(*each) for each in kinds_of({column.name: column for column in columns})))


def beside(row: Row) -> Row:
    """These columns of a row, by what this process knows."""
    return {f"{name}_declared": kept(kind, row[name]) for name, kind in kinds_of(row)}
