"""A check for a person: the verdict, its curves, its evidence."""

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
from gradient_routes.bench.verification.lines import HEADINGS, LEGEND, rows
from gradient_routes.bench.verification.locate import Located
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check

STYLES = {
    "agrees": "bold green",
    "wrong-gradient": "bold red",
    "inconsistent-discretization": "bold red",
}
INCONCLUSIVE = "bold yellow"
WIDEST = 100  # columns of a plot
MARKS = {True: "ok", False: "NO", None: "?"}


def show_check(out: Console, check: Check, curves: bool = True) -> None:
    """The sentence first; then what it rests on."""
    style = STYLES.get(check.verdict, INCONCLUSIVE)
    wrap = not out.is_terminal
    out.print(Text.assemble((check.name, "bold"), ": ", (check.verdict, style)), soft_wrap=wrap)
    out.print(Text(check.says), soft_wrap=wrap)
    out.print(Text.assemble(("next: ", "bold"), check.todo), soft_wrap=wrap)
    if check.readings:
        out.print()
        show(out, lines(check))
        out.print(Text(LEGEND, style="dim"), soft_wrap=wrap)
    if check.located is not None and check.located.worst:
        out.print()
        show(out, components(check.located))
    if curves and check.deciding is not None:
        out.print()
        out.print(curve(check, check.deciding, min(out.width, WIDEST)))
    if check.findings:
        out.print()
        show(out, evidence(check.findings))
    if check.readings:
        out.print()
    for remark in (*check.not_done, *check.remarks):
        out.print(Text(f"note: {remark}", style="italic"), soft_wrap=wrap)
    several = "" if check.gradients == 1 else "s"
    out.print(Text(f"{check.calls} objective calls, {check.gradients} gradient{several}", style="dim"), soft_wrap=wrap)


def lines(check: Check) -> Table:
    """One row a line: what its quotients say, in numbers."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column(HEADINGS[0], overflow="fold", min_width=18)
    for heading in HEADINGS[1:]:
        table.add_column(heading, no_wrap=True, justify="left" if heading in ("says", "slopes") else "right")
    for reading, cells in rows(check):
        style = "red" if reading.says == "plateau" else ""
        table.add_row(*(Text(cell) for cell in cells), style=style)
    return table


def components(located: Located) -> Table:
    """Wrong components: what the gradient says and what differences say."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column("wrong component", overflow="fold", min_width=15)
    for heading in ("gradient", "differences", "ratio"):
        table.add_column(heading, justify="right", no_wrap=True)
    for w in located.worst:
        table.add_row(Text(w.name), f"{w.given:.6g}", f"{w.found:.6g}", number(w.factor, 4))
    return table


def curve(check: Check, reading: Reading, width: int) -> Text:
    """The V-curve of one line, tightened ones beside it, and the noise that J itself predicts."""
    made, scale = reading.sweep, reading.scale or 1.0
    h = made.h.tolist()
    series = [
        Series("one-sided", h, (np.abs(made.off_forward) / scale).tolist(), "1", "#E69F00"),
        Series("central", h, (np.abs(made.off_central) / scale).tolist(), "2", "#D55E00"),
    ]
    for k, t in enumerate(check.tightened):
        other = t.reading.sweep
        errors = (np.abs(other.off_central if other.two_sided else other.off_forward) / scale).tolist()
        series.append(Series(f"tightened x {t.factor:g}", other.h.tolist(), errors, "tuv"[k], "#0072B2"))
    if reading.noise:
        predicted = reading.noise / (np.sqrt(2.0) * made.h) / scale
        shown = np.where(predicted <= 1.0, predicted, np.nan)
        series.append(Series("noise of J over h", h, shown.tolist(), ".", "dim"))
    title = f"error of quotients along {made.line.name}, relative"
    return Text(f"{title}\n", style="bold") + plot(series, "h", "error", width)


def evidence(findings: Sequence[Finding]) -> Table:
    """Evidence test by test."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column("evidence", overflow="fold", min_width=20)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("limit", justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("", overflow="fold")
    for f in findings:
        value, limit = ("", "") if f.claim else ("" if np.isnan(f.value) else number(f.value, 2), number(f.limit, 2))
        style = {True: "", False: "red", None: "dim"}[f.sound]
        said = "; ".join(filter(None, (f.says, None if f.claim else f.culprit)))
        table.add_row(Text(f.name), value, limit, Text(MARKS[f.sound], style=style), Text(said), style=style)
    return table


def show_contract(out: Console, contract: Contract) -> None:
    """All findings on a problem or route, and how many promises are broken."""
    broken = len(contract.broken)
    said = f"{broken} of {len(contract.findings)} promises broken" if broken else "keeps the contract"
    out.print(Text.assemble((contract.name, "bold"), ": ", (said, "bold red" if broken else "bold green")))
    out.print()
    show(out, evidence(contract.findings))
