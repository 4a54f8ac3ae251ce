"""Signals that end a process, raised as KeyboardInterrupt at a point that can handle it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

EXPIRED = signal.SIGALRM if hasattr(signal, "SIGALRM") else signal.SIGINT  # sent at the time limit of a job
STOPS = (signal.SIGINT, signal.SIGTERM, EXPIRED)  # signals that end a job


def interruptible() -> None:
    """Let SIGINT and SIGTERM raise KeyboardInterrupt in this process, even if it was started with SIGINT ignored, as
    shells start background jobs.
    """
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) in (signal.SIG_DFL, signal.SIG_IGN):
                signal.signal(number, signal.default_int_handler)


@contextmanager
def blocked(numbers: Iterable[signal.Signals]) -> Iterator[None]:
    """Processes that this thread starts receive these signals when they unblock them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Interrupt:
    """Delays KeyboardInterrupt in the main thread until heard() is called; a second one is raised at once.

    Raised in a finalizer, such as that of Dask's futures, it would be printed and dropped by Python. The signal
    handler calls wake(), which must not wait for a lock.
    """

    def __init__(self, wake: Callable[[], None] = lambda: None) -> None:
        self._wake, self._noted = wake, False
        self._held: list[signal.Signals] = []

    def __enter__(self) -> Interrupt:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) is signal.default_int_handler:
                    signal.signal(number, self._note)
                    self._held.append(number)
        return self

    def __exit__(self, *_: object) -> None:
        while self._held:
            signal.signal(self._held.pop(), signal.default_int_handler)

    def heard(self) -> None:
        """Raise KeyboardInterrupt if a signal has come."""
        if self._noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.__exit__()
        self._noted = True
        self._wake()
