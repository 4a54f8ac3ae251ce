"""Numbers and options as a person reads them."""

from __future__ import annotations

from gradient_routes.bench.units import duration, size


def number(value: float | None, digits: int = 3) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def ratio(value: float | None) -> str:
    """Three digits, never an exponent."""
    return "" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def seconds(value: float | None) -> str:
    return "" if value is None else duration(value)


def bytes_(value: float | None, resolution: int = 0) -> str:
    """Below what can be resolved there is nothing to tell apart."""
    if value is None:
        return ""
    return size(value) if value >= resolution else f"<{size(resolution)}"
