"""After a resource limit, larger sizes of the same problem and route are not tried."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import LIMITED
from gradient_routes.bench.units import size

Size = tuple[int, int]  # n_u, n_p
NO_SIZES = ("seed",)  # whole-number options that say nothing of size


@dataclass(frozen=True)
class Hit:
    """A case that met a limit."""

    size: Size
    row: Row


class Pruning:
    """What has met a limit so far."""

    def __init__(self) -> None:
        self._hits: defaultdict[str, list[Hit]] = defaultdict(list)  # by all that is equal but for sizes

    def note(self, problem: ProblemSpec, route: RouteSpec, size: Size | None, row: Row) -> None:
        """Remember a row that met a limit."""
        if row["status"] in LIMITED and size is not None:
            self._hits[alike(problem, route)].append(Hit(size, row))

    def reason(self, problem: ProblemSpec, route: RouteSpec, size: Size | None) -> str | None:
        """Why a case is not tried, or None."""
        if size is None:
            return None
        for hit in self._hits.get(alike(problem, route), ()):
            if size != hit.size and size[0] >= hit.size[0] and size[1] >= hit.size[1]:
                where = f"n_u = {hit.size[0]}, n_p = {hit.size[1]}"
                return f"{route.name}: {hit.row['status']} at {where} already - {todo(hit.row)}"
        return None


def alike(problem: ProblemSpec, route: RouteSpec) -> str:
    """What cases share that differ in sizes only."""
    return repr((problem.name, fixed(problem.options), route.name, route.options))


def fixed(options: dict[str, Any]) -> dict[str, Any]:
    """Options that are no sizes."""
    return {
        name: value
        for name, value in options.items()
        if name in NO_SIZES or isinstance(value, bool) or not isinstance(value, int)
    }


def todo(row: Row) -> str:
    """Which limit to raise."""
    if row["status"] == "timeout":
        return f"give more than --timeout {row['timeout_s']:g}"
    cap = row["memory_cap_bytes"]
    return "take a machine of more memory" if cap is None else f"give more than --memory {size(cap)}"
