"""Results as tables for a terminal."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.options import options_of
from gradient_routes.bench.cases.outcome import View
from gradient_routes.bench.cases.row import ANSWERED
from gradient_routes.bench.cases.selector import written
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.cost_model import LEGEND, summary
from gradient_routes.bench.execution.isolation.stack import without
from gradient_routes.bench.render.format import bytes_, number, ratio, seconds
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.terminal import Terminal
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.tally import Work

PIPED_WIDTH = 160  # columns where there is no terminal to ask
RESOLUTION = 2**20  # bytes; pages of allocators and interpreters come and go below
LAST_WORDS = ("crashed", "timeout", "out-of-memory")  # no exception tells what it was: its stderr may
MANY = 64  # parameters; longer views show both ends


def console(stderr: bool = False) -> Console:
    """A console as wide as the terminal; wide where the output is piped, so that nothing is cut."""
    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() else PIPED_WIDTH
    # the stream of now, whatever becomes of sys.stdout; selectors have brackets that are no markup
    return Terminal(file=stream, width=width, highlight=False, emoji=False, markup=False)


def show(out: Console, table: Table) -> None:
    """Print a table whole: too wide for the terminal, it folds where columns allow it; at worst lines wrap."""
    unlimited = out.options.update(width=10_000)
    if Measurement.get(out, unlimited, table).maximum > out.width:
        for column in table.columns:
            column.width = column.min_width  # where there is none, the column stays as wide as its cells
    width = out.width
    out.width = max(width, Measurement.get(out, unlimited, table).maximum)
    out.print(table)
    out.width = width


def results(rows: Sequence[Row]) -> Table:
    """One line a case under the line of its problem: the bill, and how wrong the gradient is."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    several = len(references(rows)) > 1
    table.add_column("problem\n  route", overflow="fold", min_width=14)
    for name in ("n_u", "n_p", "J", "error", "time", "x fwd"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("work", overflow="fold", min_width=7)
    unrolled = any(row["tape_bytes_per_iteration"] for row in rows)
    table.add_column("memory", justify="right", min_width=6)
    table.add_column("tape", justify="right", min_width=len("(0.977 KiB/it)") if unrolled else 6, overflow="fold")
    if several:
        table.add_column("error against", overflow="fold", min_width=7)
    before = None
    for row in rows:
        problem = titled(row)
        if problem != before:
            table.add_row(Text(problem, style="bold"))
            before = problem
        cells = _cells(row) + ([Text(row["reference"] or "")] if several else [])
        table.add_row(Text("  " + named("route", row), style=_style(row) or route_style(row["route"])), *cells)
    return table


def references(rows: Sequence[Row]) -> list[str]:
    """What the errors were measured against, each once."""
    return list(dict.fromkeys(row["reference"] for row in rows if row["reference"]))


def _style(row: Row) -> str:
    return {"ok": "", "skipped": "dim", "pruned": "dim"}.get(row["status"], "bold red")


def _cells(row: Row) -> list[Text]:
    cells = [str(row["n_state"]), str(row["n_param"])]
    if row["status"] == "ok":
        cells += [
            number(row["objective"], 4),
            number(row["gradient_error"], 2) or "unknown",
            ("~" if row["unstable"] else "") + seconds(row["seconds"]),
            ratio(row["forward_ratio"]),
            _work(row, "work"),
            bytes_(row["peak_bytes"], RESOLUTION),
            _tape(row),
        ]
    else:
        cells += [row["status"], "", "", "", _work(row, "predicted_work"), "", ""]
    return [Text(cell, style=_style(row)) for cell in cells]


def _tape(row: Row) -> str:
    each = row["tape_bytes_per_iteration"]
    return bytes_(row["tape_bytes"]) + ("" if each is None else f" ({bytes_(each)}/it)")


def _work(row: Row, which: str) -> str:
    return "" if row[which] is None else summary(Work(**row[which]))


def named(kind: registry.Kind, row: Row) -> str:
    """The selector of a row's problem or route, without its defaults."""
    name, options = row[kind], row[f"{kind}_options"]
    try:
        factory = registry.factory_of(registry.find(kind, name).load())
    except InputError:  # a stored row of a plug-in that is gone
        return written(name, options, {})
    return written(name, options, {n: o.default for n, o in options_of(factory).items()})


def titled(row: Row) -> str:
    """The problem, and which part of its gradient."""
    return named("problem", row) + (f", {row['partial']}" if row["partial"] else "")


def remarks(rows: Sequence[Row]) -> list[Text]:
    """A legend, reasons of skipped and failed cases, then notes, each once."""
    judges = references(rows)
    against = f" against the {judges[0]}" if len(judges) == 1 else ""
    unstable = ", ~: unstable" if any(row["unstable"] for row in rows) else ""
    legend = (
        f"n_u unknowns, n_p parameters; error: |g - g_ref| / |g_ref|{against}; time: one gradient, x fwd: in forward"
        f" solves{unstable}\nwork: {LEGEND}; memory: peak of one call; tape: kept by AD for its backward sweep"
    )
    lines = {"": Text(legend, style="dim")}
    problems = {id(row): named("problem", row) for row in rows}
    several = len(set(problems.values())) > 1
    for row in rows:
        if row["status"] != "ok":
            where = f"{problems[id(row)]}: " if several else ""
            route = "" if row["reason"].startswith(row["route"]) else f"{row['route']}: "
            line = f"{row['status']}: {where}{route}{row['reason']}"
            lines.setdefault(line, Text(line, style="dim" if row["status"] in ANSWERED else "red"))
            said = without(row["stderr"] or "").splitlines()[-3:]
            if row["status"] in LAST_WORDS and said:
                last = "\n".join(f"  | {each}" for each in said)
                lines.setdefault(f"{line}\n{last}", Text(last, style="dim"))
    for row in rows:
        for note in filter(None, (row["note"] or "").split("; ")):
            line = f"note: {problems[id(row)]}: {note}"
            lines.setdefault(line, Text(line, style="italic"))
    return list(lines.values())


def gradient(row: Row, view: View) -> Table:
    """Parameter by parameter: the route's gradient beside the reference and what the problem adds."""
    title = f"{titled(row)} by {named('route', row)}"
    table = Table(box=None, pad_edge=False, title=Text(title), title_justify="left", title_style="bold")
    reference = view.reference
    table.add_column("p", no_wrap=True)
    table.add_column("dJ/dp", justify="right", style=route_style(row["route"]))
    if reference is not None:
        table.add_column(Text(reference.name), justify="right")
    for name in view.columns.columns:
        table.add_column(Text(name), justify="right", overflow="fold")
    blind = view.columns.blind
    if blind is not None:
        table.add_column("")
    n = len(view.labels)
    shown: list[int | None] = [*range(n)] if n <= MANY else [*range(MANY // 2), None, *range(n - MANY // 2, n)]
    for i in shown:
        if i is None:
            table.add_row(f"... {n - MANY} more", style="dim")
            continue
        values: list[Any] = [view.gradient[i]]
        values += [] if reference is None else [reference.gradient[i]]
        values += [column[i] for column in view.columns.columns.values()]
        mark = [] if blind is None else [view.columns.mark if blind[i] else ""]
        hidden = blind is not None and blind[i]
        label = Text(f"{view.labels[i]} [{view.units[i]}]")
        table.add_row(label, *(f"{v:.6g}" for v in values), *mark, style="dim" if hidden else None)
    return table


DEFAULTS = vars(Settings().solver)


def asked(row: Row) -> str:
    """The problem, and settings of its run that are not the usual ones."""
    settings = row["settings"] or {}
    unusual = [f"{name}={settings[name]}" for name, usual in DEFAULTS.items() if settings.get(name, usual) != usual]
    unusual += [] if row["at"] == "start" else [f"at {row['at']}"]
    unusual += [] if settings.get("timed", True) else ["not timed"]
    unusual += [] if settings.get("threads", 1) == 1 else [f"{settings['threads']} threads"]
    return ", ".join([titled(row), *unusual])
