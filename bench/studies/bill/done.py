"""The outcomes of a run: stored and printed as they come, shown in the order asked for."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from gradient_routes.bench.sanitize import echo, unread
from gradient_routes.bench.store.keeping import Keeper

if TYPE_CHECKING:
    from gradient_routes.bench.cases.column import Row
    from gradient_routes.bench.cases.expected import Expectation
    from gradient_routes.bench.cases.outcome import Outcome, View
    from gradient_routes.bench.store.store import Store

MOST = 1000


class Done:
    """Outcomes so far, without what only the store needs; `failed` says what could not be stored or printed.

    Of many, the first and those that failed are kept, MOST of each: memory does not grow with a sweep. `count` is of
    all of them, `failures` of those that failed and were not expected to.
    """

    def __init__(self, store: Store | None, as_json: bool, known: Sequence[Expectation], views: bool) -> None:
        self.store, self.as_json, self.known, self._views = store, as_json, known, views
        self.outcomes: list[Outcome] = []
        self.failed: list[str] = []
        self.count = self.failures = 0
        self._keeper = Keeper(store)
        self._waiting: dict[int, Row] = {}  # by place: rows that are not printed yet
        self._next = 0

    def take(self, outcome: Outcome) -> None:
        """Store a row at once; print it, as JSON, as soon as all rows before it are printed."""
        from gradient_routes.bench.cases.expected import as_expected
        from gradient_routes.bench.cases.row import ANSWERED

        self._keeper.append(outcome.row, outcome.samples, outcome.environment)
        self.count += 1
        failed = outcome.row["status"] not in ANSWERED
        self.failures += failed and not as_expected(outcome.row, self.known)
        if len(self.outcomes) < (2 * MOST if failed else MOST) or self._views:
            slim = replace(outcome, row=outcome.row | {"gradient": None}, samples=None, environment=None)
            self.outcomes.append(slim if self._views else replace(slim, view=None, fields=None))
        self._waiting[outcome.place] = outcome.row | _components(outcome.view)
        while self._next in self._waiting:
            self._print(self._next)
            self._next += 1

    def _print(self, place: int) -> None:
        from gradient_routes.bench.cases.row import as_json

        row = self._waiting.pop(place)
        if self.as_json:
            with self._printing():
                echo(as_json(row))

    def close(self, gradients: bool) -> None:
        """Keep what could not be stored before. Print the table and, if asked for, gradients; with --json the rows that
        still wait for an earlier one.
        """
        from gradient_routes.bench.studies.bill.view import show

        apart = self._keeper.close()
        self.failed += [apart] if apart else []
        for place in sorted(self._waiting):
            self._print(place)
        if self.as_json:
            return
        views = [(o.row, o.view) for o in self.ordered if o.view is not None and gradients]
        kept = None if self.store is None or apart else self.store.path
        with self._printing():
            show([o.row for o in self.ordered], views, kept, self.known)
            if self.count > len(self.outcomes):
                echo(f"{len(self.outcomes)} of {self.count} cases are shown; `routes export` writes all")

    @contextmanager
    def _printing(self) -> Iterator[None]:
        """What cannot be printed is kept all the same; a reader who has gone ends the run."""
        try:
            yield
        except OSError as error:
            unread(sys.stdout)
            if isinstance(error, BrokenPipeError):
                raise
            self.failed.append(f"stdout: {error.strerror} - check where the output goes")

    @property
    def ordered(self) -> list[Outcome]:
        """The outcomes in the order asked for."""
        return sorted(self.outcomes, key=lambda outcome: outcome.place)


def _components(view: View | None) -> Row:
    """What --gradient adds to a row of --json: names and units of the parameters, p, the reference of every component
    where there is one.
    """
    if view is None:
        return {}
    reference = None if view.reference is None else view.reference.gradient.tolist()
    return {"parameters": view.labels, "units": view.units, "p": view.p.tolist(), "gradient_reference": reference}
