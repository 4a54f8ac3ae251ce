"""The listening end of a study: what it says is printed at once, and its rows are kept when it is over."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.study import Kept, Note, Study
from gradient_routes.bench.command_options import complain
from gradient_routes.bench.sanitize import unread
from gradient_routes.bench.studies.job import Heard, Printed
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError


class Session:
    """One call of a study. A store that cannot be written is refused now, before anything is measured."""

    def __init__(self, study: Study, kept: Path | None, as_json: bool) -> None:
        from gradient_routes.bench.store.store import Store

        self.study, self.as_json, self.started = study, as_json, now()
        self.store = None if kept is None else Store(kept)
        self.tables: dict[str, list[Row]] = {name: [] for name in study.tables}
        self.printed = False
        if self.store is not None:
            self.store.check_writable()

    def hear(self, message: Heard) -> None:
        match message:
            case Kept(table, row):
                self.tables[table].append(row)
                if self.as_json and self.study.json is None:
                    self._print(_line(table, row))
            case Note(text):
                complain(text)
            case Printed(text):
                self._print(text)

    @property
    def rows(self) -> int:
        return sum(map(len, self.tables.values()))

    def keep(self) -> None:
        """Rows into the store, and a line that says so. Raises InputError where they are lost: last of all."""
        if self.store is None or not self.rows:
            return
        try:
            self.store.append_study(self.tables, self.started)
        except InputError as error:
            raise InputError(f"not kept: {error}") from error
        if not self.as_json:
            self._print(click.style(f"kept in {self.store.path}", dim=True) + "\n")

    def _print(self, text: str) -> None:
        """A reader who has gone ends nothing."""
        self.printed = True
        try:
            click.echo(text, nl=False)
        except BrokenPipeError:
            unread(sys.stdout)


def _line(table: str, row: Row) -> str:
    from gradient_routes.bench.cases.row import as_json

    return as_json({"table": table, **row}) + "\n"
