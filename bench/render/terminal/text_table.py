"""A table of text that fits a width."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from rich.cells import cell_len
from rich.text import Text

# where a cell may be folded: after a comma, before + ( and ->, after a hyphen or a prefix within a word
FOLDS = re.compile(r"(?<=, )|(?<= )(?=[+(]|->)|(?<=[a-z]-)(?=[a-z])|(?<=^un)(?=resolved$)")
WORDS = re.compile(r"(?<= )|(?<=[a-z]-)(?=[a-z])")  # where a heading may be folded
NOWHERE = re.compile(r"(?!)")
INDENT, GAP = "  ", " "
LONG = 16  # columns; where space is short, a longer label stands on a line of its own


@dataclass
class TextTable:
    """Rows of a label and cells, under titles that span all columns.

    Where the width is too small, long labels are put on a line of their own, then the widest columns are folded.
    `headings` of the cells, the first of the label; `right` are those aligned to the right.
    """

    headings: Sequence[str]
    right: frozenset[int] = frozenset()
    rows: list[list[Text]] = field(default_factory=list)  # of one cell: a title

    def title(self, text: str) -> None:
        self.rows.append([Text(text, style="bold")])

    def row(self, label: Text, cells: Sequence[Text]) -> None:
        indent = INDENT if any(len(row) == 1 for row in self.rows) else ""
        self.rows.append([Text(indent + label.plain, style=label.style), *cells])

    def lines(self, width: float = math.inf) -> Iterator[Text]:
        """The lines of the table, at most `width` wide where folding can do it."""
        widths = self._widths(width)
        head = [_folded(heading, w, WORDS) for heading, w in zip(self.headings, widths, strict=True)]
        height = max(map(len, head))
        yield from self._lines([[""] * (height - len(lines)) + lines for lines in head], ["bold"] * len(head), widths)
        for row in self.rows:
            if len(row) == 1:
                for i, line in enumerate(_folded(row[0].plain, width, WORDS)):
                    yield Text((2 * INDENT if i else "") + line, style=row[0].style)
                continue
            cells = [_folded(cell.plain, w, FOLDS) for cell, w in zip(row, widths, strict=True)]
            if cell_len(row[0].plain) > widths[0]:
                yield row[0]
                cells[0] = [""]
            yield from self._lines(cells, [str(cell.style) for cell in row], widths)

    def _widths(self, width: float) -> list[int]:
        """Of the columns, as wide as their cells and as narrow as it takes."""
        cells = [[row[i].plain for row in self.rows if len(row) > 1] for i in range(len(self.headings))]
        columns = list(zip(self.headings, cells, strict=True))
        widest = [max(_longest(text, NOWHERE) for text in (heading, *cells)) for heading, cells in columns]
        narrowest = [
            max(_longest(heading, WORDS), *(_longest(text, FOLDS) for text in ["", *cells]))
            for heading, cells in columns
        ]
        narrowest[0] = min(widest[0], LONG)
        widths = list(widest)
        too_wide = sum(widths) + len(GAP) * (len(widths) - 1) - width
        if too_wide > 0:
            widths[0] = max(narrowest[0], int(widths[0] - min(too_wide, widths[0])))
        while sum(widths) + len(GAP) * (len(widths) - 1) > width:
            foldable = [i for i in range(1, len(widths)) if widths[i] > narrowest[i]]
            if not foldable:
                break
            widths[max(foldable, key=lambda i: widths[i])] -= 1
        return widths

    def _lines(self, cells: list[list[str]], styles: list[str], widths: list[int]) -> Iterator[Text]:
        for i in range(max(map(len, cells))):
            line = Text()
            for column, (lines, style) in enumerate(zip(cells, styles, strict=True)):
                text = lines[i] if i < len(lines) else ""
                space = " " * (widths[column] - cell_len(text))
                line.append(GAP if column else "")
                line.append(space + text if column in self.right else text + space, style=style)
            line.rstrip()
            yield line


def _longest(text: str, folds: re.Pattern[str]) -> int:
    """The width of its longest piece."""
    return max(cell_len(piece.rstrip()) for line in text.split("\n") for piece in folds.split(line))


def _folded(text: str, width: float, folds: re.Pattern[str]) -> list[str]:
    """Lines of at most `width` where folds allow it; a line break stays one."""
    lines: list[str] = []
    for part in text.split("\n"):
        line = ""
        for piece in folds.split(part):
            if line and cell_len((line + piece).rstrip()) > width:
                lines.append(line.rstrip())
                line = ""
            line += piece
        lines.append(line.rstrip())
    return lines
