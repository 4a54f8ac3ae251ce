"""Tables of the store as files for other programs."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.store.frames import frame
from gradient_routes.bench.store.output_files import Output, print_bytes
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

SUFFIXES = (".csv", ".json", ".parquet")


def export(store: Store, table: str, format: str, output: Path | None) -> None:
    """Write a table of the store as CSV, Parquet or a JSON array of row objects, to a file or to stdout."""
    if table not in tables():
        raise InputError(f"export: no table '{table}' - {did_you_mean(table, tables())}")
    names, records = store.table(table)
    if output is None and format == "parquet" and sys.stdout.isatty():
        raise InputError("export: parquet is binary and stdout is a terminal - name a file with -o")
    file = None if output is None else Output("export -o", output, SUFFIXES)
    if file is not None:
        file.check([store.path])
    if format == "json":
        rows = [dict(zip(names, record, strict=True)) for record in records]
        content = (json.dumps(rows, allow_nan=False) + "\n").encode()
    elif format == "parquet":
        content = _parquet(table, names, records)
    else:
        text = io.StringIO(newline="")
        csv.writer(text, lineterminator="\n").writerows([names, *records])
        content = text.getvalue().encode()
    if file is None:
        print_bytes(content)
        return
    with file.open() as target:
        target.write(content)


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
