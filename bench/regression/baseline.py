"""A baseline: the measurements of a store as a small text file to commit, one line per case.

It has no host, no date and few digits, so that a repeated measurement changes few lines.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.cases.declared import defaults_of
from gradient_routes.bench.cases.environment import Environment, fingerprint
from gradient_routes.bench.cases.order import in_order
from gradient_routes.bench.cases.row import COLUMNS, clean
from gradient_routes.bench.regression.measured import DECLARED, KEPT, Case, Measured, Verdict, of_store
from gradient_routes.bench.store.store import SQLITE, Store
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.tally import KINDS

MARK = "gradient-routes baseline"
VERSION = 1
ROUNDS = 50  # ratios kept of a case: more hardly improve a rank test
COLUMN = {column.name: column for column in COLUMNS}
REQUIRED = ("problem", "route", "at", "status")
REMEDY = "write it again with `routes baseline`"


def measured(path: Path) -> Measured:
    """A store, in the order of `routes report`, or a baseline file. Raises InputError for anything else."""
    if path.is_dir():
        raise InputError(f"{path}: is a directory - name a store or a baseline in it")
    if not path.exists():
        raise InputError(f"{path}: no such file - name a store, or a baseline that `routes baseline` wrote")
    try:
        with path.open("rb") as file:
            start = file.read(len(SQLITE))
            if start not in (SQLITE, b""):
                return read(path, start + file.read())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error} - name a file you may read") from error
    found = of_store(Store(path))
    return replace(found, cases=tuple(in_order(found.cases, lambda case: case.row)))


def as_text(found: Measured) -> str:
    """The baseline as JSON."""
    environments = {fingerprint(case.environment): case.environment for case in found.cases}
    written = {
        "cases": [_json(_compact(case)) for case in sorted(found.cases, key=_order)],
        "verdicts": [_json(vars(verdict)) for verdict in sorted(found.verdicts, key=_order)],
    }
    tables = (f'"{name}": [\n' + ",\n".join(lines) + "\n]" for name, lines in written.items())
    known = ",\n".join(f'"{key}": {_json(environments[key])}' for key in sorted(environments))
    return ",\n".join([f'{{\n"{MARK}": {VERSION}', f'"environments": {{\n{known}\n}}', *tables]) + "\n}\n"


def _order(of: Case | Verdict) -> tuple[str, ...]:
    """A key to sort by that does not depend on the order of measuring."""
    return (of.name, of.key) if isinstance(of, Case) else of.key


def _json(value: Any) -> str:
    return json.dumps(clean(value), allow_nan=False)


def _compact(case: Case) -> Row:
    """The row without absent values, counts of 0 and the predicted cost of what was run."""
    row = {name: value for name, value in case.row.items() if value is not None and name != "reason"}
    row |= {name: {"defaults": defaults_of(row[name])} for name in DECLARED if name in row}
    row |= {name: _digits(row[name], 3) for name in ("gradient_error", "seconds") if name in row}
    if case.ok:
        row.pop("predicted_s", None)
    if "work" in row:
        row["work"] = {kind: count for kind, count in row["work"].items() if count}
    every = max(1, -(-len(case.ratios) // ROUNDS))  # evenly from all rounds, so that a drift is kept
    row["ratios"] = [_digits(ratio, 4) for ratio in case.ratios[::every]]
    row["fastest"] = None if case.fastest is None else _digits(case.fastest, 4)
    return row | {"environment": fingerprint(case.environment)}


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def read(path: Path, content: bytes) -> Measured:
    """Read what `as_text` wrote. Raises InputError for another kind of file, a broken or a newer one."""
    try:
        given = json.loads(content)
    except (UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is neither a store nor a baseline - name one") from error
    except json.JSONDecodeError as error:
        if MARK.encode() not in content[:100]:
            raise InputError(f"{path}: is neither a store nor a baseline - name one") from error
        raise InputError(f"{path}: broken in line {error.lineno}: {error.msg} - {REMEDY}") from error
    if not isinstance(given, dict) or MARK not in given:
        raise InputError(f"{path}: is neither a store nor a baseline - name one")
    if given[MARK] != VERSION:
        raise InputError(f"{path}: is a baseline of version {given[MARK]!r}, this one knows {VERSION} - {REMEDY}")
    try:
        return _measured(path, given)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(
            f"{path}: broken: {type(error).__name__}: {' '.join(str(error).split())} - {REMEDY}"
        ) from error


def _measured(path: Path, given: Mapping[str, Any]) -> Measured:
    environments = {str(key): dict(value) for key, value in given["environments"].items()}
    cases = tuple(_case(entry, environments) for entry in given["cases"])
    verdicts = tuple(_verdict(entry) for entry in given["verdicts"])
    if not cases and not verdicts:
        raise ValueError("no case and no verdict in it")
    return Measured(str(path), cases, verdicts)


def _case(entry: Mapping[str, Any], environments: Mapping[str, Environment]) -> Case:
    row: Row = {name: _value(COLUMN[name], entry.get(name)) for name in KEPT}
    row |= {name: row[name] or {} for name in ("problem_options", "route_options")}
    absent = [name for name in REQUIRED if row[name] is None]
    if absent:
        raise ValueError(f"a case without {absent[0]}")
    if row["work"] is not None:
        row["work"] = {kind: int(row["work"].get(kind, 0)) for kind in KINDS}
    fastest = None if entry["fastest"] is None else float(entry["fastest"])
    return Case(row, environments[entry["environment"]], tuple(float(ratio) for ratio in entry["ratios"]), fastest)


def _verdict(entry: Mapping[str, Any]) -> Verdict:
    problem, route, at, verdict = (_value(COLUMN["at"], entry[name]) for name in ("problem", "route", "at", "verdict"))
    if None in (problem, at, verdict):
        raise ValueError("a verdict without its problem, at or verdict")
    return Verdict(problem, route, at, verdict)


def _value(column: Column, value: Any) -> Any:
    """The value in the type of the column, or None. Raises TypeError, ValueError, OverflowError."""
    if value is None:
        return None
    if column.json:
        return dict(value)
    if column.type != "TEXT":
        number = float(value)  # raises for integers beyond the range of a float
        return int(value) if column.type == "INTEGER" else number
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value
