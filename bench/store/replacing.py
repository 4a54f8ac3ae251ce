"""A file that appears whole or not at all, in place of the one that was there."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

NAMELESS = getattr(os, "O_TMPFILE", None)  # of Linux: what a killed process leaves has no name, hence is gone


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write in the folder of `path`, whose name it takes in the end, and whose mode if there was one.

    Nothing is changed where the block raises. Hard links to what was there keep it. Raises OSError.
    """
    folder = os.open(path.parent, os.O_RDONLY)
    part = f".routes-{secrets.token_hex(8)}.part"
    try:
        nameless, file = _opened(path.parent, part)
        with file:
            with suppress(FileNotFoundError):
                os.fchmod(file.fileno(), stat.S_IMODE(path.stat().st_mode))
            yield file
            file.flush()
            os.fsync(file.fileno())
            if nameless:
                os.link(f"/proc/self/fd/{file.fileno()}", part, dst_dir_fd=folder)
        os.replace(part, path, src_dir_fd=folder)
        os.fsync(folder)
    finally:
        with suppress(FileNotFoundError):
            os.unlink(part, dir_fd=folder)
        os.close(folder)


def check_folder(folder: Path) -> None:
    """Raise OSError where `replacing` could not write."""
    part = f".routes-{secrets.token_hex(8)}.part"
    nameless, file = _opened(folder, part)
    file.close()
    if not nameless:
        (folder / part).unlink()


def _opened(folder: Path, part: str) -> tuple[bool, BinaryIO]:
    """A new file, and whether it has no name yet: where the file system cannot do that it is `part`."""
    if NAMELESS is not None and os.path.isdir("/proc/self/fd"):
        with suppress(OSError):  # not every file system can; whatever else is wrong is so below, too
            return True, open(os.open(folder, os.O_WRONLY | NAMELESS, 0o666), "wb")
    return False, open(os.open(folder / part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "wb")
