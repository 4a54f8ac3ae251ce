"""A check in a terminal: the verdict, its lines, its V-curve, its evidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal.plot import Series, plot
from gradient_routes.bench.render.terminal.tables import show
from gradient_routes.bench.verification.contract import Contract
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.locate import Located
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check, Verdict
from gradient_routes.bench.verification.table import HEADINGS, LEGEND, rows

STYLES = {"agrees": "bold green", "wrong-gradient": "bold red", "inconsistent-discretization": "bold red"}
INCONCLUSIVE = "bold yellow"
WIDEST = 100  # columns of a plot
MARKS = {True: "ok", False: "NO", None: "?"}


def show_check(out: Console, check: Check, curves: bool = True) -> None:
    """The verdict first, then what it rests on."""

    def line(text: Text | str, style: str = "") -> None:
        out.print(Text(text, style=style) if isinstance(text, str) else text, soft_wrap=not out.is_terminal)

    def block(table: Table, legend: str = "") -> None:
        out.print()
        show(out, table)
        if legend:
            line(legend, "dim")

    line(Text.assemble((check.name, "bold"), ": ", (check.verdict, STYLES.get(check.verdict, INCONCLUSIVE))))
    line(check.says)
    line(Text.assemble(("next: ", "bold"), check.todo))
    if check.readings:
        block(lines(check), LEGEND)
    if check.located is not None and check.located.worst:
        block(components(check.located, check.verdict))
    if curves and check.deciding is not None:
        out.print()
        out.print(curve(check, check.deciding, min(out.width, WIDEST)))
    if check.findings:
        block(evidence(check.findings))
    if check.readings:
        out.print()
    for remark in (*check.not_done, *check.remarks):
        line(f"note: {remark}", "italic")
    several = "" if check.gradients == 1 else "s"
    line(f"{check.calls} objective calls, {check.gradients} gradient{several}", "dim")


def lines(check: Check) -> Table:
    """One row a line: what its quotients say, in numbers."""
    table = _table(HEADINGS[0], 18)
    for heading in HEADINGS[1:]:
        table.add_column(heading, no_wrap=True, justify="left" if heading in ("result", "slopes") else "right")
    for reading, cells in rows(check):
        table.add_row(*map(Text, cells), style="red" if reading.says == "plateau" else "")
    return table


def components(located: Located, verdict: Verdict) -> Table:
    """Components that are wrong, or only differ, where it is open whose the error is: by gradient and differences."""
    table = _table("component that differs" if verdict == "undetermined" else "wrong component", 15)
    for heading in ("gradient", "differences", "ratio"):
        table.add_column(heading, justify="right", no_wrap=True)
    for w in located.worst:
        table.add_row(Text(w.name), f"{w.given:.6g}", f"{w.found:.6g}", number(w.factor, 4))
    return table


def curve(check: Check, reading: Reading, width: int) -> Text:
    """The V-curve of one line, those of tightened solves, and the error that the noise of J predicts."""
    q, scale = reading.quotients, reading.scale or 1.0
    h = q.h.tolist()
    series = [
        Series("one-sided", h, (np.abs(q.off_forward) / scale).tolist(), "1", "#E69F00"),
        Series("central", h, (np.abs(q.off_central) / scale).tolist(), "2", "#D55E00"),
    ]
    for mark, t in zip("tuv", check.tightened, strict=False):
        other = t.reading.quotients
        errors = (np.abs(other.off) / scale).tolist()
        series.append(Series(f"tightened x {t.factor:g}", other.h.tolist(), errors, mark, "#0072B2"))
    if reading.noise:
        predicted = reading.noise / (np.sqrt(2.0) * q.h) / scale
        shown = np.where(predicted <= 1.0, predicted, np.nan)
        series.append(Series("noise of J over h", h, shown.tolist(), ".", "dim"))
    title = f"relative error of quotients along {reading.name}"
    return Text(f"{title}\n", style="bold") + plot(series, "h", "error", width)


def evidence(findings: Sequence[Finding]) -> Table:
    """One row a test."""
    table = _table("evidence", 20)
    for heading in ("value", "limit"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("", overflow="fold")
    for f in findings:
        value, limit = ("" if f.claim or np.isnan(v) else number(v, 2) for v in (f.value, f.limit))
        style = {True: "", False: "red", None: "dim"}[f.sound]
        said = "; ".join(filter(None, (f.says, None if f.claim else f.culprit)))
        table.add_row(Text(f.name), value, limit, Text(MARKS[f.sound], style=style), Text(said), style=style)
    return table


def show_contract(out: Console, contract: Contract) -> None:
    """All findings on a problem or route, and how many requirements are violated."""
    broken = len(contract.broken)
    said = f"{broken} of {len(contract.findings)} requirements violated" if broken else "keeps the contract"
    out.print(Text.assemble((contract.name, "bold"), ": ", (said, "bold red" if broken else "bold green")))
    out.print()
    show(out, evidence(contract.findings))


def _table(first: str, width: int) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column(first, overflow="fold", min_width=width)
    return table
