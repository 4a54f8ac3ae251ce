"""What inconsistent gradients cost, for a terminal: a line a gradient, and where each line search has stalled."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases import selector
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.plot import Series, plot
from gradient_routes.bench.studies.consistency.measure import Consistency

WIDEST = 100  # columns of a plot
LEGEND = (
    "error: of the gradient at the start and at the end; evals: of J and its gradient; J_min: the least J of all"
    " runs, one to 1e-12 included; |dJ/dp|: of the true gradient at the end, relative to the start; shortest: step"
    " that a stalled line search tried, in natural changes of p"
)


def show(out: Console, found: Consistency, plots: bool = True) -> None:
    ran = [row for row in found.runs if row["status"] == "ok"]
    if plots and ran:
        out.print(plot(curves(found), "iteration", "J - J_min", min(out.width, WIDEST)))
        out.print()
    out.print(Text(found.problem, style="bold"), soft_wrap=True)
    if ran:
        tables.show(out, table(ran))
        tables.say(out, LEGEND, "dim")
    for line in map(remark, found.runs):
        if line:
            tables.say(out, line)


def named(route: str) -> str:
    """The fault of a faulty route, the selector of others."""
    return ", ".join(selector.parse(route).grid.get("fault", [route]))


def curves(found: Consistency) -> list[Series]:
    """J - J_min over the steps of every run; the minimum itself has none."""
    drawn, marks = [], iter("DOQSM" + "abcdefghijkl")
    for row in found.runs:
        steps = [s for s in found.steps if s["route"] == row["route"] and s["above_minimum"] > 0.0]
        if steps:
            x, y = ([step[name] for step in steps] for name in ("iteration", "above_minimum"))
            drawn.append(Series(named(row["route"]), x, y, next(marks, "*"), route_style(row["route"])))
    return drawn


def table(runs: list[Row]) -> Table:
    out = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    out.add_column("gradient", overflow="fold", min_width=13)
    for name in ("error", "at end", "steps", "evals", "J - J_min", "|dJ/dp|", "shortest"):
        out.add_column(name, justify="right", no_wrap=True)
    out.add_column("")
    for row in runs:
        numbers = [number(row[name], 2) or "0" for name in ("error_start", "error_end")]
        left = row["gradient_norm"] / (row["gradient_norm_start"] or 1.0)
        out.add_row(
            Text(named(row["route"])),
            *numbers,
            str(row["iterations"]),
            str(row["evaluations"]),
            number(row["above_minimum"], 3),
            number(left, 2),
            number(row["shortest_step"], 2) or "",
            row["outcome"],
            style=route_style(row["route"]),
        )
    return out


def remark(row: Row) -> str:
    """Where it has stalled, or why it was not run."""
    if row["status"] != "ok":
        return f"{row['status']}: {row['route']}: {row['reason']}"
    if row["outcome"] != "stalled":
        return ""
    return (
        f"{named(row['route'])} stalls after {row['iterations']} steps and {row['evaluations']} evaluations at"
        f" J = {number(row['objective'], 5)}, {number(row['above_minimum'], 2)} above the minimum, where"
        f" |dJ/dp| = {number(row['gradient_norm'], 2)}, with steps down to {number(row['shortest_step'], 2)}"
    )
