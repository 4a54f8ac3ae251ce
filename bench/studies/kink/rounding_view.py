"""What a stop's law costs, for a person: errors against exact contact by its width or its stiffness, and the curves."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal.plot import Series, plot
from gradient_routes.bench.render.terminal.tables import columns, show
from gradient_routes.bench.studies.kink.rounding import Trade, Traded, width_of
from gradient_routes.bench.studies.kink.view import WIDEST

EXACTLY = (
    "exact: a stop that does not yield, by a multiplier; the data are the same; dJ/ds by one route, the first exact one"
    " that runs"
)


def show_trade(out: Console, trade: Trade, plots: bool = True) -> None:
    """At s = 1, where the stop is as it was asked for, then where exact contact has its kink; that curve by curve."""
    wrap, route = not out.is_terminal, trade.route.selector
    rounded = width_of(trade.rows[0].stop) is not None
    for s in trade.at:
        rows = [row for row in trade.rows if row.s == s]
        out.print()
        title = f"s = {s:.10g}{', the kink of exact contact' if s == trade.event else ''}; dJ/ds by {route}"
        out.print(Text(title, style="bold"), soft_wrap=wrap)
        show(out, traded(rows, rounded))
        for line in rates(rows) if rounded and s == trade.event else yields(rows) if rounded else []:
            out.print(Text(line), soft_wrap=wrap)
    if rounded and plots:
        out.print()
        out.print(curves(trade, min(out.width, WIDEST)))
    out.print(Text(EXACTLY, style="dim"))
    if rounded and trade.event is None:
        out.print("no kink of exact contact in this range - widen --range to see what the width rounds", soft_wrap=wrap)


def curves(trade: Trade, width: int) -> Text:
    """|u_N - gap| and |d2J/ds2| against the width, at the kink of exact contact or, where there is none, at s = 1."""
    s = trade.at[-1]
    rows = [row for row in trade.rows if row.s == s]
    widths = [width_of(row.stop) for row in rows]
    bends = [None if row.curvature is None else abs(row.curvature) for row in rows]
    tips = [None if row.penetration is None else abs(row.penetration) for row in rows]
    series = [Series("|u_N - gap| [m]", widths, tips, "p"), Series("|d2J/ds2|", widths, bends, "c")]
    return plot(series, "width [m]", f"|u_N - gap| [m] and |d2J/ds2| at s = {s:.6g}", width)


def yields(rows: Sequence[Traded]) -> list[str]:
    """What is left of the error where the width is least."""
    last = rows[-1]
    if last.off_objective is None:
        return []
    return [
        f"what no width removes, {last.off_objective:.2g} in J, is the stop's yielding: k_c = {last.stop.law.k_c:g}"
    ]


def rates(rows: Sequence[Traded]) -> list[str]:
    """Powers of the width, by its least two."""
    (w, J, bend), (w_next, J_next, bend_next) = (
        (width_of(row.stop), row.off_objective, row.curvature) for row in rows[-2:]
    )
    if not (w and w_next and J and J_next and bend and bend_next):
        return []
    error, curvature = (log(after / before) / log(w_next / w) for before, after in ((J, J_next), (bend, bend_next)))
    return [f"|J - J_exact| ~ width^{error:.2f}, paid by d2J/ds2 ~ width^{curvature:.2f}"]


def traded(rows: Sequence[Traded], rounded: bool) -> Table:
    """One row a variant of the stop."""
    names = ("u_N - gap", "J", "|J - J_exact|", "|dJ/ds - exact|", "d2J/ds2", "Newton steps")
    table = columns("width" if rounded else "k_c", *(n for n in names if rounded or n != "d2J/ds2"))
    for one in rows:
        varied = f"{width_of(one.stop) if rounded else one.stop.law.k_c:g}"
        if one.reason is not None:
            table.add_row(varied, "failed")
            continue
        values = (one.penetration, one.objective, one.off_objective, one.off_slope)
        cells = [number(v, d) for v, d in zip(values, (3, 4, 2, 2), strict=True)]
        table.add_row(varied, *cells, *([number(one.curvature, 3)] if rounded else []), str(one.iterations))
    return table
