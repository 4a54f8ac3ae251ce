"""Tables of the store as files for other programs."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path
from typing import Any

import click

from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.store.frames import frame
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError


def export(store: Store, table: str, format: str, output: Path | None) -> None:
    """Write a table of the store as CSV, Parquet or a JSON array of row objects, to a file or to stdout."""
    if table not in tables():
        raise InputError(f"export: no table '{table}' - {did_you_mean(table, tables())}")
    names, records = store.table(table)
    if output is None and format == "parquet" and sys.stdout.isatty():
        raise InputError("export: parquet is binary and stdout is a terminal - name a file with -o")
    if output is not None and output.resolve() == store.path.resolve():
        raise InputError(f"export: {output} is the store itself - name another file with -o")
    if format == "json":
        rows = [dict(zip(names, record, strict=True)) for record in records]
        content = (json.dumps(rows, allow_nan=False) + "\n").encode()
    elif format == "parquet":
        content = _parquet(table, names, records)
    else:
        text = io.StringIO(newline="")
        csv.writer(text, lineterminator="\n").writerows([names, *records])
        content = text.getvalue().encode()
    try:
        with click.open_file(str(output or "-"), "wb") as file:
            file.write(content)
    except BrokenPipeError:
        raise
    except OSError as error:
        where = output or "stdout"
        raise InputError(f"export: {where}: {error.strerror} - name a file you may write with -o") from error


def _parquet(table: str, names: list[str], records: list[tuple[Any, ...]]) -> bytes:
    try:
        import pandas  # noqa: F401
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"export: Parquet needs {error.name}, which is not installed - pip install 'gradient-routes[parquet]', or"
            " export as csv or json"
        ) from error
    return bytes(frame(tables()[table], names, records).to_parquet(index=False))
