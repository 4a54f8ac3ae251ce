"""`routes export`: tables of a store as files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import debug_option, replaces, store_option
from gradient_routes.bench.commands.filter_options import filter_options

if TYPE_CHECKING:
    from gradient_routes.bench.store.filter import Filter

OUTPUT = f"File to write [stdout]. {replaces('.csv', '.json', '.parquet')}"


@click.command()
@click.option("--table", default="cases", show_default=True, help="A table that results/README.md describes.")
@click.option("--format", type=click.Choice(["csv", "parquet", "json"]), help="[by the suffix of FILE, else csv]")
@click.option("-o", "--output", type=click.Path(path_type=Path), help=OUTPUT)
@filter_options
@store_option
@debug_option
def export(table: str, format: str | None, output: Path | None, where: Filter, store: Path) -> None:
    """Write a table of the store, or some of its rows, as CSV, Parquet or JSON (one array of row objects)."""
    from gradient_routes.bench.store.export import export as write
    from gradient_routes.bench.store.store import Store

    suffix = "" if output is None else output.suffix.lstrip(".")
    write(Store(store), table, format or (suffix if suffix in ("parquet", "json") else "csv"), output, where)
