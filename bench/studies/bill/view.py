"""The results of `routes run` in a terminal: the table, remarks below it, gradients parameter by parameter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.expected import Expectation, judged
from gradient_routes.bench.cases.outcome import View
from gradient_routes.bench.cases.row import ANSWERED, measured
from gradient_routes.bench.execution.cost_model import LEGEND as WORK
from gradient_routes.bench.execution.cost_model import summary
from gradient_routes.bench.execution.isolation.stack import without
from gradient_routes.bench.render.format import bytes_, cost, number, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.tables import RESOLUTION, ends, left_out, named, say, titled
from gradient_routes.bench.render.terminal.text_table import TextTable
from gradient_routes.problems.problem import Array
from gradient_routes.routes.tally import Work

HEADINGS = ("problem\n  route", "J", "error\n(esti-\nmate)", "time", "cost /\nforward\nsolve", "work", "memory", "tape")
NUMBERS = frozenset((1, 2, 3, 4, 6, 7))
LEGEND = f"""\
n_u unknowns, n_p parameters; error: |g - g_ref| / |g_ref|
(estimate): the error that the solves leave, told without a reference by a corrected gradient
time: one gradient{{}}; cost / forward solve: that time over a forward solve's
work: {WORK}
memory: peak of one call; tape: stored by AD for its backward sweep"""
UNSTABLE = ", ~: unstable"
FELT = "*"
SOLVED = 1e-9  # relative residual of a state that is the solution
OUTPUT_TELLS = ("crashed", "timeout", "out-of-memory")  # statuses of no exception: the end of stderr may say why


def show(
    rows: Sequence[Row],
    views: Iterable[tuple[Row, View]] = (),
    kept: Path | None = None,
    known: Sequence[Expectation] = (),
) -> None:
    """Print the table, remarks, expected failures and gradients."""
    if not rows:
        return
    out = tables.console()
    tables.show(out, results(rows))
    for line, style in remarks(rows):
        say(out, line, style)
    for row in rows:
        verdict = judged(row, known)
        if verdict is not None:
            say(out, f"{titled(row)}: {row['route']}: {verdict.says}", "yellow")
    if kept is not None:
        say(out, f"kept in {kept}", "dim")
    for row, view in views:
        out.print()
        say(out, f"{titled(row)} by {named('route', row)}", "bold")
        tables.show(out, gradient(row, view))
        if _felt(row, view).any():
            residual = number(row["residual"], 2)
            say(out, f"{FELT} blind for the solution, not for this iterate: |R| / |R_0| = {residual}", "dim")


def results(rows: Sequence[Row]) -> TextTable:
    """One row a case under the title of its problem."""
    table = TextTable(HEADINGS, NUMBERS)
    before = None
    groups = _by_problem(rows)
    for row in rows:
        problem = titled(row)
        if problem != before:
            table.title(_title(problem, groups[problem]))
            before = problem
        style = "" if row["status"] == "ok" else "dim" if row["status"] in ANSWERED else "bold red"
        label = Text(named("route", row), style=style or route_style(row["route"]))
        table.row(label, [Text(cell, style=style) for cell in _cells(row)])
    return table


def _by_problem(rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(titled(row), []).append(row)
    return groups


def _title(problem: str, rows: Sequence[Row]) -> str:
    """The problem, its size, and what most errors are measured against."""
    sizes = {"n_u": "n_state", "n_p": "n_param"}
    known = {
        name: next((row[column] for row in rows if row[column] is not None), None) for name, column in sizes.items()
    }
    said = [f"{name} = {size}" for name, size in known.items() if size is not None]
    reference = _usual_reference(rows)
    said += [] if reference is None else [f"error against {reference}"]
    return f"{problem}: {', '.join(said)}" if said else problem


def _usual_reference(rows: Sequence[Row]) -> str | None:
    counts = Counter(row["reference"] for row in rows if row["reference"])
    return counts.most_common(1)[0][0] if counts else None


def _cells(row: Row) -> list[str]:
    if not measured(row):
        return ["", row["status"], "", "", _work(row["predicted_work"]), "", ""]
    per_iteration = row["tape_bytes_per_iteration"]
    return [
        number(row["objective"], 4),
        _error(row),
        ("~" if row["unstable"] else "") + seconds(row["seconds"]) if row["status"] == "ok" else row["status"],
        cost(row),
        _work(row["work"]),
        bytes_(row["peak_bytes"], RESOLUTION),
        bytes_(row["tape_bytes"]) + ("" if per_iteration is None else f" ({bytes_(per_iteration)}/it)"),
    ]


def _error(row: Row) -> str:
    estimate = number(row["gradient_error_estimate"], 1)
    return (number(row["gradient_error"], 2) or "unknown") + (f" ({estimate})" if estimate else "")


def _work(work: dict[str, int] | None) -> str:
    return "" if work is None else summary(Work(**work))


def remarks(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """Lines and their styles: the legend, other references, reasons of skipped and failed cases, notes, each once."""
    legend = LEGEND.format(UNSTABLE if any(row["unstable"] for row in rows) else "")
    return [(legend, "dim"), *dict.fromkeys([*_references(rows), *_reasons(rows), *_notes(rows)])]


def _references(rows: Sequence[Row]) -> Iterator[tuple[str, str]]:
    """Errors measured against another reference than the title says."""
    for problem, group in _by_problem(rows).items():
        usual = _usual_reference(group)
        for row in group:
            if row["reference"] not in (usual, None):
                yield f"{problem}: {named('route', row)}: error against {row['reference']}", "dim"


def _reasons(rows: Sequence[Row]) -> Iterator[tuple[str, str]]:
    several = len({named("problem", row) for row in rows}) > 1
    for row in rows:
        if row["status"] != "ok":
            where = f"{named('problem', row)}: " if several else ""
            route = "" if row["reason"].startswith(row["route"]) else f"{row['route']}: "
            line = f"{row['status']}: {where}{route}{row['reason']}"
            yield line, "dim" if row["status"] in ANSWERED else "red"
            said = without(row["stderr"] or "").splitlines()[-3:]
            if row["status"] in OUTPUT_TELLS and said:
                yield "\n".join(f"  | {each}" for each in said), "dim"


def _notes(rows: Sequence[Row]) -> Iterator[tuple[str, str]]:
    for row in rows:
        for note in filter(None, (row["note"] or "").split("; ")):
            yield f"note: {named('problem', row)}: {note}", "italic"


def _felt(row: Row, view: View) -> Array:
    """Blind parameters (n_p,) on which J of an iterate that is not the solution depends all the same."""
    blind = view.columns.blind
    if blind is None or row["residual"] is None or row["residual"] <= SOLVED:
        return np.zeros(len(view.gradient), dtype=bool)
    return np.asarray(blind & (view.gradient != (0.0 if view.reference is None else view.reference.gradient)))


def gradient(row: Row, view: View) -> TextTable:
    """A row per parameter: the route's gradient beside the reference and the columns of the problem."""
    columns = {"dJ/dp": view.gradient}
    columns |= {} if view.reference is None else {view.reference.name: view.reference.gradient}
    columns |= view.columns.columns
    blind, felt = view.columns.blind, _felt(row, view)
    marks = [] if blind is None else [""]
    units = set(view.units)
    unit = f" [{units.pop()}]" if len(units) == 1 else None  # of all: said once
    table = TextTable([f"p{unit or ''}", *columns, *marks], frozenset(range(1, 1 + len(columns))))
    n = len(view.labels)
    for i in ends(n):
        if i is None:
            table.row(Text(left_out(n), style="dim"), [Text("")] * (len(columns) + len(marks)))
            continue
        hidden = blind is not None and bool(blind[i])
        style = "dim" if hidden else ""
        cells = [Text(f"{values[i]:.6g}", style=style) for values in columns.values()]
        cells[0].style = style or route_style(row["route"])
        mark = f"{view.columns.mark}{FELT if felt[i] else ''}"
        cells += [Text(mark if hidden else "", style=style) for _ in marks]
        label = view.labels[i] if unit else f"{view.labels[i]} [{view.units[i]}]"
        table.row(Text(label, style=style), cells)
    return table
