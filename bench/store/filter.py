"""Which rows of a table are asked for."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.selector import bare

COLUMNS = ("problem", "route", "status", "verdict")


def _is(found: object, wanted: str) -> bool:
    return isinstance(found, str) and wanted in (found, bare(found))


@dataclass(frozen=True)
class Filter:
    """Those that hold all values that are given; of a column that a table lacks, nothing is asked.

    problem, route   names, without options
    search           in the text of any column, upper and lower case being equal
    """

    problem: str = ""
    route: str = ""
    status: str = ""
    verdict: str = ""
    search: str = ""

    def keeps(self, row: Row) -> bool:
        """Whether it is one of them."""
        wanted = [(name, value) for name in COLUMNS if (value := getattr(self, name)) and name in row]
        text = self.search.casefold()
        return all(_is(row[name], value) for name, value in wanted) and (
            not text or any(text in str(value).casefold() for value in row.values() if value is not None)
        )

    @property
    def empty(self) -> bool:
        """Whether all rows are asked for."""
        return self == EVERYTHING

    def lacking(self, names: Collection[str]) -> list[str]:
        """The columns asked for that are not among these."""
        return [name for name in COLUMNS if getattr(self, name) and name not in names]


EVERYTHING = Filter()
