"""A command of `routes` in a process that stays: imports and compiled code are kept; rows are those of --json."""

from __future__ import annotations

import gc
import io
import json
import os
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import click

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.folder import from_here
from gradient_routes.bench.execution.isolation.channel import Channel, Job, ended
from gradient_routes.bench.execution.isolation.messages import Ended
from gradient_routes.bench.studies.command import command_of
from gradient_routes.problems.errors import InputError

QUIETLY = ("--json", "--no-store", "--no-isolate")  # it is isolated already


@dataclass(frozen=True)
class Row:
    """What --json prints in one line."""

    value: dict[str, Any]


@dataclass(frozen=True)
class Said:
    """One line of stderr: a note, or why it is refused."""

    text: str


@dataclass(frozen=True)
class Exited:
    """The exit code of the command."""

    code: int


@dataclass(frozen=True)
class Command:
    """`routes ARGUMENTS`, of a study, in a folder: its rows as they come, its notes, its exit code.

    Raises InputError for wrong usage, what the command raises.
    """

    arguments: tuple[str, ...]
    folder: Path

    @property
    def name(self) -> str:
        return self.arguments[0]

    def __call__(self, channel: Channel) -> None:
        command = command_of(registry.studies()[self.name])
        os.chdir(self.folder)
        rows, notes = (
            Lines(lambda line: channel.say(Row(json.loads(line)))),
            Lines(lambda line: channel.say(Said(line))),
        )
        with redirect_stdout(rows), redirect_stderr(notes), from_here():
            try:
                code = command.main([*self.arguments[1:], *QUIETLY], f"routes {self.name}", standalone_mode=False)
            except click.UsageError as error:
                raise InputError(error.format_message()) from error
        channel.say(Exited(code or 0))


@dataclass(frozen=True)
class Commands:
    """One after the other; the exit code is that of the last."""

    commands: tuple[Command, ...]

    @property
    def name(self) -> str:
        return self.commands[-1].name

    def __call__(self, channel: Channel) -> None:
        for command in self.commands:
            command(channel)


class Lines(io.TextIOBase):
    """A text stream that hands on whole lines."""

    def __init__(self, take: Callable[[str], None]) -> None:
        self._take, self._begun = take, ""

    def write(self, text: str) -> int:
        *lines, self._begun = (self._begun + text).split("\n")
        for line in filter(None, lines):
            self._take(line)
        return len(text)


@dataclass(frozen=True)
class Ready:
    """The process has imported what jobs need."""


@dataclass(frozen=True)
class Finished:
    """A job has ended; the process waits for the next one."""

    end: Ended


@dataclass(frozen=True)
class Listening:
    """Does one job after the other, each as it is told to, after a first one for which all is imported and compiled."""

    first: Job
    patience: int = 0  # added to its niceness
    name: str = "lab"

    def __call__(self, channel: Channel) -> None:
        os.nice(self.patience)
        ended(self.first, Channel(lambda message: None))
        gc.freeze()  # what is there by now stays: measurements of memory collect garbage again and again
        channel.say(Ready())
        while True:
            channel.say(Finished(ended(cast(Job, channel.hear()), channel)))
