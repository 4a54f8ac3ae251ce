"""What a confined process has started, in whatever sessions it runs and whoever has become its parent."""

from __future__ import annotations

import ctypes
import os
import secrets
import sys
from contextlib import suppress
from pathlib import Path

import psutil

MARK = "GRADIENT_ROUTES_CONFINED"  # variable of the environment that descendants inherit
PR_SET_CHILD_SUBREAPER = 36  # of Linux' prctl
ROUNDS = 100  # of killing: what is started meanwhile is found in the next one


def new_mark() -> str:
    """A word that no other process has in its environment, behind those of the processes that this one is in."""
    return f"{os.environ.get(MARK, '')} {secrets.token_hex(16)}".strip()


def adopt() -> None:
    """Become the parent of descendants whose own parent ends (Linux): they are found among the children then."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def of(pid: int) -> list[psutil.Process]:
    """Children and theirs, as long as the process is there."""
    try:
        return list(psutil.Process(pid).children(recursive=True))
    except psutil.Error:
        return []


def kill_marked(mark: str) -> None:
    """End all processes that have inherited the mark, those whose parents have ended before, too (Linux)."""
    for _ in range(ROUNDS):
        if not _killed(_marked(mark)):
            return


def _killed(processes: list[psutil.Process]) -> int:
    """How many of them were running."""
    running = 0
    for process in processes:
        with suppress(psutil.Error):
            if process.status() != psutil.STATUS_ZOMBIE:
                process.kill()
                process.wait(1.0)
                running += 1
    return running


def _marked(mark: str) -> list[psutil.Process]:
    """Those of this user, by the environments that they were started with."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, psutil.Error):
            if f"{MARK}={mark}".encode() in (entry / "environ").read_bytes():
                found.append(psutil.Process(int(entry.name)))
    return found
