"""The study of horizons for a terminal: slopes and their scatter against T, and from where on they mislead."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.plot import Series, plot
from gradient_routes.bench.studies.horizon.measure import Horizons

LEGEND = (
    "|dJ/dp|: in natural changes of p; slope: dJ/dp . v at p, v one direction; mean, scatter: of slopes in the interval"
    "\nquotient: (J(S) - J(-S)) / 2 S, the mean of all slopes in it where J is continuous; flips: steps whose contact"
    " differs at its ends\nenergy: growth of the largest after the load over that at its end"
)
SAYS = {
    "noisy": "slopes scatter there: one gradient is a noisy estimate of how J changes",
    "biased": "the mean of slopes misses the change of J there: gradients do not see its jumps, or too few were taken",
}


def show(out: Console, done: Horizons, plotted: bool = True) -> None:
    rows = [row for row in done.rows if row["status"] == "ok"]
    if plotted and rows:
        out.print(curves(rows, out.width))
        out.print()
    first = done.rows[0]
    title = f"{tables.named('problem', first)}: {first['places']} slopes within S = {first['spread']:g} of p"
    out.print(Text(title, style="bold"), soft_wrap=not out.is_terminal)
    tables.show(out, table(done.rows))
    for line in [Text(LEGEND, style="dim"), *map(Text, remarks(done.rows))]:
        out.print(line, soft_wrap=not out.is_terminal)


def curves(rows: list[Row], width: int) -> Text:
    """Each without its sign."""
    T = [row["steps"] for row in rows]
    marks = {"gradient_norm": ("|dJ/dp|", "g"), "slope_scatter": ("scatter", "s"), "quotient": ("quotient", "q")}
    series = [Series(said, T, [abs(row[name]) for row in rows], mark, "") for name, (said, mark) in marks.items()]
    return plot(series, "T, steps", f"{tables.named('problem', rows[0])}: slopes of J", width)


def table(rows: list[Row]) -> Table:
    out = tables.columns("T", "J", "|dJ/dp|", "slope", "mean", "scatter", "quotient", "flips", "energy", ("", None))
    names = ("objective", "gradient_norm", "slope", "slope_mean", "slope_scatter", "quotient")
    for row in rows:
        if row["status"] == "ok":
            flips = "" if row["flips"] is None else str(row["flips"])
            energy = "" if row["energy_growth"] is None else f"{row['energy_growth']:+.1e}"
            out.add_row(str(row["steps"]), *(number(row[name], 3) for name in names), flips, energy, row["verdict"])
        else:
            out.add_row(str(row["steps"]), *[""] * 8, row["status"])
    return out


def remarks(rows: list[Row]) -> list[str]:
    """From which T on slopes mislead, and why marches are missing."""
    lines = []
    for verdict, says in SAYS.items():
        found = [row["steps"] for row in rows if row["verdict"] == verdict]
        if found:
            lines.append(f"{verdict} at T = {', '.join(map(str, found))}: {says}")
    if not lines and any(row["status"] == "ok" for row in rows):
        lines.append("smooth: at every T the gradient says what J does over the interval")
    reasons = {row["reason"]: row for row in rows if row["status"] != "ok"}
    return lines + [f"{row['status']} at T = {row['steps']}: {reason}" for reason, row in reasons.items()]
