"""stdout belongs to results: what other people's code writes there goes to stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, redirect_stdout


@contextmanager
def stdout_to_stderr() -> Iterator[Callable[[], AbstractContextManager[None]]]:
    """Inside, whatever Python, a C library or a program it starts prints to stdout comes out on stderr; not so inside
    the context that it gives.
    """
    out, kept = sys.stdout, -1
    try:
        out.flush()
        kept = os.dup(1)
        os.dup2(2, 1)
    except OSError:  # a closed stream: what Python prints is all there is to catch
        pass

    @contextmanager
    def restored() -> Iterator[None]:
        _redirect(kept)
        try:
            with redirect_stdout(out):
                yield
                out.flush()
        finally:
            _redirect(-1 if kept < 0 else 2)

    try:
        with redirect_stdout(sys.stderr):
            yield restored
    finally:
        _redirect(kept)
        if kept >= 0:
            os.close(kept)


def _redirect(descriptor: int) -> None:
    """Descriptor 1 to another one, what C still holds back written where it was meant to go."""
    if descriptor >= 0:
        if os.name == "posix":
            import ctypes

            ctypes.CDLL(None).fflush(None)
        os.dup2(descriptor, 1)
