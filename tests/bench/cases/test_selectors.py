"""Selectors and options: what people type, and what they mistype."""

from __future__ import annotations

import random
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, Literal

import pytest
from click.testing import CliRunner

from gradient_routes.bench.cases import case, options, registry
from gradient_routes.bench.cases.options import options_of, resolve
from gradient_routes.bench.cases.selector import parse
from gradient_routes.bench.cli import main
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
    ("text", "grid"),
    [
        ("bar", {}),
        ("bar[]", {}),
        ("bar[n=8]", {"n": ["8"]}),
        (" bar[ n = 8 , x=1 ]", {"n": ["8"], "x": ["1"]}),
        ("bar[n=8|16|8]", {"n": ["8", "16"]}),
        ("bar[n=1|2,x=3|4]", {"n": ["1", "2"], "x": ["3", "4"]}),
        ("bar[nodes=1,3,5,n=8]", {"nodes": ["1,3,5"], "n": ["8"]}),
        ("bar[data=a=b.csv]", {"data": ["a=b.csv"]}),
    ],
)
def test_selectors_are_grids(text: str, grid: dict[str, list[str]]) -> None:
    assert parse(text).name == "bar"
    assert parse(text).grid == grid
    assert parse(text).size == len([*product(*grid.values())])


def test_grids_expand_to_their_product() -> None:
    points = [(o["n"], o["x"]) for o in resolve(factory, {"n": ["1", "2"], "x": ["3", "4"]}, "t")]
    assert points == [(1, 3.0), (1, 4.0), (2, 3.0), (2, 4.0)]


def test_a_grid_is_expanded_in_linear_time(monkeypatch) -> None:
    """A text is converted once however many points have it, and no point is compared with another."""
    converted, compared = [], []

    class Default:
        def __eq__(self, other: object) -> bool:
            compared.append(other)
            return self is other

    default = Default()

    def make(*, a: int = 0, b: int = 0, c: Any = default) -> None: ...

    monkeypatch.setattr(options, "convert", lambda option, text, who: converted.append(text) or int(text))
    monkeypatch.setattr(registry, "find", lambda kind, name: registry.Entry(kind, Loaded(name, make)))
    numbers = "|".join(map(str, range(100)))
    specs = case.problems([f"made[a={numbers},b={numbers}]", f"made[a={numbers}]"])
    assert len(specs) == 10_000  # a=k,b=0 is named twice
    assert len(converted) == 300
    assert not compared


@dataclass(frozen=True)
class Loaded:
    """In place of an entry point."""

    name: str
    target: Any
    dist: None = None

    def load(self) -> Any:
        return self.target


def test_more_cases_than_anybody_wants_are_refused_before_they_are_expanded() -> None:
    thousand = "|".join(map(str, range(2, 1002)))
    said = refusal(lambda: case.problems([f"bar[n={thousand},sensors={thousand},stop_at={thousand}]"]))
    assert said == "1000000000 problems - name at most 100000, or lift that limit with `routes run --yes`"
    assert len(case.problems(["bar[n=2|3|4]"], most=3)) == 3
    assert refusal(lambda: case.problems(["bar[n=2|3|4]"], most=2)) is not None


def test_cases_are_counted_before_the_first_runs(tmp_path) -> None:
    """So are those of few problems and many routes; --yes runs them."""
    problems = f"bar[n={'|'.join(map(str, range(2, 503)))}]"
    routes = f"fd-central[step={'|'.join(map(str, range(1, 201)))}]"
    asked = CliRunner().invoke(main, ["run", "--problem", problems, "--route", routes, "--no-store"])
    assert (asked.exit_code, asked.output.count("\n")) == (2, 1)
    assert "100200 cases - name at most 100000" in asked.output


@pytest.mark.parametrize(
    "text", ["", "[n=8]", "bar[n=8", "bar]", "bar[8]", "bar[n=]", "bar[n=8|]", "bar[n=8,n=9]", "bar[=8]", "bar[n=8]x"]
)
def test_broken_selectors_say_how_to_write_one(text: str) -> None:
    with pytest.raises(InputError, match=r"^selector '.* - "):
        parse(text)


def resolved(given_: dict[str, str], who: str = "t") -> dict[str, Any]:
    """At a grid of one point."""
    (point,) = resolve(factory, {name: [text] for name, text in given_.items()}, who)
    return point


def refusal(call) -> str | None:
    """The text of the InputError that `call` raises, None if it raises nothing; anything else passes through."""
    try:
        call()
    except InputError as error:
        return str(error)
    return None


PIECES = [
    *"[]=,|.:;_+-/ \n\t\0'\"é٣²∞\u202e\U0001f600",
    "n",
    "bar",
    "1",
    "1e9",
    "-0",
    "nan",
    "inf",
    "none",
    "true",
    "raw",
]


def texts(count: int, most: int) -> list[str]:
    """Pieces of selectors in any order."""
    draw = random.Random(count)
    return ["".join(draw.choices(PIECES, k=draw.randint(0, most))) for _ in range(count)]


def test_no_text_breaks_the_parser() -> None:
    for text in texts(2000, 12):
        said = refusal(lambda text=text: parse(text))
        assert said is None or " - " in said, text


def test_no_text_breaks_the_options() -> None:
    names, words = ["n", "x", "on", "kind", "nodes", "m"], texts(2001, 3)
    draw = random.Random(0)
    for _ in range(1000):
        given_ = {name: draw.choice(words) for name in draw.sample(names, draw.randint(0, 3))}
        said = refusal(lambda given_=given_: resolved(given_, "test"))
        assert said is None or said.startswith("test: "), given_


def test_options_take_their_types() -> None:
    texts = {"n": "1e6", "x": "1e-3", "on": "True", "kind": "raw", "nodes": "1,2"}
    assert resolved(texts) == {"n": 10**6, "x": 1e-3, "on": True, "kind": "raw", "nodes": "1,2"}
    assert resolved({"x": "none"})["x"] is None
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
        resolved(given_)
    assert says in str(caught.value)
