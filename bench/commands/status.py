"""`routes status`: what a store holds, and what of it is stale."""

from __future__ import annotations

from pathlib import Path

import click

from gradient_routes.bench.command_options import debug_option, store_option


@click.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object a case: its row and what it is now.")
@store_option
@debug_option
def status(as_json: bool, store: Path) -> None:
    """The matrix of problems and routes: the newest outcome of every case, stale where its code has changed since.

    \b
    ok             measured                       timeout, out-of-memory   met a limit
    skipped        not for this route, too dear   not-converged, non-finite, failed, crashed
    pruned         a smaller size met a limit     (stale)  code, data or libraries have changed
    -              not run                        (gone)   its problem or route is no longer there

    `routes run ... --resume` runs what is missing, failed or stale.
    """
    from gradient_routes.bench.cases.row import as_json as json_line
    from gradient_routes.bench.commands.status_view import matrix
    from gradient_routes.bench.render.terminal import tables
    from gradient_routes.bench.store.status import counts, standings
    from gradient_routes.bench.store.store import Store

    found = standings(Store(store))
    if as_json:
        for each in found:
            click.echo(json_line(each.row | {"state": each.aged or "current"}))
        return
    out = tables.console()
    tables.show(out, matrix(found))
    out.print(counts(found), style="dim", soft_wrap=True)
