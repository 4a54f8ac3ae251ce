"""`routes status`: the status of every case of a store."""

from __future__ import annotations

from pathlib import Path

import click

from gradient_routes.bench.command_options import debug_option, store_option
from gradient_routes.bench.sanitize import echo


@click.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object per case: its row and its state.")
@store_option
@debug_option
def status(as_json: bool, store: Path) -> None:
    """Show the status of every case, problems by routes.

    \b
    ok                            measured
    skipped                       not possible by this route, or above --budget
    pruned                        not run: a smaller size met a limit
    timeout, out-of-memory        met a limit
    not-converged, non-finite,
    failed, crashed               failed; `routes run` and `report` give reasons
    -                             not run
    (stale)                       code, data or libraries have changed since
    (gone)                        its problem or route no longer exists
    (unchecked)                   of an older version, which did not keep where
                                  the code of FILE.py:NAME is

    Code that a store names is looked at, not run.


    `routes run ... --resume` runs what is missing, failed or stale.
    """
    from gradient_routes.bench.cases.declared import undeclared
    from gradient_routes.bench.cases.row import as_json as json_line
    from gradient_routes.bench.commands.status_view import matrix
    from gradient_routes.bench.render.terminal import tables
    from gradient_routes.bench.store.cases import EVERY, uncollected
    from gradient_routes.bench.store.status import counts, standings
    from gradient_routes.bench.store.store import Store

    if as_json:
        found = standings(Store(store), EVERY)
        for each in found:
            echo(json_line(each.row | {"state": each.aged or "current"}))
        return
    with uncollected():
        found = standings(Store(store))
    out = tables.console()
    tables.show(out, matrix(found))
    out.print(counts(found), style="dim", soft_wrap=True)
    if note := undeclared(each.row for each in found):
        out.print(note, style="dim", soft_wrap=True)
