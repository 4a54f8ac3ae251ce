"""Signals that end a process: as KeyboardInterrupt, and where it can be heard."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

EXPIRED = signal.SIGALRM if hasattr(signal, "SIGALRM") else signal.SIGINT  # the time of a job is over
STOPS = (signal.SIGINT, signal.SIGTERM, EXPIRED)  # what tells a job to end


def interruptible() -> None:
    """SIGINT and SIGTERM raise KeyboardInterrupt in this process, also where it was started with SIGINT ignored, as
    shells start what runs in the background.
    """
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) in (signal.SIG_DFL, signal.SIG_IGN):
                signal.signal(number, signal.default_int_handler)


@contextmanager
def blocked(numbers: Iterable[signal.Signals]) -> Iterator[None]:
    """Processes that this thread starts get these signals once they unblock them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Interrupt:
    """Within it, in the main thread, what would raise KeyboardInterrupt is noted, for heard() to raise; a second one is
    raised where it comes.

    Raised at once it may come in a finalizer, such as that of Dask's futures, where Python prints and drops it.
    wake() is called when it comes: by the handler of a signal, so that it must not wait for a lock.
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
        """Raises KeyboardInterrupt where there was one."""
        if self._noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.__exit__()
        self._noted = True
        self._wake()
