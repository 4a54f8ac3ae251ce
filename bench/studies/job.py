"""One call of a study, in this process or in a confined one: it says messages, and the view's text where it has one."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import IO, cast

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.declared import beside
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.cases.study import Found, Kept, Message, Options, Study
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.render.terminal.terminal import Terminal
from gradient_routes.problems.errors import RoutesError


@dataclass(frozen=True)
class Printed:
    """Text for stdout, as the view rendered it."""

    text: str


@dataclass(frozen=True)
class ExitCode:
    """Of a study that came to its end."""

    code: int


@dataclass(frozen=True)
class Screen:
    """What is known of stdout where the command runs, so that a view elsewhere prints for it."""

    terminal: bool
    width: int
    colors: str | None

    @classmethod
    def of_stdout(cls) -> Screen:
        here = console()
        return cls(here.is_terminal, here.width, here.color_system)

    def console(self, say: Callable[[Printed], None]) -> Terminal:
        """A console whose text is heard as Printed."""
        return Terminal(
            file=cast(IO[str], Speaker(say)),
            width=self.width,
            force_terminal=self.terminal,
            color_system=self.colors,  # type: ignore[arg-type]  # rich's own name for it
            highlight=False,
            emoji=False,
            markup=False,
        )


class Speaker:
    """A text stream that says what is written to it."""

    def __init__(self, say: Callable[[Printed], None]) -> None:
        self._say = say

    def write(self, text: str) -> int:
        self._say(Printed(text))
        return len(text)

    def flush(self) -> None:
        """Nothing is held back."""


@dataclass(frozen=True)
class RunStudy:
    """A study with its options. It is named, not sent: a process of its own imports it again."""

    name: str
    options: Options
    screen: Screen
    as_json: bool
    plots: bool

    def __call__(self, channel: Channel) -> None:
        """Says rows and notes, what the view prints, and the exit code. Raises what the study raises."""
        study = registry.studies()[self.name]
        run, view, as_dict = (study.load(part) for part in ("run", "view", "json"))
        assert run is not None
        out = self.screen.console(channel.say)

        def say(message: Message) -> None:
            if isinstance(message, Kept) and not message.stored:
                _check(study, message)
                message = replace(message, beside=beside(message.row))
            if not isinstance(message, Found):
                channel.say(message)
            elif self.as_json:
                if as_dict is not None:
                    channel.say(Printed(json.dumps(clean(as_dict(message.value)), allow_nan=False) + "\n"))
            elif view is not None:
                view(out, message.value, self.plots)

        code = run(say, **self.options) or 0
        if not (isinstance(code, int) and 0 <= code < 256):
            raise RoutesError(f"{self.name}: returned {code!r} - return an exit code or None")
        channel.say(ExitCode(code))


def _check(study: Study, kept: Kept) -> None:
    """Raise RoutesError for a row that is not of a declared table."""
    table = study.tables.get(kept.table)
    if table is None or {column.name for column in table.columns} != set(kept.row):
        raise RoutesError(
            f"{study.name}: a row of '{kept.table}' has not the columns that are declared - correct its Kept"
        )
