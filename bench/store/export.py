"""Tables of the store as files for other programs."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import click

from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

DTYPES = {"INTEGER": "Int64", "REAL": "Float64", "TEXT": "string"}


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
        buffer = io.BytesIO()
        frame(table, names, records).to_parquet(buffer, index=False)
        content = buffer.getvalue()
    else:
        content = frame(table, names, records).to_csv(index=False).encode()
    try:
        with click.open_file(str(output or "-"), "wb") as file:
            file.write(content)
    except BrokenPipeError:
        raise
    except OSError as error:
        where = output or "stdout"
        raise InputError(f"export: {where}: {error.strerror} - name a file you may write with -o") from error


def frame(table: str, names: list[str], records: list[tuple[Any, ...]]) -> Any:
    """A pandas DataFrame whose types are the schema's, whatever the data."""
    import pandas as pd  # half a second that only these formats pay

    types = {column.name: column.type for column in tables()[table]}
    data = pd.DataFrame.from_records(records, columns=names)
    return data.astype({name: DTYPES[types.get(name, "TEXT").removesuffix(" PRIMARY KEY")] for name in names})
