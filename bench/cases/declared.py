"""What code named by FILE.py:NAME or module:NAME declares: kept with rows, which are read without running it."""

from __future__ import annotations

import itertools
import json
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.column import declared as column_of
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.imported import is_reference
from gradient_routes.bench.cases.options import Described, options_of
from gradient_routes.bench.cases.registry import Kind, factory_of, is_route
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.cases.sources import Source, source
from gradient_routes.problems.errors import InputError

KINDS: tuple[Kind, ...] = ("problem", "route")
_KNOWN: dict[tuple[Kind, str], Declared] = {}


@dataclass(frozen=True, eq=False)
class Declared(Described):
    """The options of a problem or a route, where its code is, what a route calls itself: what is needed without running
    it. It stands in place of the code where that is not imported.
    """

    source: Source
    name: str = ""

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

    def plain(self, who: str) -> Declared:
        """Without types of its own code, which another process does not have. Raises InputError for such a default."""
        for option in self.options.values():
            try:
                json.dumps(clean(option.default))
            except TypeError as error:
                raise InputError(
                    f"{who}: default of {option.name}: {error} - give a number, a text or None, and convert it inside"
                ) from None
        plain = [replace(o, kinds=tuple(map(_plain, o.kinds)), help=str(o.help)) for o in self.options.values()]
        return replace(self, options={option.name: option for option in plain})


def _plain(kind: Any) -> Any:
    """A type that options are converted to; object for others, to which no text is."""
    values = get_args(kind) if get_origin(kind) is Literal else ()
    literal = values and all(type(value) in (str, int, float, bool, NoneType) for value in values)
    return kind if literal or kind in (str, int, float, bool, NoneType) else object


Told = Mapping[tuple[Kind, str], Declared]  # what another process has found


def declared_by(target: Any) -> Declared:
    """What code declares, which may have been described elsewhere."""
    if isinstance(target, Declared):
        return target
    return Declared(options_of(factory_of(target)), source(target), str(target.name) if is_route(target) else "")


def source_by(target: Any) -> Source:
    return target.source if isinstance(target, Declared) else source(target)


def remember(kind: Kind, name: str, declared: Declared) -> None:
    """What this process knows of it from now on."""
    _KNOWN[kind, name] = declared


def known(kind: Kind, name: str) -> Declared | None:
    """What this process has been told: its code has been imported here or in a process that was started for it."""
    return _KNOWN.get((kind, name))


def is_foreign(module: str) -> bool:
    """Whether it is of the package of code that has been described here and is not imported."""
    tops = {each.source.module.partition(".")[0] for each in _KNOWN.values()}
    return module.partition(".")[0] in tops and module not in sys.modules


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
