"""Numbers as text; None is empty."""

from __future__ import annotations

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.units import duration, size

UNRESOLVED = "unresolved"  # a cost that came out below what the counted work contains


def number(value: float | None, digits: int = 3) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def ratio(value: float | None) -> str:
    """Three digits, without an exponent."""
    return "" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def cost(row: Row) -> str:
    """The time of a case in forward solves, where it was timed."""
    return UNRESOLVED if row["forward_ratio"] is None and row["seconds"] is not None else ratio(row["forward_ratio"])


def seconds(value: float | None) -> str:
    return "" if value is None else duration(value)


def bytes_(value: float | None, resolution: int = 0) -> str:
    """A size; below the resolution of its measurement only `<` that."""
    if value is None:
        return ""
    return size(value) if value >= resolution else f"<{size(resolution)}"
