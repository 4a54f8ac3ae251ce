"""READ FIRST. A study: one question answered by measurement, declared as one value.

Its command, the tables of the store, the columns of CSV files, the sections of a report and the reference pages of the
documentation are all made from that value. A study is registered by an entry point of the group
`gradient_routes.studies`; nothing else has to know it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from gradient_routes.bench.cases.column import Row, Table

Options = dict[str, Any]
RESERVED = ("cases", "samples", "environments", "studies", "study_id")  # tables and the key of every store
Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]  # as click.option(...) gives one


@dataclass(frozen=True)
class Kept:
    """A row of one of the study's tables; of `cases`, which the study has stored itself, where `stored`.

    `beside` are columns that every such table has in the store, see bench.cases.declared: a study leaves them out.
    """

    table: str
    row: Row
    stored: bool = False
    beside: Row = field(default_factory=dict)


@dataclass(frozen=True)
class Note:
    """A line for stderr: what was left out, what is to be read beside the numbers. On stdout where it tells of a
    `result`, a file that was written say, and stdout is not for JSON.
    """

    text: str
    result: bool = False


@dataclass(frozen=True)
class Found:
    """Something to show: handed to the view in the process that found it, so it need not be picklable."""

    value: Any


Message = Kept | Note | Found
Say = Callable[[Message], None]


@dataclass(frozen=True)
class Rule:
    """Options that only mean something `when` it holds: otherwise they are refused, not ignored."""

    names: tuple[str, ...]
    when: Callable[[Options], bool]
    why: str


@dataclass(frozen=True)
class Study:
    """Importing a declaration costs nothing: `run`, `view`, `json` and `figures` are "module:function", loaded late.

    name      the verb of the command line
    question  what it answers, in one sentence
    help      the rest of `--help`
    options   click options, in the order of `--help`; those of the store, of limits, --json and --no-plot are added
    rules     options that are refused unless another one is given
    tables    what it keeps; the name of the first one stands in the table `studies`
    run       (say: Say, **options) -> exit code or None: measures, and says what it finds as soon as it is found. It
              may catch KeyboardInterrupt to say what it has; it then raises it again. Rows first: a view may fail
    view      (console, value, plots: bool) -> None: shows the value of a Found in a terminal
    json      (value) -> dict: --json prints it for every Found; without, every kept row is a line
    figures   (source) -> Section | None: its part of a report
    command   "module:command", a click command of its own in place of the one that is made
    stores    whether there will be rows to store, by the options; without, always
    keeps     whether an interrupted run has something to keep
    plots     whether --no-plot is one of its options
    confined  whether the whole study runs in a process of its own under limits; else `run` gets `isolate` and `limits`
    """

    name: str
    question: str
    tables: Mapping[str, Table]
    run: str | None = None
    help: str = ""
    options: tuple[Decorator, ...] = ()
    rules: tuple[Rule, ...] = ()
    view: str | None = None
    json: str | None = None
    figures: str | None = None
    command: str | None = None
    stores: Callable[[Options], bool] | None = None
    keeps: bool = False
    confined: bool = True
    plots: bool = True

    def odd_name(self) -> str | None:
        """The first table or column that a store cannot have under its name."""
        names = [*self.tables, *(column.name for table in self.tables.values() for column in table.columns)]
        return next((name for name in names if not name.isidentifier() or name in RESERVED), None)

    def load(self, part: str) -> Callable[..., Any] | None:
        """The function behind `run`, `view`, `json`, `figures` or `command`; None where the study has none."""
        pointer: str | None = getattr(self, part)
        if pointer is None:
            return None
        module, _, name = pointer.partition(":")
        function: Callable[..., Any] = getattr(import_module(module), name)
        return function
