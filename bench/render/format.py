"""Numbers as text; None is empty."""

from __future__ import annotations

from gradient_routes.bench.units import duration, size


def number(value: float | None, digits: int = 3) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def ratio(value: float | None) -> str:
    """Three digits, without an exponent."""
    return "" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def seconds(value: float | None) -> str:
    return "" if value is None else duration(value)


def bytes_(value: float | None, resolution: int = 0) -> str:
    """A size; below the resolution of its measurement only `<` that."""
    if value is None:
        return ""
    return size(value) if value >= resolution else f"<{size(resolution)}"
