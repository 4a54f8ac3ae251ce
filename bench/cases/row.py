"""The schema of a result: every column of a row, with its type, its unit and its meaning."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from gradient_routes.bench.cases.column import ESTIMATE, Column, Row, declared
from gradient_routes.bench.cases.status import Status
from gradient_routes.routes.tally import KINDS

# settled by an answer; by a limit of the case or of the machine; by an error in what was run
ANSWERED = (Status.OK, Status.SKIPPED, Status.PRUNED)
LIMITED = (Status.TIMEOUT, Status.OUT_OF_MEMORY)
WRONG = (Status.NOT_CONVERGED, Status.NON_FINITE, Status.FAILED, Status.CRASHED)
STATUSES = (*ANSWERED, *LIMITED, *WRONG)

COLUMNS = (
    Column("problem", "TEXT", "", "name of the problem"),
    Column("problem_options", "TEXT", "", "its options, defaults included", json=True),
    Column("route", "TEXT", "", "name of the route"),
    Column("route_options", "TEXT", "", "its options, as resolved for this case", json=True),
    Column("at", "TEXT", "", "the p it was computed at: start, true, values or a file"),
    Column("status", "TEXT", "", f"{', '.join(STATUSES)}"),
    Column("reason", "TEXT", "", "why it is not ok"),
    Column("note", "TEXT", "", "what should be read beside the numbers"),
    Column("n_state", "INTEGER", "1", "n_u, free unknowns"),
    Column("n_param", "INTEGER", "1", "n_p, parameters"),
    Column("partial", "TEXT", "", "which part of dJ/dp was computed; NULL where the whole"),
    Column("objective", "REAL", "problem's", "J(p)"),
    Column("gradient", "TEXT", "problem's", "dJ/dp or the part computed, where <= 64 or asked for", json=True),
    Column(
        "gradient_initial", "TEXT", "problem's", "its share by the initial state, where that depends on p", json=True
    ),
    Column("gradient_rates", "TEXT", "problem's", "and the rest, by the rates of a march", json=True),
    Column("gradient_norm", "REAL", "problem's", "|dJ/dp|_2, or of the part computed"),
    Column("gradient_error", "REAL", "1", "|g - g_ref|_2 / |g_ref|_2, where judged in directions V: of V^T g"),
    Column("reference", "TEXT", "", "where g_ref comes from"),
    Column("gradient_error_estimate", "REAL", "1", ESTIMATE),
    Column("residual", "REAL", "1", "|R(u, p)|_inf / |R(u_0, p)|_inf achieved by the forward solve"),
    Column("adjoint_residual", "REAL", "1", "|R_u^T lam + J_u|_inf / |J_u|_inf achieved by the adjoint solve"),
    Column("linear_solver", "TEXT", "", "factorization behind the forward solve"),
    Column("prepare_s", "REAL", "s", "preparation: imports, mesh, symbolic analysis, compilation"),
    Column("first_s", "REAL", "s", "first call of the gradient"),
    Column("seconds", "REAL", "s", "gradient, median of the steady samples"),
    Column("seconds_min", "REAL", "s", "gradient, fastest sample"),
    Column("seconds_q1", "REAL", "s", "gradient, lower quartile of the samples"),
    Column("seconds_q3", "REAL", "s", "gradient, upper quartile of the samples"),
    Column("unstable", "INTEGER", "1", "1 where the quartiles are more than 10 % of the median apart"),
    Column("n_samples", "INTEGER", "1", "rounds: a sample of the gradient, then one of forward solves"),
    Column("calls_per_sample", "INTEGER", "1", "gradients a sample is the mean of, so that the clock can tell them"),
    Column("interleaved", "INTEGER", "1", "cases on the problem whose rounds alternated, this one included"),
    Column("forward_s", "REAL", "s", "one forward solve, median over the same rounds"),
    Column(
        "forward_ratio", "REAL", "1", "gradient over forward solve, median of the rounds' quotients; NULL: unresolved"
    ),
    Column("ratio_floor", "REAL", "1", "forward solves in the counted work, a bound below forward_ratio"),
    Column("peak_bytes", "INTEGER", "byte", "peak memory of one call above what was held before it"),
    Column("memory_method", "TEXT", "", "how peak_bytes was measured"),
    Column("peer", "TEXT", "s, byte", "what another code says of itself: name, versions, its phases", json=True),
    Column("factor_bytes", "INTEGER", "byte", "what the factors behind the forward solve hold"),
    Column("tape_bytes", "INTEGER", "byte", "arrays AD holds between its forward and its backward sweep"),
    Column("tape_bytes_per_iteration", "REAL", "byte", "tape_bytes / iterations of unrolled routes"),
    Column("work", "TEXT", "1", "work counted during one call", json=True),
    Column("predicted_work", "TEXT", "1", "work the route declares", json=True),
    Column("predicted_s", "REAL", "s", "declared work priced by one measured forward solve"),
    Column("price_s", "REAL", "s", "that forward solve: wall time, the least of several"),
    Column("price_cpu_s", "REAL", "s", "its CPU time, which is less where it waited, as on a busy machine"),
    Column("predicted_tape_bytes", "REAL", "byte", "tape the route declares"),
    Column("started", "TEXT", "UTC", "when the case began, ISO 8601"),
    Column("settings", "TEXT", "", "of the solver, and other options of the run that a gradient depends on", json=True),
    Column("isolated", "INTEGER", "1", "1 where it ran in a process of its own"),
    Column("threads", "INTEGER", "1", "threads of BLAS, PARDISO and XLA, as limited"),
    Column("budget_s", "REAL", "s", "predicted seconds beyond which it was to be skipped; NULL: none"),
    Column("timeout_s", "REAL", "s", "wall time after which it was to be killed; NULL: none"),
    Column("memory_cap_bytes", "INTEGER", "byte", "memory it was to be killed at; NULL: none"),
    Column("host", "TEXT", "", "name of the machine it ran on"),
    Column("stderr", "TEXT", "", "its last lines on stderr"),
    Column("traceback", "TEXT", "", "of what it raised"),
    declared("problem", "problem"),
    declared("route", "route"),
    Column("case_key", "TEXT", "", "hash of what was asked: problem, route, their options, settings"),
    Column("content_key", "TEXT", "", "hash of that and of all it rests on: sources, data, versions, schema"),
)

KEYS = (
    Column("case_id", "INTEGER PRIMARY KEY", "", "counts the cases of this store"),
    Column("environment_id", "TEXT", "", "of the row in environments"),
)

SAMPLES = (
    Column("case_id", "INTEGER", "", "id of the row in cases"),
    Column("kind", "TEXT", "", "gradient or forward"),
    Column("round", "INTEGER", "1", "gradient and forward of one round are neighbours in time"),
    Column("seconds", "REAL", "s", "one call"),
)

ENVIRONMENTS = (
    Column("environment_id", "TEXT PRIMARY KEY", "", "fingerprint of the columns that follow"),
    Column("cpu", "TEXT", "", "model of the processor"),
    Column("cores", "INTEGER", "1", "cores of the machine"),
    Column("usable_cores", "INTEGER", "1", "cores this process may use"),
    Column("memory_bytes", "INTEGER", "byte", "memory of the machine"),
    Column("os", "TEXT", "", "system, release, architecture"),
    Column("python", "TEXT", "", "version of Python"),
    Column("blas", "TEXT", "", "NumPy's BLAS and its version"),
    Column("threads", "TEXT", "", "the variables that set threads of BLAS, OpenMP and XLA", json=True),
    Column("versions", "TEXT", "", "versions of the numerical libraries", json=True),
)

WORK_PREFIX = {"work": "work", "predicted": "predicted_work"}  # of a stored column -> the object in a row
WORK_COLUMNS = tuple(
    Column(f"{prefix}_{kind}", "INTEGER", "1", f"{kind} {how}")
    for prefix, how in zip(WORK_PREFIX, ("counted", "declared"), strict=True)
    for kind in KINDS
)
STORED = tuple(c for c in COLUMNS if c.name not in ("work", "predicted_work")) + WORK_COLUMNS


def empty_row() -> Row:
    """A row with every column absent."""
    return dict.fromkeys((c.name for c in COLUMNS), None)


def row_of(known: Row) -> Row:
    """The row of what is known; the rest is absent. Raises KeyError for what is no column."""
    row = empty_row()
    unknown = known.keys() - row.keys()
    if unknown:
        raise KeyError(f"no column {sorted(unknown)[0]} - declare it in bench/cases/row.py")
    return row | known


def measured(row: Row) -> bool:
    """Whether a row has the numbers of a gradient: also that of an iterate which is no solution."""
    return row["status"] == "ok" or (row["status"] == "not-converged" and row["gradient_norm"] is not None)


def clean(value: Any) -> Any:
    """JSON and SQL have no NaN: what is not a finite number is absent, inside objects, too."""
    if isinstance(value, dict):
        return {key: clean(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [clean(item) for item in value]
    if isinstance(value, np.generic):
        return clean(value.item())
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def storable(value: Any) -> Any:
    """SQLite's integers end at 2^63; a predicted count may not."""
    value = clean(value)
    return float(value) if isinstance(value, int) and value >= 2**63 else value


def stored(column: Column, value: Any) -> Any:
    """A value as SQLite keeps it: objects as JSON text."""
    if column.json and value is not None:
        return json.dumps(clean(value), allow_nan=False)
    return storable(value)


def as_json(row: Row) -> str:
    """One JSON object on one line, of printable ASCII."""
    return json.dumps(clean(row), allow_nan=False).replace("\x7f", "\\u007f")


def as_record(row: Row) -> tuple[Any, ...]:
    """The values of STORED for the database: objects as JSON text, work spread over one column a kind."""
    record = []
    for column in STORED:
        if column in WORK_COLUMNS:
            prefix, _, kind = column.name.partition("_")
            work = row[WORK_PREFIX[prefix]]
            record.append(None if work is None else storable(work[kind]))
        else:
            record.append(stored(column, row[column.name]))
    return tuple(record)


def from_record(record: Row) -> Row:
    """The row that `as_record` wrote, from its columns with objects parsed."""
    row = empty_row()
    for column in COLUMNS:
        if column.name in record:
            row[column.name] = record[column.name]
    for prefix, name in WORK_PREFIX.items():
        work = {kind: record.get(f"{prefix}_{kind}") for kind in KINDS}
        row[name] = None if None in work.values() else work
    return row
