"""Where a store stands: the newest row of every case, and whether what it rests on is still the same."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.declared import source_of
from gradient_routes.bench.cases.imported import is_reference
from gradient_routes.bench.cases.keys import content_key_of, programs
from gradient_routes.bench.cases.sources import Source, source
from gradient_routes.bench.store.cases import cases
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

SHOWN = (
    *("problem", "problem_options", "problem_declared", "route", "route_options", "route_declared"),
    *("at", "partial", "settings", "status", "case_key", "content_key"),
)
STALE, GONE, UNCHECKED = "stale", "gone", "unchecked"


@dataclass(frozen=True)
class Standing:
    """A case: its newest row, and stale or gone where the code it came from has changed or is no longer there;
    unchecked where the row does not say where the code is.
    """

    row: Row
    aged: str | None

    @property
    def word(self) -> str:
        """Its status, and what became of it."""
        return self.row["status"] if self.aged is None else f"{self.row['status']} ({self.aged})"


def standings(store: Store, columns: Sequence[str] = SHOWN) -> list[Standing]:
    """Of all cases with these columns, in the order in which they were first asked for.

    Raises InputError where there is no store or none with keys.
    """
    found = [Standing(row, _aged(row)) for row in cases(store, columns) if row["case_key"]]
    if not found:
        raise InputError(f"store {store.path}: holds no case with a key - run `routes run` first, or name another")
    return found


def _aged(row: Row) -> str | None:
    try:
        code = [_source("problem", row), _source("route", row)]
        if None in code:
            return UNCHECKED
        run = programs(row["route"], row["route_options"] or {})
        now = content_key_of(
            row["case_key"], [each for each in code if each], run, row["problem_options"] or {}, row["at"]
        )
    except (InputError, OSError):
        return GONE
    return None if now == row["content_key"] else STALE


def _source(kind: registry.Kind, row: Row) -> Source | None:
    """Where the code of a row is now, None where the row does not say; code that the row names is not run."""
    if is_reference(row[kind]):
        return source_of(row[f"{kind}_declared"])
    found = _registered(kind, row[kind])
    if isinstance(found, InputError):
        raise found
    return found


@cache
def _registered(kind: registry.Kind, name: str) -> Source | InputError:
    """Of a registered problem or route, or why there is none: names are few, their rows many."""
    try:
        return source(registry.find(kind, name).load())
    except InputError as error:
        return error


def counts(standing: list[Standing]) -> str:
    """`5 ok, 2 skipped, 1 timeout (stale)`."""
    return ", ".join(f"{number} {word}" for word, number in Counter(s.word for s in standing).most_common())
