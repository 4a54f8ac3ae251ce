"""Entry points, of this package and of plug-ins: what is installed is searched once for all groups."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any


def group(name: str) -> EntryPoints:
    """The entry points of a group."""
    found: EntryPoints = _every().select(group=name)
    return found


def is_built_in(point: EntryPoint) -> bool:
    """Read from its module: the metadata of a distribution, which names it, takes longer to parse."""
    return point.module.startswith("gradient_routes.")


@cache
def _every() -> Any:  # SelectableGroups before Python 3.12, EntryPoints since
    return entry_points()
