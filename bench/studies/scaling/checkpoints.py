"""What checkpoints of a march keep and march again, and the interval k at which memory is least.

States after 0, k, 2 k, .. steps and those of one interval are kept, T/k + k of them: the fewest at k = sqrt(T).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import measured
from gradient_routes.bench.studies.scaling.power_law import FEWEST
from gradient_routes.bench.studies.scaling.sizes import Sizes
from gradient_routes.routes.backward_march import WHOLE
from gradient_routes.routes.checkpointing import Schedule

RESOLUTION = 2**20  # bytes; pages of allocators and interpreters come and go below
FACTOR = 4  # between the k that are tried where none are asked for


def every_kind(sizes: Sizes) -> list[str]:
    """The routes where none are named: all; along steps the adjoint, k = 4, 16, .. up to the fewest steps."""
    if not sizes.in_time:
        return ["all"]
    T = _fewest(sizes)
    tried = [f"every={k}" for k in (FACTOR**j for j in range(1, T.bit_length())) if k < T]
    return [f"adjoint[checkpoint={'|'.join(['all', *tried, 'sqrt', f'revolve={min(10, T)}', 'none'])}]"]


def check_intervals(sizes: Sizes, routes: Sequence[RouteSpec]) -> None:
    """Raises InputError for k > T, before anything is measured."""
    for route in routes if sizes.in_time else ():
        text = route.options.get("checkpoint")
        if isinstance(text, str) and text != WHOLE:
            Schedule.of(text, _fewest(sizes), f"{route.name} on {sizes.specs[0].name}")


def _fewest(sizes: Sizes) -> int:
    return int(sizes.specs[0].options["steps"])


def recomputed(row: Row) -> int | None:
    """Steps of a gradient beyond those of its forward solves, T each; None where it is no march."""
    work, T = row["work"], row["problem_options"].get("steps")
    return work["steps"] - T * work["forward_solves"] if work and work["steps"] and T else None


def checkpoints(rows: Sequence[Row]) -> list[Row]:
    """A row for every gradient that came from a march with checkpoints; where its memory is least over k, that says so.

    It does where FEWEST different k were measured: by peaks, or by states where peaks are too small to be told apart.
    """
    found = list(_rows(rows))
    for group in at_one_time(found):
        if len({row["interval"] for row in group}) < FEWEST:
            continue
        hidden = sum((row["peak_bytes"] or 0) < RESOLUTION for row in group)
        quantity, by = ("peak_bytes", "measured") if hidden < 2 else ("states_kept", "counted")
        min(group, key=lambda row: int(row[quantity]))["least"] = by
    return found


def _rows(rows: Sequence[Row]) -> Iterator[Row]:
    for row in filter(measured, rows):
        text, T = row["route_options"].get("checkpoint"), row["problem_options"].get("steps")
        if not isinstance(text, str) or text == WHOLE or T is None:
            continue
        schedule = Schedule.of(text, T, row["route"])
        kept = schedule.kept(T)
        names = ("problem", "problem_options", "at", "n_state", "n_param", "route", "route_options")
        yield {name: row[name] for name in (*names, "seconds", "peak_bytes")} | {
            "steps": T,
            "interval": schedule.count if schedule.kind == "every" else None,
            "states_kept": kept,
            "state_bytes": kept * row["n_state"] // T * 8,
            "recomputed": recomputed(row),
            "least": None,
        }


def at_one_time(rows: Sequence[Row]) -> list[list[Row]]:
    """Those with a k, of one route on one problem each, by k."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if row["interval"] is not None:
            others = {name: value for name, value in row["route_options"].items() if name != "checkpoint"}
            groups.setdefault(repr((row["problem_options"], row["at"], row["route"], others)), []).append(row)
    return [sorted(group, key=lambda row: int(row["interval"])) for group in groups.values()]
