"""An advice in a terminal: bills, the recommended route and why, what would change it."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from gradient_routes.bench.advice.advise import Advice
from gradient_routes.bench.advice.wording import cited, described, said
from gradient_routes.bench.execution.cost_model import LEGEND as WORK
from gradient_routes.bench.execution.cost_model import summary
from gradient_routes.bench.render.format import ratio
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.tables import say
from gradient_routes.bench.render.terminal.text_table import TextTable
from gradient_routes.bench.units import duration, size

HEADINGS = ("route", "error", "time", "cost /\nforward\nsolve", "work", "holds")
NUMBERS = frozenset((1, 2, 3, 5))
LEGEND = f"""\
error: of the gradient, to be expected on a well-scaled problem; cost / forward solve: time over a forward solve's
work: {WORK}
holds: states of a march, tapes with their factors, a Jacobian; not the factors of a forward solve and a few vectors"""


def show(out: Console, advice: Advice) -> None:
    say(out, described(advice.answers), "bold")
    tables.show(out, bills(advice))
    say(out, LEGEND, "dim")
    for bill in advice.ranked:
        if bill.objection is not None:
            name = "" if bill.objection.startswith(bill.route.name) else f"{bill.selector}: "
            say(out, f"not possible: {name}{bill.objection}", "dim")
    out.print()
    if advice.best is None:
        say(out, "no route is possible", "bold red")
    else:
        say(out, f"recommended: {advice.best.selector}", f"bold {route_style(advice.best.route.name)}")
        for reason in advice.reasons:
            say(out, f"- {cited(reason)}")
    if advice.changes:
        out.print()
        tables.show(out, changes(advice))


def bills(advice: Advice) -> TextTable:
    """The routes that are possible, the best first."""
    table = TextTable(HEADINGS, NUMBERS)
    for bill in advice.ranked:
        if bill.objection is None:
            cells = (
                f"{bill.error:.1g}",
                duration(bill.seconds),
                ratio(advice.costs(bill)),
                summary(bill.work),
                size(bill.memory) if bill.memory else "",
            )
            table.row(Text(bill.selector, style=route_style(bill.route.name)), [Text(cell) for cell in cells])
    return table


def changes(advice: Advice) -> TextTable:
    """What would change the answer, and what the route that is best then costs."""
    table = TextTable(("what would change it", "best then", "error", "time"), frozenset((2, 3)))
    for change in advice.changes:
        best = change.best
        cells = (best.selector, f"{best.error:.1g}", duration(best.seconds))
        table.row(Text(said(change)), [Text(cell) for cell in cells])
    return table
