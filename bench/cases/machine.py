"""Memory of the machine."""

from __future__ import annotations

import os
from pathlib import Path


def available_bytes() -> int | None:
    """Memory this process may still take: the system's, or its control group's where that is less."""
    amounts = []
    try:
        meminfo = Path("/proc/meminfo").read_text()
        line = next(line for line in meminfo.splitlines() if line.startswith("MemAvailable"))
        amounts.append(1024 * int(line.split()[1]))
    except (OSError, StopIteration):
        pass
    try:
        group = Path("/sys/fs/cgroup")
        limit, used = (group / "memory.max").read_text().strip(), (group / "memory.current").read_text()
        amounts.append(int(limit) - int(used))
    except (OSError, ValueError):  # no such group, or "max"
        pass
    return max(0, min(amounts)) if amounts else None


def total_bytes() -> int | None:
    """Memory of the machine; None where it does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None
