"""Expected failures: which cases are known not to be ok, and why, in a file people write.

[[expected]]
problem = "bar[n=1000000]"
route = "unrolled-ad"
status = "out-of-memory"
reason = "the tape of a million iterates is 16 TB"
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.row import STATUSES
from gradient_routes.bench.cases.selector import Selector, parse
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.problems.errors import InputError

FILE = "expected.toml"  # beside the store
KEYS = ("problem", "route", "status", "reason")
FAILING = tuple(status for status in STATUSES if status != "ok")


@dataclass(frozen=True)
class Expectation:
    """Cases that a problem's and a route's selector name, how they end, and the reason."""

    problem: str
    route: str
    status: str
    reason: str

    def matches(self, row: Row) -> bool:
        """Whether the row is of a case it names; options that the selectors leave out may have any value."""
        return _named(self.problem, row, "problem") and _named(self.route, row, "route")


@dataclass(frozen=True)
class Judged:
    """A row that an expectation names: it ended as expected, or it is ok all the same."""

    word: Literal["expected", "unexpected success"]
    expectation: Expectation

    @property
    def says(self) -> str:
        expected = self.expectation
        if self.word == "expected":
            return f"expected: {expected.reason}"
        return f"unexpected success, {expected.status} was expected: {expected.reason} - take it out of {FILE}"


def judged(row: Row, expectations: Sequence[Expectation]) -> Judged | None:
    """What the expectations say of a row; None where none names it, or where it fails in another way."""
    naming = [expectation for expectation in expectations if expectation.matches(row)]
    for expectation in naming:
        if row["status"] == expectation.status:
            return Judged("expected", expectation)
    return Judged("unexpected success", naming[0]) if naming and row["status"] == "ok" else None


def as_expected(row: Row, expectations: Sequence[Expectation]) -> bool:
    """Whether it failed in a way that was expected."""
    verdict = judged(row, expectations)
    return verdict is not None and verdict.word == "expected"


def beside(path: Path) -> tuple[Expectation, ...]:
    """Those in the folder of a store, if any. Raises InputError."""
    file = path.parent / FILE
    return read(file) if located(file).exists() else ()


def read(path: Path) -> tuple[Expectation, ...]:
    """The expectations of a file. Raises InputError for what is not as it should be."""
    try:
        content = tomllib.loads(located(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error} - name a file of [[expected]] entries") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text: {error.reason} at byte {error.start} - write TOML") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is no TOML: {error} - mend it there") from error
    unknown = [key for key in content if key != "expected"]
    if unknown:
        raise InputError(f"{path}: unknown key '{unknown[0]}' - write entries under [[expected]]")
    entries = content.get("expected", [])
    if not isinstance(entries, list):
        raise InputError(f"{path}: 'expected' is no list of entries - write [[expected]], in two pairs of brackets")
    return tuple(_entry(entry, f"{path}: entry {i}") for i, entry in enumerate(entries, 1))


def _entry(entry: Any, who: str) -> Expectation:
    if not isinstance(entry, dict):
        raise InputError(f"{who}: is no table - write [[expected]] and its keys below")
    unknown = [key for key in entry if key not in KEYS]
    if unknown:
        raise InputError(f"{who}: unknown key '{unknown[0]}' - {did_you_mean(unknown[0], KEYS)}")
    for key in KEYS:
        if not isinstance(entry.get(key), str) or not entry[key].strip():
            raise InputError(f'{who}: has no {key} - write {key} = "..."')
    if entry["status"] not in FAILING:
        raise InputError(f"{who}: status '{entry['status']}' - {did_you_mean(entry['status'], FAILING)}")
    for kind in ("problem", "route"):
        _checked(entry[kind], f"{who}: {kind}")
    return Expectation(**{key: " ".join(entry[key].split()) for key in KEYS})


def _checked(text: str, who: str) -> Selector:
    try:
        chosen = parse(text)
    except InputError as error:
        raise InputError(f"{who}: {error}") from error
    if chosen.name == "all" and chosen.grid:
        raise InputError(f"{who}: selector '{text}' - 'all' takes no options; name what has them")
    return chosen


def _named(text: str, row: Row, kind: str) -> bool:
    chosen, options = parse(text), row[f"{kind}_options"] or {}
    if chosen.name == "all":
        return True
    return chosen.name == row[kind] and all(
        name in options and any(_equal(given, options[name]) for given in texts) for name, texts in chosen.grid.items()
    )


def _equal(text: str, value: Any) -> bool:
    """Whether a selector's text stands for a stored value; 1e6 does for 1000000, none for an absent one."""
    if value is None or isinstance(value, bool):
        return text.lower() == str(value).lower()
    if isinstance(value, int | float):
        try:
            return float(text) == value
        except ValueError:
            return False
    return text == str(value)
