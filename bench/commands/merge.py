"""`routes merge`: the results of other stores in one."""

from __future__ import annotations

from pathlib import Path

import click

from gradient_routes.bench.command_options import debug_option, store_option
from gradient_routes.bench.sanitize import echo


@click.command()
@click.argument("others", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FILE...")
@store_option
@debug_option
def merge(others: tuple[Path, ...], store: Path) -> None:
    """Add what the stores FILE hold to the one of --store.

    FILE is a store of another machine, or what a command kept apart where the store could not be written. What is
    there already is not added again; FILE stays as it is.
    """
    from gradient_routes.bench.store.merge import merge as add
    from gradient_routes.bench.store.store import Store

    for other in others:
        cases, studies = add(Store(store), Store(other))
        echo(f"{cases} cases and {studies} studies of {other} added to {store}")
