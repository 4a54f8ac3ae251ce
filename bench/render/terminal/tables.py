"""What tables in a terminal share: the console, printing at its width, and names of cases."""

from __future__ import annotations

import os
import sys

from rich.console import Console, ConsoleOptions
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.case import selector_of
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.point_values import shown
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.render.terminal.terminal import Terminal
from gradient_routes.bench.render.terminal.text_table import TextTable

PIPED_WIDTH = 160  # columns where there is no terminal to ask
DEFAULTS = vars(Settings().solver)
RESOLUTION = 2**20  # bytes; smaller peaks are noise of allocators and the interpreter
LONGEST = 64  # lines; of longer lists the first and the last are shown
MOST = 1000  # rows of a table of cases


def console(stderr: bool = False) -> Console:
    """A console as wide as the terminal or, in a pipe, as PIPED_WIDTH; COLUMNS sets both."""
    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() or "COLUMNS" in os.environ else PIPED_WIDTH
    # the stream of this moment, whatever sys.stdout becomes; selectors contain brackets, which are not markup
    return Terminal(file=stream, width=width, highlight=False, emoji=False, markup=False)


def say(out: Console, text: str, style: str = "") -> None:
    """Print a line, wrapped between words in a terminal and whole in a pipe."""
    out.print(Text(text, style=style), soft_wrap=not out.is_terminal)


def columns(*heads: str | tuple[str, int | None], gap: int = 1) -> Table:
    """An empty table. A name is a column of numbers, (name, width) one of text that folds down to that width, (name,
    None) one of text that does not fold.
    """
    table = Table(box=None, pad_edge=False, padding=(0, gap, 0, 0), header_style="bold")
    for head in heads:
        if isinstance(head, str):
            table.add_column(head, justify="right", no_wrap=True)
        else:
            name, least = head
            table.add_column(name, overflow="fold", min_width=least, no_wrap=least is None)
    return table


def show(out: Console, table: Table | TextTable) -> None:
    """Print a table at the console's width, folding cells where there is not enough; at worst lines wrap."""
    if isinstance(table, TextTable):
        for line in table.lines(out.width):
            out.print(line, soft_wrap=True)
        return
    unlimited = out.options.update(width=10_000)
    _narrow(table, Measurement.get(out, unlimited, table).maximum - out.width, unlimited, out)
    width = out.width
    out.width = max(width, Measurement.get(out, unlimited, table).maximum)
    out.print(table)
    out.width = width


def _narrow(table: Table, excess: int, unlimited: ConsoleOptions, out: Console) -> None:
    """Take `excess` from the widths of columns with a min_width, the widest first."""
    foldable = [column for column in table.columns if column.min_width is not None]
    cells = [[column.header, *column.cells] for column in foldable]
    widths = [max(Measurement.get(out, unlimited, cell).maximum for cell in column) for column in cells]
    least = [column.min_width or 0 for column in foldable]
    while excess > 0 and any(w > least[i] for i, w in enumerate(widths)):
        widest = max((i for i, w in enumerate(widths) if w > least[i]), key=lambda i: widths[i])
        widths[widest] -= 1
        excess -= 1
        foldable[widest].width = widths[widest]


def named(kind: registry.Kind, row: Row) -> str:
    """The selector of a row's problem or route, without its defaults."""
    return selector_of(kind, row[kind], row[f"{kind}_options"], row.get(f"{kind}_declared"))


def titled(row: Row) -> str:
    """The problem, and which part of its gradient."""
    return named("problem", row) + (f", {row['partial']}" if row["partial"] else "")


def asked(row: Row) -> str:
    """The problem, and the settings of its run that differ from the defaults."""
    settings = row["settings"] or {}
    unusual = [f"{name}={settings[name]}" for name, usual in DEFAULTS.items() if settings.get(name, usual) != usual]
    unusual += [] if row["at"] == "start" else [f"at {shown(row['at'])}"]
    unusual += [] if settings.get("timed", True) else ["not timed"]
    unusual += [] if settings.get("threads", 1) == 1 else [f"{settings['threads']} threads"]
    return ", ".join([titled(row), *unusual])


def ends(n: int, most: int = LONGEST) -> list[int | None]:
    """Indices of the lines to show of n, None where some are left out."""
    half = most // 2
    return [*range(n)] if n <= most else [*range(half), None, *range(n - half, n)]


def left_out(n: int, most: int = LONGEST) -> str:
    """What stands in place of the lines left out."""
    return f"... {n - most} more"
