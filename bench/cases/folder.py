"""The folder that relative paths of a command start from, whatever code of others makes the working folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_start: Path | None = None


@contextmanager
def from_here() -> Iterator[None]:
    """Inside, relative paths start from what is the working folder now."""
    global _start
    before, _start = _start, Path.cwd()
    try:
        yield
    finally:
        _start = before


def located(path: Path | str) -> Path:
    """Absolute; outside of a command from the working folder, as everywhere in Python."""
    return (_start or Path.cwd()) / path
