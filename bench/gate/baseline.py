"""A baseline: what a store measured, as a small text file to commit, one line a case.

No host, no date, three digits of what varies: measured again, few lines change.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from bench.environment import Environment, fingerprint
from bench.gate.measured import HOW, KEPT, NUMBERS, Case, Measured, Verdict, of_store
from bench.rows import Row, clean
from bench.store import Store
from problems.errors import InputError
from routes.tally import KINDS

MARK = "gradient-routes baseline"
VERSION = 1
ROUNDS = 50  # ratios kept of a case: more tell ranks little and fill pages
MAGIC = b"SQLite format 3\0"
TODO = "write it anew with `routes baseline`"


def measured(path: Path) -> Measured:
    """A store or a baseline file. Raises InputError for anything else."""
    if path.is_dir():
        raise InputError(f"{path}: is a directory - name a store or a baseline in it")
    if not path.exists():
        raise InputError(f"{path}: no such file - name a store, or a baseline that `routes baseline` wrote")
    try:
        with path.open("rb") as file:
            start = file.read(len(MAGIC))
            if start not in (MAGIC, b""):
                return read(path, start + file.read())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error} - name a file you may read") from error
    return of_store(Store(path))


def as_text(found: Measured) -> str:
    """The baseline as JSON."""
    environments = {fingerprint(case.environment): case.environment for case in found.cases}
    return "\n".join(
        [
            "{",
            f'"{MARK}": {VERSION},',
            f'"environments": {{{_lines(f"{json.dumps(k)}: {_json(environments[k])}" for k in sorted(environments))}}},',
            f'"cases": [{_lines(_json(_compact(case)) for case in sorted(found.cases, key=_order))}],',
            f'"verdicts": [{_lines(_json(vars(verdict)) for verdict in sorted(found.verdicts, key=_order))}]',
            "}\n",
        ]
    )


def _order(of: Case | Verdict) -> tuple[str, ...]:
    """Another order than that of measuring: lines stay where they are."""
    return (of.name, of.key) if isinstance(of, Case) else of.key


def _json(value: Any) -> str:
    return json.dumps(clean(value), allow_nan=False)


def _lines(items: Iterable[str]) -> str:
    return "\n" + ",\n".join(items) + "\n"


def _compact(case: Case) -> Row:
    """What is absent is left out, and so are work that was not done and the bill of what was run."""
    row = {name: value for name, value in case.row.items() if value is not None and name != "reason"}
    row |= {name: _digits(row[name], 3) for name in ("gradient_error", "seconds") if name in row}
    if case.ok:
        row.pop("predicted_s", None)
    if "work" in row:
        row["work"] = {kind: count for kind, count in row["work"].items() if count}
    every = max(1, -(-len(case.ratios) // ROUNDS))  # from beginning to end, so that a drift remains one
    row["ratios"] = [_digits(ratio, 4) for ratio in case.ratios[::every]]
    return row | {"environment": fingerprint(case.environment)}


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def write(path: Path, found: Measured) -> None:
    """Raises InputError rather than replace what is no baseline."""
    try:
        if path.exists() and path.stat().st_size and MARK not in path.read_text(errors="replace")[:100]:
            raise InputError(f"{path}: is there and no baseline - name another file with -o")
        path.write_text(as_text(found), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error} - name a file you may write with -o") from error


def read(path: Path, content: bytes) -> Measured:
    """What `as_text` wrote. Raises InputError for a file of another kind, a broken or a newer one."""
    try:
        given = json.loads(content)
    except (UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is neither a store nor a baseline - name one") from error
    except json.JSONDecodeError as error:
        if MARK.encode() not in content[:100]:
            raise InputError(f"{path}: is neither a store nor a baseline - name one") from error
        raise InputError(f"{path}: broken in line {error.lineno}: {error.msg} - {TODO}") from error
    if not isinstance(given, dict) or MARK not in given:
        raise InputError(f"{path}: is neither a store nor a baseline - name one")
    if given[MARK] != VERSION:
        raise InputError(f"{path}: is a baseline of version {given[MARK]!r}, this one knows {VERSION} - {TODO}")
    try:
        return _measured(path, given)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"{path}: broken: {type(error).__name__}: {' '.join(str(error).split())} - {TODO}") from error


def _measured(path: Path, given: Mapping[str, Any]) -> Measured:
    environments = {str(key): dict(value) for key, value in given["environments"].items()}
    cases = tuple(_case(entry, environments) for entry in given["cases"])
    verdicts = tuple(_verdict(entry) for entry in given["verdicts"])
    if not cases and not verdicts:
        raise ValueError("no case and no verdict in it")
    return Measured(str(path), cases, verdicts)


def _case(entry: Mapping[str, Any], environments: Mapping[str, Environment]) -> Case:
    row: Row = {name: entry.get(name) for name in KEPT}
    for name in ("problem", "route", "at", "status"):
        row[name] = _text(entry[name])
    for name in ("problem_options", "route_options", "settings"):
        row[name] = None if row[name] is None else dict(row[name])
    for name in (*NUMBERS, *(name for name in HOW if name not in ("reference", "memory_method"))):
        row[name] = None if row[name] is None else float(row[name])
    if "work" in entry:
        unknown = set(entry["work"]) - set(KINDS)
        if unknown:
            raise ValueError(f"work of unknown kind {unknown.pop()!r}")
        row["work"] = {kind: int(entry["work"].get(kind, 0)) for kind in KINDS}
    return Case(row, environments[entry["environment"]], tuple(float(ratio) for ratio in entry["ratios"]))


def _verdict(entry: Mapping[str, Any]) -> Verdict:
    route = None if entry["route"] is None else _text(entry["route"])
    return Verdict(_text(entry["problem"]), route, _text(entry["at"]), _text(entry["verdict"]))


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value
