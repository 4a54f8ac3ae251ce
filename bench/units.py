"""Durations, sizes and times as text."""

from __future__ import annotations

import datetime


def duration(seconds: float) -> str:
    """Seconds in a unit that gives 1 to 1000: `46.7 us`."""
    for unit, length in (("y", 365.25 * 86400), ("d", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0), ("ms", 1e-3)):
        if seconds >= length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


def size(count: float) -> str:
    """Bytes in a unit that gives 1 to 1000: `2.08 MiB`."""
    for unit in ("B", "KiB", "MiB", "GiB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1024
    return f"{count:.3g} TiB"


def now() -> str:
    """The time in UTC, ISO 8601 with microseconds: cases of a sweep are told apart by it."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="microseconds")
