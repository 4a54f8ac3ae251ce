"""The one memory meter: peak resident memory of a call above what the process held before it."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Callable
from typing import Any


def peak_of(call: Callable[[], Any]) -> tuple[int, str]:
    """Bytes by which the peak of `call` exceeds the resident set before it, and how that was measured.

    Linux resets the process' peak counter (`clear_refs`). Elsewhere, and where that is forbidden, the peak since
    the start of the process is the best there is: a call that stays below an earlier peak shows 0.
    """
    gc.collect()
    _return_freed_memory()
    if _reset_peak():
        before = _status("VmRSS")
        call()
        return max(0, _status("VmHWM") - before), "VmHWM after reset"
    before = _lifetime_peak()
    call()
    return max(0, _lifetime_peak() - before), "ru_maxrss growth"


def _return_freed_memory() -> None:
    """What glibc keeps of freed memory would be reused unseen."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def _reset_peak() -> bool:
    try:
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")
    except OSError:
        return False
    return True


def _status(field: str) -> int:
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(field + ":"))


def _lifetime_peak() -> int:
    if os.name != "posix":
        return 0
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak  # bytes there, KiB elsewhere
