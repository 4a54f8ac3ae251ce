"""The study of scaling for a terminal: bills by size, laws of growth, the largest sizes, the break-even."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.execution.cost_model import LEGEND, summary
from gradient_routes.bench.render.format import bytes_, cost, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.plot import Series, marks, plot
from gradient_routes.bench.studies.scaling import break_even_view as break_even
from gradient_routes.bench.studies.scaling import checkpoints_view
from gradient_routes.bench.studies.scaling import growth_view as growth
from gradient_routes.bench.studies.scaling.climbing import Series as Routes
from gradient_routes.bench.studies.scaling.growing_error import growing
from gradient_routes.bench.studies.scaling.measure import Scaling, abscissa, abscissas, iterated, value
from gradient_routes.routes.tally import Work

WIDE = 130  # columns from which plots stand side by side
BILLS = f"""\
time: one gradient; cost / forward solve: that time over a forward solve's
memory: peak of one call; tape: stored by AD for its backward sweep
work: {LEGEND}"""


def show(out: Console, done: Scaling, plotted: bool = True) -> None:
    if plotted and any(series.rows for series in done.series):
        out.print(plots(done, out.width))
        out.print()
    _section(out, f"{family(done)}: what a gradient costs", bills(done), BILLS)
    if done.growths:
        _section(out, "how it grows", growth.table(done), growth.legend(done))
    if at_last := checkpoints_view.last(done.checkpoints):
        _section(out, checkpoints_view.title(at_last), checkpoints_view.table(at_last), checkpoints_view.LEGEND)
        out.print(checkpoints_view.least(at_last), soft_wrap=not out.is_terminal)
        if plotted:
            out.print(checkpoints_view.curve(at_last, out.width))
        out.print()
    _section(out, "the largest size under the caps", reached(done))
    for series in done.series:
        for said in growing(done.sizes, series):
            out.print(Text(f"note: {name(series)}: {said}", style="italic"), soft_wrap=not out.is_terminal)
    if done.break_evens:
        _section(out, break_even.title(done), break_even.table(done.break_evens), break_even.LEGEND)
        tables.show(out, break_even.lines(done.break_evens))
    elif done.no_break_even is not None:
        out.print(Text(f"no break-even: {done.no_break_even}", style="dim"), soft_wrap=not out.is_terminal)


def family(done: Scaling) -> str:
    """The selector without what makes the size."""
    return tables.named("problem", {"problem": done.sizes.specs[0].name, "problem_options": done.sizes.family})


def name(series: Routes) -> str:
    """The selector of a route as it was asked for."""
    return tables.named("route", {"route": series.route.route.name, "route_options": series.route.options})


def _section(out: Console, title: str, table: Table, legend: str = "") -> None:
    out.print(Text(title, style="bold"), soft_wrap=not out.is_terminal)
    tables.show(out, table)
    if legend:
        out.print(Text(legend, style="dim"), soft_wrap=not out.is_terminal)
    out.print()


def bills(done: Scaling) -> Table:
    """One line a case under the line of its route."""
    taped = any(row["tape_bytes"] for row in done.rows)
    heads = ["n_u", "n_p", "time", "cost /\nforward\nsolve", "memory", *(["tape"] if taped else [])]
    out = tables.columns(("route\n  size", 10), *heads, ("work", 10))
    for series in done.series:
        out.add_row(Text(name(series), style=route_style(series.route.route.name)))
        for spec, row in series.cases:
            out.add_row(
                f"  {done.sizes.label(spec)}", *_cells(row, taped), style=None if row["status"] == "ok" else "dim"
            )
    return out


def _cells(row: Row, taped: bool) -> Iterator[str]:
    yield from ("" if row[key] is None else str(row[key]) for key in ("n_state", "n_param"))
    yield seconds(row["seconds"]) if row["status"] == "ok" else row["status"]
    yield cost(row)
    yield bytes_(row["peak_bytes"], tables.RESOLUTION)
    if taped:
        yield bytes_(row["tape_bytes"])
    work = row["work"] or row["predicted_work"]
    yield "" if work is None else summary(Work(**work))


def reached(done: Scaling) -> Table:
    """One line a route: the last size it gave a gradient on, and why none beyond."""
    out = tables.columns(("route", 14), "size", "n_u", "n_p", "time", ("stopped by", 24))
    for series in done.series:
        ran = [(spec, row) for spec, row in series.cases if row["status"] == "ok"]
        style = route_style(series.route.route.name)
        cells = ["none", "", "", ""]
        if ran:
            spec, row = ran[-1]
            cells = [done.sizes.label(spec), str(row["n_state"]), str(row["n_param"]), seconds(row["seconds"])]
        out.add_row(Text(name(series), style=style), *cells, Text(series.stopped_by))
    return out


def plots(done: Scaling, width: int) -> RenderableType:
    """Time against size, or against iterations where there is one size; beside it memory, where there is room."""
    by_size = len(done.sizes.specs) > 1
    every = list(done.series) if by_size else list(iterated(done.series))
    against = "iterations"
    if by_size:
        rows = max((series.rows for series in every), key=len)
        against = abscissas(done.sizes, rows)[0]
    time = _curves(every, against, "seconds")
    memory = _curves(every, against, "peak_bytes") if width >= WIDE else []
    title = f"{family(done)}: time [s]"
    label = growth.symbols(done)[against] if against != "iterations" else against
    if all(len(curve.x) < 2 for curve in memory):
        return plot(time, label, title, width)
    each = (width - 4) // 2
    out = Table.grid(padding=(0, 4, 0, 0))
    out.add_row(plot(time, label, title, each), plot(memory, label, "memory [byte]", each))
    return out


def _curves(every: Sequence[Routes], against: str, quantity: str) -> list[Series]:
    """Of those with something to draw; all have the mark they have in the other plot."""
    names = [series.route.route.name for series in every]
    letters = marks([n if names.count(n) == 1 else name(series) for n, series in zip(names, every, strict=True)])
    curves = []
    for series, mark in zip(every, letters, strict=True):
        points = [(abscissa(row, against), value(row, quantity)) for row in series.rows]
        known = [(x, y) for x, y in points if x is not None and y is not None]
        if known:
            x, y = zip(*known, strict=True)
            curves.append(Series(name(series), x, y, mark, route_style(series.route.route.name)))
    return curves
