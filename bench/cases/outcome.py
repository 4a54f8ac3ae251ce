"""What comes of a case: a row, its raw timings, and what is to be shown or written beside."""

from __future__ import annotations

import traceback
from dataclasses import dataclass

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import Environment
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.cases.status import Status, one_line, reason_of, status_of
from gradient_routes.problems.errors import DomainError, InputError, RoutesError
from gradient_routes.problems.problem import Array, Fields, ParameterView, Reference


@dataclass(frozen=True)
class View:
    """A gradient at p beside its reference and the problem's own columns; position as in Parameters."""

    labels: list[str]
    units: list[str]
    position: Array | None
    p: Array
    gradient: Array
    reference: Reference | None
    columns: ParameterView


@dataclass(frozen=True)
class Sensitivities:
    """du/dp or d(S u)/dp, `values` (rows, k), of the parameters named, and what a row is of."""

    name: str
    rows: list[str]
    parameters: list[str]
    units: list[str]
    values: Array


@dataclass(frozen=True)
class Outcome:
    """A row and its raw timings, what --gradient, --vtu and --sensitivities show, the environment of its process, the
    bad input, if that is why it failed, and the place of the case in its sweep: outcomes come as they can.
    """

    row: Row
    samples: Samples | None = None
    view: View | None = None
    fields: Fields | None = None
    sensitivities: Sensitivities | None = None
    environment: Environment | None = None
    refusal: RoutesError | None = None
    place: int = 0


def failed(row: Row, who: str, failure: BaseException) -> Row:
    """The row of a case that raised `failure`: its status, the reason in a sentence, the traceback."""
    return row | {
        "status": status_of(failure),
        "reason": reason_of(failure, who),
        "traceback": "".join(traceback.format_exception(failure)),
    }


def unbuilt(row: Row, problem: str, failure: BaseException) -> Outcome:
    """The outcome of a case whose problem cannot be built."""
    row = failed(row, problem, failure)
    if not isinstance(failure, RoutesError):
        row["reason"] = f"problem '{problem}' cannot be built: {one_line(failure)} - see --debug"
    return Outcome(row)


def outdated(row: Row, file: str) -> Row:
    """The row of a case whose code or data have changed while it ran."""
    reason = f"{row['route']}: {file} has changed since the run began - run it again"
    return row | {"status": Status.FAILED, "reason": reason}


def refused(row: Row, refusal: RoutesError) -> Outcome:
    """The outcome of a case whose problem does not take what it was given."""
    return Outcome(row | {"status": Status.FAILED, "reason": str(refusal)}, refusal=refusal)


def note(row: Row, what: str) -> None:
    """Something to be read beside the numbers."""
    row["note"] = f"{row['note']}; {what}" if row["note"] else what


def bare(error: InputError | DomainError) -> InputError | DomainError:
    """Without what a subclass of others adds: that might not be put together again in another process."""
    kind = DomainError if isinstance(error, DomainError) else InputError
    return kind(str(error))
