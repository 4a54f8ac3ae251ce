"""Where a process was when it crashed or was killed: the stack that faulthandler writes to its stderr."""

from __future__ import annotations

import faulthandler
import re
import signal
from pathlib import Path

FRAME = re.compile(r'^  File "(.+)", line (\d+) in (.+)$', re.MULTILINE)
BEGINS = re.compile(r"^(Fatal Python error: |Current thread 0x|Thread 0x|Stack \()", re.MULTILINE)
LIBRARIES = re.compile(r"[/\\]lib[/\\]python|site-packages|^<")
ASKED = signal.SIGUSR1 if hasattr(signal, "SIGUSR1") else None  # to write its stack


def told() -> None:
    """Let this process write its stack to stderr when it crashes, and at the signal ASKED."""
    faulthandler.enable()
    if ASKED is not None:
        faulthandler.register(ASKED, all_threads=False)


def where(stderr: str) -> str:
    """` at FILE:LINE, FUNCTION` of the innermost call outside of libraries; empty if no stack was written."""
    begins = BEGINS.search(stderr)
    if begins is None:
        return ""
    frames = [frame for frame in FRAME.findall(stderr[begins.start() :]) if not LIBRARIES.search(frame[0])]
    if not frames:
        return ""
    file, line, function = frames[0]
    return f" at {Path(file).name}:{line}, {function}"


def without(stderr: str) -> str:
    """stderr before the stack."""
    begins = BEGINS.search(stderr)
    return stderr if begins is None else stderr[: begins.start()]
