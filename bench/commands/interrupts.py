"""What SIGINT and SIGTERM do to this program from its first import to its end. It imports nothing."""

from __future__ import annotations

import os
import signal
import sys
from typing import Any, NoReturn

INTERRUPTED = 130
STOPS = (signal.SIGINT, signal.SIGTERM)


def end(*_: Any) -> NoReturn:
    """At once: nothing has been measured yet, and no process started."""
    os.write(2, b"routes: interrupted - nothing is kept\n")
    os._exit(INTERRUPTED)


def unraisable(what: Any) -> None:
    """An interrupt that comes while Python runs a callback would be printed and lost."""
    if isinstance(what.exc_value, KeyboardInterrupt):
        end()
    sys.__unraisablehook__(what)


def catching() -> None:
    """From here on interrupts of this program raise KeyboardInterrupt: somebody catches it."""
    for number in STOPS:
        if signal.getsignal(number) is end:
            signal.signal(number, signal.default_int_handler)


def over() -> None:
    """This program is at its end: it is not interrupted any more."""
    if sys.unraisablehook is unraisable:
        for number in STOPS:
            signal.signal(number, signal.SIG_IGN)


def begin() -> None:
    """End at an interrupt, also where that was inherited as ignored or blocked, as shells start background jobs."""
    sys.unraisablehook = unraisable
    for number in STOPS:
        signal.signal(number, end)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
