"""What a confined process does to itself first."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path

from gradient_routes.bench.execution.isolation.limits import Limits

PR_SET_PDEATHSIG = 1  # of Linux' prctl


def submit_to(limits: Limits, parent: int) -> None:
    """Die with the parent, be the first the system kills for memory, allocate within the cap, stay on the processors.

    Where the system knows no such thing it is left out: the watch from outside holds everywhere.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)  # it has died before it could be tied to
        with suppress(OSError):
            Path("/proc/self/oom_score_adj").write_text("1000")
    if limits.memory is not None and os.name == "posix":
        import resource

        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_DATA, (limits.memory, limits.memory))
    if limits.affinity is not None:
        os.sched_setaffinity(0, limits.affinity)
