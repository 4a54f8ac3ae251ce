"""The outcomes of a run: stored and printed as they come, shown in the order asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.cases.expected import Expectation
    from gradient_routes.bench.cases.outcome import Outcome
    from gradient_routes.bench.store.store import Store


class Done:
    """Outcomes so far, without what only the store needs; `lost` says which rows could not be stored, and why."""

    def __init__(self, store: Store | None, as_json: bool, known: Sequence[Expectation], views: bool) -> None:
        self.store, self.as_json, self.known, self._views = store, as_json, known, views
        self.outcomes: list[Outcome] = []
        self.lost: list[str] = []
        self._waiting: dict[int, Row] = {}  # by place: rows that are not printed yet
        self._next = 0

    def take(self, outcome: Outcome) -> None:
        """Store a row at once; print it, as JSON, as soon as all rows before it are printed."""
        try:
            if self.store is not None:
                self.store.append(outcome.row, outcome.samples, outcome.environment)
        except InputError as error:  # a full disk or a lock: the row is still printed
            self.lost.append(str(error))
        self._waiting[outcome.place] = outcome.row
        while self._next in self._waiting:
            self._print(self._next)
            self._next += 1
        slim = replace(outcome, row=outcome.row | {"gradient": None}, samples=None, environment=None)
        self.outcomes.append(slim if self._views else replace(slim, view=None, fields=None))

    def _print(self, place: int) -> None:
        from gradient_routes.bench.cases.row import as_json

        row = self._waiting.pop(place)
        if self.as_json:
            click.echo(as_json(row))

    def show(self, gradients: bool) -> None:
        """Print the table and, if asked for, gradients; with --json the rows that still wait for an earlier one."""
        from gradient_routes.bench.studies.bill.view import show

        for place in sorted(self._waiting):
            self._print(place)
        if self.as_json:
            return
        views = [(o.row, o.view) for o in self.ordered if o.view is not None and gradients]
        kept = None if self.store is None or self.lost else self.store.path
        show([o.row for o in self.ordered], views, kept, self.known)

    @property
    def ordered(self) -> list[Outcome]:
        """The outcomes in the order asked for."""
        return sorted(self.outcomes, key=lambda outcome: outcome.place)

    @property
    def failures(self) -> list[Row]:
        """Rows of cases that failed and were not expected to."""
        from gradient_routes.bench.cases.expected import as_expected
        from gradient_routes.bench.cases.row import ANSWERED

        rows = [o.row for o in self.outcomes if o.row["status"] not in ANSWERED]
        return [row for row in rows if not as_expected(row, self.known)]
