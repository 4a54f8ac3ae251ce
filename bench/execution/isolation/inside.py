"""Limits that a confined process sets on itself before it starts its job."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path

from gradient_routes.bench.execution.isolation.descendants import adopt
from gradient_routes.bench.execution.isolation.limits import Limits

PR_SET_PDEATHSIG = 1  # of Linux' prctl


def submit_to(limits: Limits, parent: int) -> None:
    """End with the parent, be the first process killed for memory, cap allocations, bind to the processors.

    What the system does not offer is left out: the parent's watch works on every system.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)  # the parent ended before prctl was called
        with suppress(OSError):
            Path("/proc/self/oom_score_adj").write_text("1000")
    adopt()
    if limits.memory is not None and os.name == "posix":
        import resource

        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_DATA, (limits.memory, limits.memory))
    if limits.affinity is not None:
        os.sched_setaffinity(0, limits.affinity)
