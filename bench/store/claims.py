"""Claims: of several runners that resume one sweep, one at a time runs a case."""

from __future__ import annotations

import fcntl
import os
from functools import cached_property

from gradient_routes.bench.command_options import complain
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError


class Claims:
    """Those of this process on the cases of a store.

    A claim is a lock of the operating system on one byte of the file STORE-claims, whose position is the case_key. A
    process that ends loses its locks, however it ends, here or on another host that shares the folder: there is no
    lease to renew and none to expire.
    """

    def __init__(self, store: Store) -> None:
        self.path = store.claims

    def take(self, case_key: str) -> bool:
        """Claim a case; whether it is this process's now."""
        try:
            self._lock(fcntl.LOCK_EX | fcntl.LOCK_NB, case_key)
        except BlockingIOError:
            return False
        return True

    def release(self, case_key: str) -> None:
        self._lock(fcntl.LOCK_UN, case_key)

    def wait(self, case_keys: list[str]) -> None:
        """Until the first of these is claimed by nobody. A process that waits must hold no claim."""
        if not self.take(case_keys[0]):
            one = len(case_keys) == 1
            who, them = (
                ("1 case is run by another", "it") if one else (f"{len(case_keys)} cases are run by others", "them")
            )
            complain(f"{who} - waiting for {them}, interrupt to leave {them}")
            self._lock(fcntl.LOCK_EX, case_keys[0])
        self.release(case_keys[0])

    @cached_property
    def _file(self) -> int:
        """Opened once: closing any descriptor of a file releases all locks that a process has on it."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        return os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)

    def _lock(self, what: int, case_key: str) -> None:
        try:
            fcntl.lockf(self._file, what, 1, int(case_key, 16) >> 2)  # 62 bits: positions are signed
        except BlockingIOError:
            raise
        except OSError as error:
            raise InputError(
                f"{self.path}: {error.strerror} - name a store on a file system with locks, or leave out --resume"
            ) from error
