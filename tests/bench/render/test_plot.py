"""The plot: decades, marks, zeros, and what cannot be drawn."""

from __future__ import annotations

import math

import pytest

from gradient_routes.bench.render.terminal.palette import MARKS
from gradient_routes.bench.render.terminal.plot import Series, marks, plot

X = [10.0**-k for k in range(5)]


def lines(*series: Series, width: int = 40, height: int = 9) -> list[str]:
    return plot(series, "x", "y", width, height).plain.splitlines()


def test_a_power_is_a_straight_line() -> None:
    shown = lines(Series("linear", X, X, "L"), Series("square", X, [x**2 for x in X], "Q"))
    assert shown == [
        "y",
        "   1 +                                QL",  # at the edge the second stands left of the first
        "     |                         L",
        "1e-2 +                L        Q",
        "     |        L",
        "1e-4 +L               Q",
        "     |",
        "1e-6 +        Q",
        "     |",
        "1e-8 +Q",
        "     ++-------+-------+--------+-------+",
        "    1e-4    1e-3    1e-2     1e-1      1",
        "                                       x",
        "L linear   Q square",
    ]


@pytest.mark.parametrize("width", [40, 80, 160])
def test_no_line_is_wider_than_the_console(width: int) -> None:
    names = list(MARKS)
    for count in (1, 7):
        many = [Series(n, X, [x * 0.9 for x in X], m) for n, m in zip(names[:count], marks(names), strict=False)]
        shown = lines(*many, width=width)
        assert max(map(len, shown)) <= width
        assert len(shown) >= 9 + 5


def test_zeros_have_a_line_of_their_own_and_what_is_no_number_is_counted() -> None:
    y = [1.0, 1e-3, 0.0, math.nan, None]
    shown = lines(Series("a", X, y, "a"), Series("b", [0.0, -1.0, 1.0], [1.0, 1.0, math.inf], "b"))
    (zero,) = [line for line in shown if line.lstrip().startswith("0 +")]
    assert zero.count("a") == 1
    assert shown[-1] == "a a (2 not drawn)   b b (3 not drawn)"
    assert sum(line.count("a") for line in shown[:-1]) == 3


def test_only_zeros_and_nothing_at_all() -> None:
    assert lines(Series("a", [1.0, 2.0], [0.0, 0.0], "a"))[1].startswith(" 0 +a")
    assert lines(Series("a", [1.0], [None], "a")) == ["nothing to plot: y against x"]


def test_marks_that_meet_stand_side_by_side_while_there_is_room() -> None:
    same = [Series(m, [1.0, 10.0], [1.0, 10.0], m) for m in "abcd"]
    shown = lines(*same)
    assert "abcd" in shown[9]
    assert shown[1].endswith("dcba")
    twice = [Series("e", [1.0] * 9, [1.0] * 9, "e")]
    assert lines(*twice)[9].count("e") == 1


@pytest.mark.parametrize(
    ("first", "second", "row"),
    [
        ([5], [5], "     ab"),  # the second mark moves to the right,
        ([5, 6], [5], "    baa"),  # to the left where the right is taken,
        ([4, 5, 6], [5], "    a*a"),  # and both become one mark where neither is free
        ([4, 5, 6], [6], "    aaab"),
        ([5], [5, 5], "     ab"),  # points of one series share a mark
        ([0], [0], "ab"),
        ([35], [35], 34 * " " + "ba"),
    ],
)
def test_a_mark_moves_by_fewer_columns_than_there_are_series(first: list[int], second: list[int], row: str) -> None:
    x = [10.0 ** (k / 35) for k in range(36)]  # one decade on 36 columns
    a = Series("a", [*(x[k] for k in first), 1.0, 10.0], [*(1.0 for _ in first), 10.0, 10.0], "a")
    b = Series("b", [x[k] for k in second], [1.0 for _ in second], "b")
    assert lines(a, b, width=40)[9] == f" 1 +{row}"


def test_marks_are_those_of_routes_and_differ() -> None:
    assert marks(list(MARKS)) == list(MARKS.values())
    assert marks(["adjoint", "adjoint[factors=stale]", "adjoint[factors=fresh]"]) == ["A", "D", "J"]
    many = marks(["a"] * 62)
    assert len(set(many)) == 62
    assert marks(["a"] * 63)[-1] == "*"


def test_colours_are_styles_and_no_characters() -> None:
    text = plot([Series("a", [1.0], [1.0], "a", "#D55E00")], "x", "y", 40, 9)
    assert {str(span.style) for span in text.spans} >= {"#D55E00"}
    assert "\x1b" not in text.plain
