"""The order in which stored cases are shown: a store holds them in the order in which they ended."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Row

Item = TypeVar("Item")


def as_asked(items: Iterable[Item], row: Callable[[Item], Row]) -> list[Item]:
    """By when they began, which is in the order asked for; as they come where that is not known."""
    return sorted(items, key=lambda item: row(item).get("started") or "")


def in_order(items: Iterable[Item], row: Callable[[Item], Row]) -> list[Item]:
    """Problems as they were first asked for, the routes on each as `routes list` has them."""
    items, texts = as_asked(items, row), dict[int, str]()
    problems = [
        (row(item)["problem"], _text(row(item)["problem_options"], texts), row(item)["partial"]) for item in items
    ]
    first = {problem: i for i, problem in reversed([*enumerate(problems)])}
    pairs = zip(problems, items, strict=True)
    return [item for _, item in sorted(pairs, key=lambda pair: (first[pair[0]], registry.place(row(pair[1])["route"])))]


def _text(options: Any, known: dict[int, str]) -> str:
    """Of options, which are one object where many rows have them alike."""
    if id(options) not in known:
        known[id(options)] = json.dumps(options)
    return known[id(options)]
