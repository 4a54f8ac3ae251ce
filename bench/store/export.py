"""Tables of the store as files for other programs."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.command_options import complain
from gradient_routes.bench.sanitize import plain
from gradient_routes.bench.store.filter import EVERYTHING, Filter
from gradient_routes.bench.store.frames import frame
from gradient_routes.bench.store.output_files import Output, print_bytes
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

AT_ONCE = 1000  # rows
SUFFIXES = (".csv", ".json", ".parquet")


def export(store: Store, table: str, format: str, output: Path | None, where: Filter = EVERYTHING) -> None:
    """Write rows of a table of the store as CSV, Parquet or a JSON array of objects, to a file or to stdout."""
    if table not in tables():
        raise InputError(f"export: no table '{table}' - {did_you_mean(table, tables())}")
    if lacking := where.lacking([column.name for column in tables()[table]]):
        raise InputError(f"export: table '{table}' has no column '{lacking[0]}' - leave --{lacking[0]} out")
    if output is None and format == "parquet" and sys.stdout.isatty():
        raise InputError("export: parquet is binary and stdout is a terminal - name a file with -o")
    file = None if output is None else Output("export -o", output, SUFFIXES)
    if file is not None:
        file.check([store.path])
    kept = 0

    def counted(records: Iterator[tuple[Any, ...]]) -> Iterator[tuple[Any, ...]]:
        nonlocal kept
        for record in records:
            kept += 1
            yield record

    with filtered(store, table, where) as (names, records):
        if format == "parquet":
            _write(file, iter([_parquet(table, names, [*counted(records)])]))
        else:
            _write(file, (_json if format == "json" else _csv)(names, counted(records)))
    if not kept and not where.empty:
        complain(
            f"export: no row of '{table}' is as asked - name problems and routes without options; see routes status"
        )


@contextmanager
def filtered(store: Store, table: str, where: Filter) -> Iterator[tuple[list[str], Iterator[tuple[Any, ...]]]]:
    """Column names and rows of a table, one at a time."""
    with store.streamed(table) as (names, records):
        if where.empty:
            yield names, records
        else:
            yield names, (record for record in records if where.keeps(dict(zip(names, record, strict=True))))


def _write(file: Output | None, pieces: Iterator[bytes]) -> None:
    if file is None:
        seen = sys.stdout.isatty()
        for piece in pieces:
            print_bytes(plain(piece.decode()).encode() if seen else piece)
        return
    with file.open() as target:
        target.writelines(pieces)


def _json(names: list[str], records: Iterator[tuple[Any, ...]]) -> Iterator[bytes]:
    """An array of objects."""
    before = "["
    for some in batched(records):
        rows = (json.dumps(dict(zip(names, record, strict=True)), allow_nan=False) for record in some)
        yield f"{before}{', '.join(rows)}".encode()
        before = ", "
    yield b"[]\n" if before == "[" else b"]\n"


def _csv(names: list[str], records: Iterator[tuple[Any, ...]]) -> Iterator[bytes]:
    heading: list[Sequence[Any]] = [names]
    for some in chain([heading], batched(records)):
        text = io.StringIO(newline="")
        csv.writer(text, lineterminator="\n").writerows(some)
        yield text.getvalue().encode()


def batched(records: Iterator[tuple[Any, ...]]) -> Iterator[Sequence[Sequence[Any]]]:
    while some := [*islice(records, AT_ONCE)]:
        yield some


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
