"""CSV files of numbers with a header line; errors name the file and the line."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array


def read_columns(
    path: str | Path, names: tuple[str, ...] | None, optional: tuple[str, ...] = (), folder: Path = Path()
) -> dict[str, Array]:
    """Read the columns `names` (all of them, where None) of a CSV file as finite float64 arrays (n_rows,).

    A relative path starts from `folder`. An empty cell in one of the columns `optional` is read as NaN.
    Raises InputError for a file that cannot be read, a missing column, text, NaN or infinity, naming the line.
    """
    try:
        with open(folder / path, newline="", encoding="utf-8-sig") as file:
            rows = [(i, row) for i, row in enumerate(csv.reader(file), start=1) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        what = error.strerror if isinstance(error, OSError) else f"not a text file in CSV format ({error})"
        raise InputError(f"{path}: cannot be read: {what} - check the path and the format") from error
    if not rows:
        raise InputError(f"{path}: the file is empty - it needs a header line and one row a value")
    header = [cell.strip() for cell in rows[0][1]]
    if all(_is_number(cell) for cell in header):
        raise InputError(f"{path}: line 1 holds numbers - the first line names the columns")
    wanted = tuple(header) if names is None else names
    twice = [name for name in header if header.count(name) > 1]
    if twice:
        raise InputError(f"{path}: column {twice[0]} is given {header.count(twice[0])} times - keep one")
    missing = [name for name in wanted if name not in header]
    if missing and len(header) == 1 and ";" in header[0]:
        raise InputError(f"{path}: its columns are separated by ';' - separate them by ','")
    if missing:
        raise InputError(f"{path}: no column {', '.join(missing)}; it has {', '.join(header)} - rename or add it")
    columns = {name: np.empty(len(rows) - 1) for name in wanted}
    places = [(header.index(name), column, name) for name, column in columns.items()]
    for k, (line, row) in enumerate(rows[1:]):
        if len(row) != len(header):
            raise InputError(f"{path}: line {line} has {len(row)} cells, the header {len(header)} - correct the line")
        for place, column, name in places:
            empty = name in optional and not row[place].strip()
            column[k] = math.nan if empty else _number(row[place], f"{path}: line {line}, column {name}")
    return columns


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell.replace("_", "?"))  # Python would read 1_0 as 10
    except ValueError:
        raise InputError(f"{where}: {cell.strip()!r} is not a number - write one, like 0.5") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: {cell.strip()} is not finite - remove the row or write a number")
    return value
