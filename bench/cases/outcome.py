"""What comes of a case: a row, its raw timings, and what is to be shown or written beside; and how it comes about."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, replace
from typing import Any

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import Environment
from gradient_routes.bench.cases.row import row_of
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.cases.status import Status, one_line, reason_of, status_of
from gradient_routes.problems.errors import DomainError, InputError, RoutesError
from gradient_routes.problems.problem import Array, Fields, ParameterView, Reference
from gradient_routes.problems.text import shortened


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


class Record:
    """What is asked of a case, and what is known of it so far; at the end it makes the outcome, and the row."""

    def __init__(self, asked: Row) -> None:
        self.asked = asked
        self.known: Row = {}
        self._new: Row = {}

    def add(self, values: Row) -> None:
        """Columns that are known now; texts of other people's code are shortened."""
        values = {name: shortened(value) if isinstance(value, str) else value for name, value in values.items()}
        self.known |= values
        self._new |= values

    def note(self, what: str) -> None:
        """Something to be read beside the numbers."""
        self.add({"note": noted(self.known.get("note"), what)})

    def news(self) -> Row:
        """What has become known since this was asked last."""
        news, self._new = self._new, {}
        return news

    def ended(self, status: Status, reason: str | None = None, **beside: Any) -> Outcome:
        """The outcome; `beside` are its fields but for the row."""
        self.add({"status": status.value, "reason": reason})
        return Outcome(row_of(self.asked | self.known), **beside)

    def failed(self, failure: BaseException, who: str, **beside: Any) -> Outcome:
        """The outcome of a case that raised `failure`: the reason in a sentence, the traceback."""
        self.add({"traceback": "".join(traceback.format_exception(failure))})
        return self.ended(status_of(failure), reason_of(failure, who), **beside)

    def unbuilt(self, failure: BaseException) -> Outcome:
        """The outcome of a case whose problem cannot be built."""
        outcome = self.failed(failure, self.asked["problem"])
        if isinstance(failure, RoutesError):
            return outcome
        said = f"problem '{self.asked['problem']}' cannot be built: {one_line(failure)} - see --debug"
        return replace(outcome, row=outcome.row | {"reason": said})

    def refused(self, refusal: RoutesError) -> Outcome:
        """The outcome of a case whose problem does not take what it was given."""
        return self.ended(Status.FAILED, str(refusal), refusal=refusal)


def noted(before: str | None, what: str) -> str:
    """A note with another one behind it."""
    return f"{before}; {what}" if before else what


def bare(error: InputError | DomainError) -> InputError | DomainError:
    """Without what a subclass of others adds: that might not be put together again in another process."""
    kind = DomainError if isinstance(error, DomainError) else InputError
    return kind(str(error))
