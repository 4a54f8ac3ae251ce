"""Memory and steps marched again over the interval k between the states that a march keeps, at the largest T."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import bytes_, number, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.plot import Series, plot
from gradient_routes.bench.studies.scaling.checkpoints import RESOLUTION, at_one_time

LEGEND = (
    "k: states after 0, k, 2 k, .. steps are kept; states: the most at once, by the schedule; their size: counted\n"
    "memory: peak of one call, with all else it needs; again: steps that are marched again; <-: the least over k"
)


def last(rows: Sequence[Row]) -> list[Row]:
    """Those with the most steps at which a least was found, by k, then those without a k."""
    T = max((row["steps"] for row in rows if row["least"]), default=0)
    at_last = [row for row in rows if row["steps"] == T]
    return sorted(at_last, key=lambda row: (row["route"], row["interval"] or math.inf, -row["states_kept"]))


def title(rows: Sequence[Row]) -> str:
    return f"{tables.named('problem', rows[0])}: what checkpoints keep and march again"


def table(rows: Sequence[Row]) -> Table:
    out = tables.columns(("route", 14), "k", "states", "their size", "memory", "again", "time", ("", None))
    for row in rows:
        out.add_row(
            Text(tables.named("route", row), style=route_style(row["route"])),
            number(row["interval"], 9),
            str(row["states_kept"]),
            bytes_(row["state_bytes"]),
            bytes_(row["peak_bytes"], RESOLUTION),
            str(row["recomputed"]),
            seconds(row["seconds"]),
            Text(f"<- {row['least']}" if row["least"] else ""),
        )
    return out


def least(rows: Sequence[Row]) -> Text:
    """Where the least is, for each route, and where it ought to be."""
    return Text("\n".join(_said(group) for group in at_one_time(rows) if any(row["least"] for row in group)))


def _said(group: Sequence[Row]) -> str:
    (found,) = [row for row in group if row["least"]]
    at = f"at k = {found['interval']}, sqrt(T) = {math.sqrt(found['steps']):.3g}"
    if found["least"] == "measured":
        said = f"least memory {bytes_(found['peak_bytes'], RESOLUTION)} {at}"
    else:
        said = f"fewest states {found['states_kept']} {at}; peaks below {bytes_(RESOLUTION)} are not told apart"
    ends = [group[0]["interval"], group[-1]["interval"]]
    return f"{found['route']}: {said}" + (", the end of the k that were measured" if found["interval"] in ends else "")


def curve(rows: Sequence[Row], width: int) -> Text:
    """Peaks as far as they are resolved, and the states that are kept, against k."""
    curves = []
    for group, marks in zip(at_one_time(rows), ("Ms", "Nt", "Ou"), strict=False):
        k, name = [row["interval"] for row in group], group[0]["route"]
        peaks = [None if (row["peak_bytes"] or 0) < RESOLUTION else row["peak_bytes"] for row in group]
        curves.append(Series(f"{name}: memory", k, peaks, marks[0], route_style(name)))
        curves.append(Series("states kept", k, [row["state_bytes"] for row in group], marks[1], "dim"))
    return plot(curves, "k", f"T = {rows[0]['steps']}: memory [byte]", width)
