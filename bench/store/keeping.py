"""Rows on their way into a store that may fail: kept in memory, tried again, in the end written to a file apart.

The next `--resume` adds that to the store.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import Environment
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.store.store import BESIDE, Store
from gradient_routes.problems.errors import InputError


class Keeper:
    """Appends rows to a store, where there is one. Those that it does not take wait, and are tried again."""

    def __init__(self, store: Store | None) -> None:
        self.store = store
        self._waiting: list[tuple[Row, Samples | None, Environment | None]] = []
        self._why = ""

    def append(self, row: Row, samples: Samples | None, measured_in: Environment | None) -> None:
        """Keep a row, and those that wait."""
        if self.store is not None:
            self._waiting.append((row, samples, measured_in))
            self._store(self.store)

    def close(self) -> str:
        """Store what waits, or write it to a file apart. What to say of that; nothing where all is in the store."""
        if self.store is None:
            return ""
        self._store(self.store)
        if not self._waiting:
            return ""
        count = f"{len(self._waiting)} row{'s' * (len(self._waiting) != 1)}"
        return apart(self.store, lambda other: other.append_all(self._waiting), f"{count} not kept: {self._why}")

    def _store(self, store: Store) -> None:
        """The first alone: as long as it fails, all others would."""
        try:
            while self._waiting:
                batch = self._waiting[:1] if self._why else self._waiting[:]
                store.append_all(batch)
                del self._waiting[: len(batch)]
                self._why = ""
        except InputError as error:
            self._why = str(error)


def apart(store: Store, write: Callable[[Store], object], why: str) -> str:
    """Write what `store` does not take to a store of its own. `why`, where it is now and how it is merged."""
    for path in _places(store):
        other = Store(path)
        try:
            write(other)
        except InputError:
            for end in ("", *BESIDE):
                with suppress(OSError):  # a file system that is read-only says so even of what is not there
                    other.file.with_name(path.name + end).unlink()
        else:
            merge = shlex.join(["routes", "merge", str(path), "--store", str(store.path)])
            return f"{why}; kept in {path} - later: {merge}"
    return f"{why}; nor in any other folder"


def kept_apart(store: Store) -> list[Path]:
    """The files of rows and studies that `store` did not take, written by this user."""
    found = [path for folder in _folders(store) for path in located(folder).glob(f"{_stem(store)}-*.sqlite")]
    return [path for path in found if _is_own(path)]


def _is_own(path: Path) -> bool:
    """A folder for temporary files is everybody's. What has gone meanwhile is nobody's."""
    try:
        return path.lstat().st_uid == os.geteuid()
    except OSError:
        return False


def _places(store: Store) -> Iterator[Path]:
    """Files that there are not."""
    for folder in _folders(store):
        place = folder / f"{_stem(store)}-{os.getpid()}.sqlite"
        if located(folder).is_dir() and not located(place).exists():
            yield place


def _folders(store: Store) -> Iterable[Path]:
    """That of a store, the working folder and that for temporary files."""
    return dict.fromkeys((store.path.parent, Path(), Path(tempfile.gettempdir())))


def _stem(store: Store) -> str:
    """The names of such files begin with it: with the name of the store, and a mark of where it is."""
    mark = hashlib.sha256(bytes(store.file.resolve())).hexdigest()[:8]
    return f"{store.path.stem or 'routes'}-unsaved-{mark}"
