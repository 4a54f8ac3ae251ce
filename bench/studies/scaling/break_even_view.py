"""Where one route becomes cheaper than another, fitted and predicted."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import number, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.studies.scaling.measure import Scaling

LEGEND = (
    "break-even: n_p at which fixed + each n_p is the same of both (95 % confidence, Fieller's), below 0: they meet at"
    " no number of parameters; predicted: by declared work at measured prices; not resolved: 0 within the noise"
)


def title(done: Scaling) -> str:
    """Where the race took place."""
    first = done.break_evens[0]
    problem = tables.named("problem", first)
    few = f"1 to {first['m_largest']} of {first['n_param']} parameters"
    return f"break-even on {problem}: {few}, {first['rounds']} interleaved rounds"


def table(found: Sequence[Row]) -> Table:
    """One line a pair."""
    out = tables.columns(("routes", 21), "break-even n_p", "predicted", ("says", 24), gap=2)
    for one in found:
        out.add_row(_pair(one), _fitted(one), number(one["predicted"]) or "none", Text(one["says"]))
    return out


def _pair(one: Row) -> Text:
    return Text.assemble((one["route"], route_style(one["route"])), ", ", (one["other"], route_style(one["other"])))


def _fitted(one: Row) -> str:
    if one["break_even"] is None:
        return "none"
    if one["break_even"] < 0.0:
        return f"below 0 (up to {number(one['break_even_high'])})"
    return f"{one['break_even']:.3g} ({number(one['break_even_low'])} to {number(one['break_even_high'])})"


def lines(found: Sequence[Row]) -> Table:
    """The line of every route: seconds = fixed + each n_p."""
    out = tables.columns(("route", 14), "fixed", "each parameter", gap=2)
    both = [(one["route"], one["fixed_s"], one["each_s"]) for one in found]
    both += [(one["other"], one["other_fixed_s"], one["other_each_s"]) for one in found]
    for route, fixed, each in dict.fromkeys(both):
        slope = "not resolved" if each <= 0.0 else seconds(each)
        out.add_row(Text(route, style=route_style(route)), signed(fixed), slope)
    return out


def signed(value: float) -> str:
    """Seconds of a fitted line, which may be below zero."""
    return f"-{seconds(-value)}" if value < 0.0 else seconds(value)
