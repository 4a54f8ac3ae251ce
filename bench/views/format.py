"""Numbers and options as a person reads them."""

from __future__ import annotations

from typing import Any

from bench.bill import duration, size


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


def _exact(value: Any) -> str:
    """As short as it can be read back; other values need other names."""
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def selector(name: str, options: dict[str, Any], defaults: dict[str, Any]) -> str:
    """`name[key=value]` with what differs from the defaults."""
    shown = [f"{key}={_exact(value)}" for key, value in options.items() if value != defaults.get(key)]
    return f"{name}[{','.join(shown)}]" if shown else name
