"""Files that options name: one rule for all of them.

An earlier file of the same kind is replaced, whole and only once the new one is complete. No other file is: not a
source, not a store or what belongs to it, not what the command reads, nor what is linked to one of these.
"""

from __future__ import annotations

import codecs
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from errno import EACCES
from pathlib import Path
from typing import BinaryIO

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.sanitize import unread
from gradient_routes.bench.store.replacing import check_folder, replacing
from gradient_routes.bench.store.store import BESIDE, SQLITE
from gradient_routes.problems.errors import InputError, RoutesError

REMEDY = "name a file you may write"
PARTS = re.compile(r"[\[\],=|]")  # of a selector


@dataclass(frozen=True)
class Output:
    """A file that `option` names; `suffixes` are those of its kind, which begins with a `mark` if it has one."""

    option: str
    path: Path
    suffixes: tuple[str, ...]
    mark: str = ""

    def check(self, taken: Iterable[Path]) -> None:
        """Raise InputError, before anything is measured, for a file that may not or cannot be replaced.

        `taken` are stores, other outputs and all that the command reads: see `read_by`.
        """
        with self._errors(InputError):
            there = self._there()
            if there is not None and stat.S_ISDIR(there.st_mode):
                raise InputError(f"{self}: Is a directory - name a file in it")
            target = self._file.resolve()
            if any(_same(target, near) for other in taken for near in _near(located(other).resolve())):
                raise InputError(f"{self}: is another file of this run - name one of its own")
            if there is not None and not os.access(self._file, os.W_OK):
                raise PermissionError(EACCES, os.strerror(EACCES))
            if there is None or (_stream(there) is None and stat.S_ISREG(there.st_mode)):
                self._check_kind(target)
                check_folder(target.parent)

    @contextmanager
    def open(self) -> Iterator[BinaryIO]:
        """The file to write. Raises RoutesError; then what was there is still there."""
        with self._errors(RoutesError):
            there = self._there()
            stream = None if there is None else _stream(there)
            if stream is not None:  # opened anew it would overwrite what is printed
                sys.stdout.flush()
                with open(os.dup(stream), "wb") as file:
                    yield file
            elif there is not None and not stat.S_ISREG(there.st_mode):  # a pipe or a device
                with self._file.open("wb") as file:
                    yield file
            else:
                with replacing(self._file.resolve()) as file:
                    yield file

    @contextmanager
    def text(self) -> Iterator[codecs.StreamWriter]:
        """The same for text in UTF-8."""
        with self.open() as file:
            yield codecs.getwriter("utf-8")(file, "backslashreplace")

    def __str__(self) -> str:
        return f"{self.option} {self.path}"

    @property
    def _file(self) -> Path:
        return located(self.path)

    def _there(self) -> os.stat_result | None:
        """What the name stands for, which need not have another one: the pipe behind /dev/stdout."""
        try:
            return self._file.stat()
        except FileNotFoundError:
            return None

    def _check_kind(self, target: Path) -> None:
        if not target.exists() or not target.stat().st_size:
            return
        with target.open("rb") as file:
            head = file.read(100)
        if head.startswith(SQLITE):
            raise InputError(f"{self}: is a store or another database - name another file")
        if target.suffix.lower() not in self.suffixes or self.mark.encode() not in head:
            kind = self.mark or " or ".join(self.suffixes)
            raise InputError(f"{self}: is there and no {kind} - delete it first, or name another file")

    @contextmanager
    def _errors(self, kind: type[RoutesError]) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise kind(f"{self}: {error.strerror or error} - {REMEDY}") from error


def read_by(*named: Path | str | None) -> list[Path]:
    """The files that paths, selectors and references `FILE.py:NAME` name, and what those import from beside them."""
    from gradient_routes.bench.cases.sources import closure

    texts = [str(text) for text in named if text is not None]
    words = [word for text in texts for part in (text, *PARTS.split(text)) for word in (part, part.rpartition(":")[0])]
    files = {located(word.strip()).absolute() for word in words if os.path.isfile(located(word.strip()))}
    sources = [file for file in files if file.suffix == ".py"]
    return sorted(files.union(*(closure(file, file.parent, None) for file in sources)))


def print_bytes(content: bytes) -> None:
    """To stdout. Raises BrokenPipeError where its reader has gone, RoutesError for another failure."""
    try:
        sys.stdout.buffer.write(content)
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        unread(sys.stdout)
        raise RoutesError(f"stdout: {error.strerror or error} - check where the output goes") from error


def _near(path: Path) -> list[Path]:
    """A file and, if it is a store, those that belong to it."""
    return [path, *(path.with_name(path.name + end) for end in BESIDE)]


def _same(one: Path, other: Path) -> bool:
    """Whether two names stand for one file, hard links included."""
    return one == other or (one.exists() and other.exists() and one.samefile(other))


def _stream(there: os.stat_result) -> int | None:
    """The descriptor of stdout or stderr, if that is what is there: /dev/stdout of a redirected process."""
    for number in (1, 2):
        try:
            if os.path.samestat(there, os.fstat(number)):
                return number
        except OSError:  # closed
            continue
    return None
