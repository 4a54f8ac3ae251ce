"""Selectors and options: what people type, and what they mistype."""

from __future__ import annotations

from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gradient_routes.bench.cases.options import options_of, resolve
from gradient_routes.bench.cases.selector import parse
from gradient_routes.problems.errors import InputError


def factory(
    *,
    n: Annotated[int, "a count"] = 8,
    x: float | None = None,
    on: bool = False,
    kind: Literal["log", "raw"] = "log",
    nodes: Annotated[str | int | None, "nodes"] = None,
) -> None: ...


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("bar", [{}]),
        ("bar[]", [{}]),
        ("bar[n=8]", [{"n": "8"}]),
        (" bar[ n = 8 , x=1 ]", [{"n": "8", "x": "1"}]),
        ("bar[n=8|16]", [{"n": "8"}, {"n": "16"}]),
        ("bar[n=1|2,x=3|4]", [{"n": a, "x": b} for a in "12" for b in "34"]),
        ("bar[nodes=1,3,5,n=8]", [{"nodes": "1,3,5", "n": "8"}]),
        ("bar[data=a=b.csv]", [{"data": "a=b.csv"}]),
    ],
)
def test_selectors_expand(text: str, points: list[dict[str, str]]) -> None:
    assert parse(text).name == "bar"
    assert parse(text).expand() == points


@pytest.mark.parametrize(
    "text", ["", "[n=8]", "bar[n=8", "bar]", "bar[8]", "bar[n=]", "bar[n=8|]", "bar[n=8,n=9]", "bar[=8]", "bar[n=8]x"]
)
def test_broken_selectors_say_how_to_write_one(text: str) -> None:
    with pytest.raises(InputError, match=r"^selector '.* - "):
        parse(text)


def refusal(call) -> str | None:
    """The text of the InputError that `call` raises, None if it raises nothing; anything else passes through."""
    try:
        call()
    except InputError as error:
        return str(error)
    return None


@given(st.text(max_size=30))
def test_no_text_breaks_the_parser(text: str) -> None:
    said = refusal(lambda: parse(text).expand())
    assert said is None or " - " in said


@given(st.dictionaries(st.sampled_from(["n", "x", "on", "kind", "nodes", "m"]), st.text(max_size=10)))
def test_no_text_breaks_the_options(given_: dict[str, str]) -> None:
    said = refusal(lambda: resolve(factory, given_, "test"))
    assert said is None or said.startswith("test: ")


def test_options_take_their_types() -> None:
    texts = {"n": "1e6", "x": "1e-3", "on": "True", "kind": "raw", "nodes": "1,2"}
    assert resolve(factory, texts, "t") == {"n": 10**6, "x": 1e-3, "on": True, "kind": "raw", "nodes": "1,2"}
    assert resolve(factory, {"x": "none"}, "t")["x"] is None
    assert options_of(factory)["n"].help == "a count"
    assert options_of(factory)["kind"].text == "kind=log|raw"


@pytest.mark.parametrize(
    ("given_", "says"),
    [
        ({"m": "1"}, "t: no option 'm' - choose from n, x, on, kind, nodes"),
        ({"node": "1"}, "t: no option 'node' - did you mean 'nodes'?"),
        ({"n": "x"}, "t: n=x is not a whole number"),
        ({"n": "8.5"}, "n=8.5 is not a whole number"),
        ({"n": "1e300"}, "is not a whole number"),
        ({"n": "nan"}, "is not a whole number"),
        ({"n": "8,16"}, "for several values write n=8|16"),
        ({"x": "y"}, "x=y is not a number or none"),
        ({"on": "maybe"}, "is not true or false"),
        ({"kind": "lin"}, "kind=lin - "),
    ],
)
def test_wrong_options_say_what_would_be_right(given_: dict[str, str], says: str) -> None:
    with pytest.raises(InputError) as caught:
        resolve(factory, given_, "t")
    assert says in str(caught.value)
