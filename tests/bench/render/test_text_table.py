"""Tables of text: their width, and what is folded where it is too small."""

from __future__ import annotations

import math

from rich.text import Text

from gradient_routes.bench.render.terminal.text_table import TextTable


def table() -> TextTable:
    made = TextTable(["problem\n  route", "cost /\nforward", "work"], frozenset((1,)))
    made.title("a title that is longer than every row of the table below it, and spans the columns")
    made.row(Text("adjoint"), [Text("1.06"), Text("1 fwd + 1 adj")])
    made.row(Text("unrolled-ad[inner=direct]", style="red"), [Text("12"), Text("1 fwd + 12 adj + 3 mv")])
    return made


def lines(width: float) -> list[str]:
    return [line.plain for line in table().lines(width)]


def test_columns_are_as_wide_as_their_cells() -> None:
    assert lines(math.inf) == [
        "problem                      cost /",
        "  route                     forward work",
        "a title that is longer than every row of the table below it, and spans the columns",
        "  adjoint                      1.06 1 fwd + 1 adj",
        "  unrolled-ad[inner=direct]      12 1 fwd + 12 adj + 3 mv",
    ]


def test_a_long_label_gets_a_line_of_its_own_before_cells_are_folded() -> None:
    assert lines(46)[2:] == [
        "a title that is longer than every row of the",
        "    table below it, and spans the columns",
        "  adjoint           1.06 1 fwd + 1 adj",
        "  unrolled-ad[inner=direct]",
        "                      12 1 fwd + 12 adj + 3 mv",
    ]
    assert lines(38)[-5:] == [
        "  adjoint           1.06 1 fwd + 1 adj",
        "  unrolled-ad[inner=direct]",
        "                      12 1 fwd",
        "                         + 12 adj",
        "                         + 3 mv",
    ]


def test_no_number_is_folded() -> None:
    narrow = lines(1)
    assert [line.split() for line in narrow[-3:]] == [["12", "1", "fwd"], ["+", "12", "adj"], ["+", "3", "mv"]]


def test_the_style_of_a_cell_is_that_of_its_lines() -> None:
    own = next(line for line in table().lines(40) if line.plain.startswith("  unrolled"))
    assert str(own.style) == "red"


def test_without_titles_nothing_is_indented() -> None:
    made = TextTable(["problem", "unrolled-ad"])
    made.row(Text("bar"), [Text("out-of-memory (stale)")])
    assert [line.plain for line in made.lines()] == ["problem unrolled-ad", "bar     out-of-memory (stale)"]
    assert [line.plain for line in made.lines(18)] == [
        "        unrolled-",
        "problem ad",
        "bar     out-of-",
        "        memory",
        "        (stale)",
    ]
