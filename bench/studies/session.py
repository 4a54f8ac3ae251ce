"""The listening end of a study: what it says is printed at once, and its rows are kept when it is over."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import as_json
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.cases.study import Kept, Note, Study
from gradient_routes.bench.command_options import FINISHED, complain, debugging
from gradient_routes.bench.execution.isolation.messages import Ended, Message
from gradient_routes.bench.sanitize import echo, echo_styled, plain, unread
from gradient_routes.bench.store.keeping import apart
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.job import ExitCode, Printed
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.text import shortened

LOST = 1  # exit code where what was found could not be written


class Session:
    """One call of a study. A store that cannot be written is refused now, before anything is measured."""

    def __init__(self, study: Study, kept: Path | None, as_json: bool) -> None:
        self._pid = os.getpid()
        self.study, self.as_json, self.started = study, as_json, now()
        self.store = None if kept is None else Store(kept)
        self.tables: dict[str, list[Row]] = {name: [] for name in study.tables}
        self.code, self.end, self.lost = 0, Ended(Status.CRASHED), ""
        if self.store is not None:
            self.store.check_writable()

    def hear(self, message: Message) -> None:
        match message:
            case Kept(table, row, stored, beside):
                if not stored:
                    row = {name: shortened(value) if isinstance(value, str) else value for name, value in row.items()}
                    self.tables[table].append(row | beside)
                if self.as_json and self.study.json is None:
                    self._print(as_json({"table": table, **row}) + "\n")
            case Note(text, result):
                text = shortened(text)
                if result and not self.as_json:
                    self._print(plain(text) + "\n")
                else:
                    complain(text)
            case Printed(text):
                self._print(text)
            case ExitCode(code):
                self.code = code
            case Ended():
                self.end = message

    def close(self) -> int:
        """Keep the rows and how the study ended, say so where it did not end well; the exit code."""
        if os.getpid() != self._pid:  # a copy that user code has forked in this process: one study is stored once
            os._exit(1)
        end, rows = self.end, any(self.tables.values())
        well = end.status is Status.OK
        if self.store is not None and (rows or end.status.todo):  # `todo`: it was ended, or lost
            try:
                self._append(self.store)
            except InputError as error:
                self.lost = apart(self.store, self._append, f"not kept: {error}")
            else:
                if rows and not self.as_json:
                    self._print(click.style(plain(f"kept in {self.store.path}"), dim=True) + "\n")
        if debugging() and end.traceback:
            echo(end.traceback, err=True, nl=False)
        finished = FINISHED if not self.lost and (rows or (self.study.keeps and not end.killed)) else None
        if end.status is Status.INTERRUPTED:
            complain(f"interrupted - {finished or 'nothing is kept'}")
        elif not well:
            complain(end.line(self.study.name) + (f"; {finished}" if finished and end.status is Status.TIMEOUT else ""))
        if self.lost:
            complain(self.lost)
        return (LOST if self.lost else self.code) if well else end.status.exit_code

    def _append(self, store: Store) -> None:
        end = self.end
        how = (Status.OK, None, None) if end.status is Status.OK else (end.status, end.reason, end.stderr)
        store.append_study(self.study.name, self.tables, self.started, *how)

    def _print(self, text: str) -> None:
        """A reader who has gone ends nothing; nor does a full disk, which is said in the end."""
        try:
            echo_styled(text)
        except OSError as error:
            unread(sys.stdout)
            if not isinstance(error, BrokenPipeError):
                self.lost = f"stdout: {error.strerror} - check where the output goes"
