"""`routes report`: what the store holds, in the terminal, as a page, as Markdown, as figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import complain, debug_option, replaces, store_option
from gradient_routes.bench.commands.filter_options import filter_options
from gradient_routes.bench.sanitize import echo

if TYPE_CHECKING:
    from gradient_routes.bench.store.filter import Filter
    from gradient_routes.bench.store.store import Store

OUTPUT = f"File to write; its name says the format: report.html, report.md. {replaces('.html', '.md')}"
FORMAT = "[that of FILE's name, else html]"
FIGURES = f"Folder for every figure; needs gradient-routes[pictures]. {replaces('.png', '.svg', '.pdf')}"
MORE = "routes report -o report.html: figures, curves and all studies, as one page"


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help=OUTPUT)
@click.option("--format", type=click.Choice(["html", "md"]), help=FORMAT)
@click.option("--figures", type=click.Path(path_type=Path), metavar="DIR", help=FIGURES)
@filter_options
@store_option
@debug_option
def report(output: Path | None, format: str | None, figures: Path | None, where: Filter, store: Path) -> None:
    """Everything the store holds, or some rows: the bill, curves and verdicts, studies, failures.

    Problems are shown in the order in which they were first run, routes in the order of `routes list`.

    \b
    routes report                                     tables in the terminal
    routes report -o report.html                      one page that needs no server and no network
    routes report --format md -o report.md --figures figures
    """
    from gradient_routes.bench.store.store import Store

    kept = Store(store)
    if output is None and format is None and figures is None:
        _print(kept, where)
        return
    from gradient_routes.bench.render.writing import report as write

    if output is not None and format is None:
        format = "md" if output.suffix.lower() in (".md", ".markdown") else "html"
    printed = format is not None and output in (None, Path("-"))
    for line in write(kept, output, format, figures, where):
        echo(line, err=printed)


def _print(store: Store, where: Filter) -> None:
    from gradient_routes.bench.cases.declared import undeclared
    from gradient_routes.bench.cases.order import in_order
    from gradient_routes.bench.render.source import LIGHT, thinned
    from gradient_routes.bench.render.terminal.tables import MOST, console
    from gradient_routes.bench.store.cases import cases, numbered
    from gradient_routes.bench.studies.bill.view import show

    count = store.count()
    if count <= MOST or not where.empty:
        rows = [row for row in store.rows() if where.keeps(row)]
        count, rows = len(rows), rows[:MOST]
    else:
        rows = [*numbered(store, thinned([*cases(store, LIGHT, parse=False)], MOST))]
    show(in_order(rows, lambda row: row))
    if not rows and not where.empty:
        complain("report: no case is as asked - name problems and routes without options; see routes status")
    if count > len(rows):
        which = "those of evenly spaced problems" if where.empty else "the first"
        said = f"{len(rows)} of {count} rows are shown, {which}; `routes export` writes all"
        console().print(said, style="dim", soft_wrap=True)
    if note := undeclared(rows):
        console().print(note, style="dim", soft_wrap=True)
    console().print(MORE, style="dim", soft_wrap=True)
