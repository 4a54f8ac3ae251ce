"""Text files of numbers in columns with a header line; errors name the file and the line.

Columns are separated by `;`, by tabs or by commas, whichever the header has first in this order. Where the comma does
not separate columns it may be the decimal mark. Blank lines, and lines that begin with # or %, are skipped; a header
may be such a line. Numbers are read by NumPy in blocks of lines; only where that fails cell by cell, to say where.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice, repeat
from pathlib import Path
from typing import TextIO

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

BLOCK = 50_000  # lines
COMMENTS = ("#", "%")


def read_columns(
    path: str | Path, names: tuple[str, ...] | None, optional: tuple[str, ...] = (), folder: Path = Path()
) -> dict[str, Array]:
    """Read the columns `names` (all of them, where None) of a text file as finite float64 arrays (n_rows,).

    A relative path starts from `folder`. An empty cell in one of the columns `optional` is read as NaN.
    Raises InputError for a file that cannot be read, a missing column, text, NaN or infinity, naming the line.
    """
    file = NumberFile.opened(path, folder)
    wanted = file.names if names is None else names
    twice = [name for name in file.names if name and file.names.count(name) > 1]
    if twice:
        raise InputError(f"{path}: column {twice[0]} is given {file.names.count(twice[0])} times - keep one")
    missing = [name for name in wanted if name not in file.names]
    if missing:
        raise InputError(f"{path}: no column {', '.join(missing)}; it has {file.listed} - rename or add it")
    values, _ = file.read([file.names.index(name) for name in wanted], {file.names.index(name) for name in optional})
    return dict(zip(wanted, values, strict=True))


@dataclass(frozen=True)
class NumberFile:
    """A file whose header has been read.

    path        as messages name it
    file        where it is
    separator   of columns
    names       of columns, as the header gives them
    start       number of lines before the first row of numbers
    """

    path: str | Path
    file: Path
    separator: str
    names: tuple[str, ...]
    start: int

    @classmethod
    def opened(cls, path: str | Path, folder: Path = Path()) -> NumberFile:
        """Raises InputError for a file that cannot be read or has no header."""
        comment, line, start = "", "", 0
        with _text(path, folder / path) as file:
            for start, line in enumerate(file, start=1):  # noqa: B007
                if line.startswith(COMMENTS):
                    comment = line.lstrip("".join(COMMENTS))
                elif line.strip():
                    break
                line = ""
        if not line:
            raise InputError(f"{path}: the file is empty - it needs a header line and one row a value")
        separator = next((s for s in (";", "\t") if s in line), ",")
        names, above = (_cells(path, text, separator) for text in (line, comment))
        if _holds_numbers(names):
            if len(names) != len(above) or _holds_numbers(above):
                raise InputError(f"{path}: line {start} holds numbers - the first line names the columns")
            names, start = above, start - 1
        if any("\udc80" <= c <= "\udcff" or c == "\0" for name in names for c in name):
            raise InputError(f"{path}: cannot be read: its header is not text in UTF-8 - save it as CSV in UTF-8")
        return cls(path, folder / path, separator, names, start)

    @property
    def listed(self) -> str:
        return ", ".join(filter(None, self.names))

    def read(self, places: Sequence[int], optional: set[int] | frozenset[int] = frozenset()) -> tuple[Array, Array]:
        """The columns at these places, (n_columns, n_rows), and the line of every row (n_rows,).

        An empty cell in the columns at `optional` places is NaN. Raises InputError, naming the line.
        """
        values, lines = [np.empty((len(places), 0))], [np.empty(0, dtype=int)]
        with _text(self.path, self.file) as file:
            for _ in islice(file, self.start):
                pass
            first = self.start + 1
            while block := list(islice(file, BLOCK)):
                at, rows = self._rows(block, first)
                if rows:
                    values.append(self._numbers(at, rows, places, optional))
                    lines.append(at)
                first += len(block)
        return np.concatenate(values, axis=1), np.concatenate(lines)

    def words(self, place: int) -> list[str]:
        """The cells of one column as they are written, of the rows that `read` reads."""
        found: list[str] = []
        with _text(self.path, self.file) as file:
            for first, line in enumerate(islice(file, self.start, None), self.start + 1):
                _, rows = self._rows([line], first)
                found += [_cells(self.path, row, self.separator)[place] for row in rows]
        return found

    def _rows(self, block: list[str], first: int) -> tuple[Array, list[str]]:
        """The lines with as many cells as the header, without blank ones and comments; and their numbers."""
        at = np.arange(first, first + len(block))
        if not all(map(str.strip, block)) or any(map(str.startswith, block, repeat(COMMENTS))):
            keep = [i for i, row in enumerate(block) if row.strip() and not row.startswith(COMMENTS)]
            at, block = at[keep], [block[i] for i in keep]
        separators = len(self.names) - 1
        if set(map(str.count, block, repeat(self.separator))) - {separators}:
            for line, row in zip(at, block, strict=True):
                if row.count(self.separator) != separators:  # quotes may protect a separator
                    self._check_count(int(line), len(_cells(self.path, row, self.separator)))
        return at, block

    def _check_count(self, line: int, cells: int) -> None:
        wanted, todo = len(self.names), "correct the line"
        if self.separator == "," and cells > wanted:
            todo = "if ',' is the decimal comma, separate the columns by ';', else correct the line"
        if cells != wanted:
            raise InputError(f"{self.path}: line {line} has {cells} cells, the header {wanted} - {todo}")

    def _numbers(self, at: Array, rows: list[str], places: Sequence[int], optional: set[int] | frozenset[int]) -> Array:
        read = rows
        if self.separator != "," and any(map(str.__contains__, rows, repeat(","))):
            if any(map(str.__contains__, rows, repeat("."))):
                self._check_marks(at, rows, places)
            read = [row.replace(",", ".") for row in rows]
        found = self._all_at_once(read, places)
        if found is None and not any(map(str.__contains__, map(str.lower, read), repeat("nan"))):
            s, text = self.separator, "".join(["\n", *read, "\n"])
            for empty in (s + s, s + s, f"{s}\n", f"\n{s}"):  # twice, as neighbours share a separator
                text = text.replace(empty, f"{empty[0]}nan{empty[1]}")
            found = self._all_at_once(text.split("\n"), places, [place in optional for place in places])
        return self._cell_by_cell(at, read, places, optional) if found is None else found

    def _all_at_once(self, rows: list[str], places: Sequence[int], gaps: Sequence[bool] = (False,)) -> Array | None:
        """None unless all cells are finite numbers, or NaN in the columns with gaps."""
        try:
            found = np.loadtxt(rows, delimiter=self.separator, usecols=places, ndmin=2, comments=None, quotechar='"').T
        except ValueError:
            return None
        read = np.isfinite(found) | (np.isnan(found) & np.array(gaps)[:, None])
        return np.ascontiguousarray(found) if read.all() else None

    def _check_marks(self, at: Array, rows: list[str], places: Sequence[int]) -> None:
        """Raises InputError where one number has a decimal comma and another one a decimal point."""
        seen: dict[str, str] = {}
        for line, row in zip(at, rows, strict=True):
            cells = _cells(self.path, row, self.separator)
            for place in places:
                for mark in ",.":
                    if mark in cells[place]:
                        seen.setdefault(mark, f"{cells[place]} in line {line}")
            if len(seen) == 2:
                raise InputError(
                    f"{self.path}: {seen[',']} has a comma, {seen['.']} a point - write one decimal mark, and nothing"
                    f" between thousands"
                )

    def _cell_by_cell(
        self, at: Array, rows: list[str], places: Sequence[int], optional: set[int] | frozenset[int]
    ) -> Array:
        values = np.empty((len(places), len(rows)))
        for k, (line, row) in enumerate(zip(at, rows, strict=True)):
            cells = _cells(self.path, row, self.separator)
            for column, place in zip(values, places, strict=True):
                empty = place in optional and not cells[place]
                where = f"{self.path}: line {line}, column {self.names[place]}"
                column[k] = math.nan if empty else _number(cells[place], where)
        return values


@contextmanager
def _text(path: str | Path, file: Path) -> Iterator[TextIO]:
    """Bytes that are not UTF-8 become surrogates: they matter only where they are read."""
    try:
        with open(file, encoding="utf-8-sig", errors="surrogateescape") as text:
            yield text
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror} - check the path and the format") from error


def _cells(path: str | Path, line: str, separator: str) -> tuple[str, ...]:
    try:
        row = next(csv.reader([line.strip("\n")], delimiter=separator, skipinitialspace=True), [])
    except csv.Error as error:
        what = f"not a text file in CSV format ({error})"
        raise InputError(f"{path}: cannot be read: {what} - check the path and the format") from error
    return tuple(cell.strip().replace("\udcb5", "µ") for cell in row)  # the micro sign of Windows' code page


def _holds_numbers(cells: Sequence[str]) -> bool:
    try:
        return bool([float(cell.replace(",", ".")) for cell in cells if cell])
    except ValueError:
        return False


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell.replace("_", "?"))  # Python would read 1_0 as 10
    except ValueError:
        raise InputError(f"{where}: {cell.strip()!r} is not a number - write one, like 0.5") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: {cell.strip()} is not finite - remove the row or write a number")
    return value
