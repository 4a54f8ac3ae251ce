"""Selectors: `bar[n=8|16,sensors=5]` names a problem (or route) and spans a grid over its options."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from gradient_routes.problems.errors import InputError


@dataclass(frozen=True)
class Selector:
    """A name and, per option, the texts it takes: a grid, their product."""

    name: str
    grid: dict[str, list[str]]

    @property
    def size(self) -> int:
        """Points of the grid."""
        return math.prod(map(len, self.grid.values()))


def bare(selector: str | None) -> str:
    """`bar` of `bar[n=8], at true`."""
    return (selector or "").partition("[")[0].partition(",")[0]


def parse(text: str) -> Selector:
    """Parse `name` or `name[key=value,key=a|b]`; a part without `=` continues the value before it (`sensors=1,3,5`).

    Raises InputError for anything else.
    """
    name, bracket, rest = text.partition("[")
    name = name.strip()
    if not name or (bracket and not rest.endswith("]")) or (not bracket and "]" in name):
        raise InputError(f"selector '{text}' - write NAME or NAME[key=value,key=a|b]")
    grid: dict[str, str] = {}
    key = None
    for part in rest[:-1].split(",") if rest[:-1].strip() else []:
        new, equals, value = part.partition("=")
        if equals:
            key = new.strip()
            if key in grid:
                raise InputError(f"selector '{text}': option '{key}' is given twice - keep one; a|b spans a grid")
            grid[key] = value.strip()
        elif key is None:
            raise InputError(f"selector '{text}': '{part}' has no '=' - write {name}[key=value]")
        else:
            grid[key] += "," + part.strip()
    for key, values in grid.items():
        if not key or "" in values.split("|"):
            raise InputError(f"selector '{text}': empty value or name in '{key}={values}' - write key=value or key=a|b")
    texts = {key: dict.fromkeys(v.strip() for v in values.split("|")) for key, values in grid.items()}
    return Selector(name, {key: [*values] for key, values in texts.items()})


def _exact(value: Any) -> str:
    """As short as it can be read back; other values need other names."""
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def written(name: str, options: dict[str, Any], defaults: dict[str, Any]) -> str:
    """`name[key=value]` with what differs from the defaults; `parse` reads it."""
    shown = [f"{key}={_exact(value)}" for key, value in options.items() if value != defaults.get(key)]
    return f"{name}[{','.join(shown)}]" if shown else name
