"""stdout belongs to results: what other people's code writes there goes to stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout


@contextmanager
def stdout_to_stderr() -> Iterator[None]:
    """Inside, whatever Python, a C library or a program it starts prints to stdout comes out on stderr."""
    try:
        sys.stdout.flush()
        kept = os.dup(1)
        os.dup2(2, 1)
    except OSError:  # a closed stream: what Python prints is all there is to catch
        with redirect_stdout(sys.stderr):
            yield
        return
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if os.name == "posix":
            import ctypes

            ctypes.CDLL(None).fflush(None)  # what C holds back would be written later
        os.dup2(kept, 1)
        os.close(kept)
