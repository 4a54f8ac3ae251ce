"""Tables of the store as files for other programs."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from bench.store import Store
from problems.errors import InputError


def export(store: Store, table: str, format: str, output: Path | None) -> None:
    """Write a table of the store as CSV, Parquet or a JSON array of row objects, to a file or to stdout."""
    import pandas as pd  # half a second that only this verb pays

    names, records = store.table(table)
    frame = pd.DataFrame.from_records(records, columns=names).convert_dtypes()
    if output is None and format == "parquet" and sys.stdout.isatty():
        raise InputError("export: parquet is binary and stdout is a terminal - name a file with -o")
    try:
        with click.open_file(str(output or "-"), "wb") as file:
            if format == "parquet":
                frame.to_parquet(file, index=False)
            elif format == "json":
                file.write((frame.to_json(orient="records", double_precision=15) + "\n").encode())
            else:
                file.write(frame.to_csv(index=False).encode())
    except OSError as error:
        raise InputError(f"export: {output}: {error.strerror} - name a file you may write with -o") from error
