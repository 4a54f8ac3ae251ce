"""A number of a table as a person reads it, with its unit where that is time or memory."""

from __future__ import annotations

import json
from typing import Any

from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.render.format import bytes_, number, seconds


def shown(column: Column, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, int | float) and column.unit in UNITS:
        return UNITS[column.unit](value)
    if isinstance(value, float):
        return number(value, 4)
    return value if isinstance(value, str) else str(value) if type(value) is int else json.dumps(value)


UNITS = {"s": seconds, "byte": bytes_}


def heading(column: Column) -> str:
    """Name and unit."""
    return column.name if column.unit in ("", "1") else f"{column.name} [{column.unit}]"
