"""What starts an adapter: any command, or an adapter's script alone, which runs in its own environment."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gradient_routes.problems.errors import InputError, Unsupported
from gradient_routes.routes.foreign.manifest import manifest


@dataclass(frozen=True)
class Command:
    """Its words, and the options that the adapter is given."""

    words: Sequence[str]
    options: dict[str, str] = field(default_factory=dict)


def command_of(text: str) -> Command:
    """Of a line as in a shell, or of a script FILE.py. Raises InputError, Unsupported for a script without environment.

    A script alone runs with its options at their defaults.
    """
    words = words_of(text)
    if len(words) > 1 or not words[0].endswith(".py"):
        return Command(words)
    found = manifest(Path(words[0]).absolute())
    if not found.ready:
        raise Unsupported(f"{text} has no environment here - make it: routes environments create {text}")
    return Command(found.command(found.defaults), found.defaults)


def words_of(text: str) -> list[str]:
    """Raises InputError for a line without words, and for one with an open quotation."""
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise InputError(f"adapter: command={text}: {error} - close it") from None
    if not words:
        raise InputError("adapter: no command - give one: --route 'adapter[command=./mine]'")
    return words
