"""The blocks of `routes list`: a name, its equation, what it offers or needs, its options."""

from __future__ import annotations

import re
from collections.abc import Iterator
from textwrap import wrap
from typing import Any

from rich.text import Text

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.options import options_of
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Problem, offer_names
from gradient_routes.routes.route import Route

INDENT = "  "


def listing(title: str, kind: registry.Kind, width: int) -> Iterator[Text]:
    """The lines about all of a kind."""
    yield Text(title, style="bold")
    for entry in registry.registered(kind):
        for text, style in _block(kind, entry, width - len(INDENT)):
            yield Text(INDENT + text, style=style)
        yield Text("")


def _block(kind: registry.Kind, entry: registry.Entry, width: int) -> Iterator[tuple[str, str]]:
    """Lines and their styles."""
    origin = "" if entry.origin == registry.BUILT_IN else f"  (from {entry.origin})"
    yield entry.name + origin, f"bold {route_style(entry.name)}"
    if registry.entries(kind)[entry.name] is not entry:
        yield f"hidden by the {kind} of the same name above", "red"
        return
    try:
        target = entry.load()
        named = {} if kind == "study" else options_of(registry.factory_of(target))
        options = [(option.text, option.help) for option in named.values()]
    except InputError as error:
        yield from ((line, "red") for line in wrap(str(error), width))
        return
    yield from ((line, "") for line in wrap(_summary(target), width))
    yield from ((line, "dim") for line in wrap(_contract(kind, target), width))
    yield from ((line, "") for line in _described(options, width))


def _described(options: list[tuple[str, str]], width: int) -> Iterator[str]:
    """Options and their help in two columns; an option longer than half the width has a line of its own."""
    column = max((len(option) for option, _ in options if len(option) <= width // 2), default=0) + 2
    for option, help in options:
        lines = wrap(help, max(width - column, 20)) or [""]
        if len(option) > column - 2:
            yield from _broken(option, width)
            option = ""
        for line in lines:
            yield f"{option:<{column}}{line}".rstrip()
            option = ""


def _broken(option: str, width: int) -> list[str]:
    """An option in lines of at most `width`, broken between its choices."""
    lines = [""]
    for part in re.split(r"(?=\|)", option):
        if len(lines[-1]) + len(part) > width:
            lines.append("      ")
        lines[-1] += part
    return lines


def _summary(target: Any) -> str:
    if isinstance(target, Study):
        return target.question
    if isinstance(target, Route):
        return target.summary
    return " ".join((target.__doc__ or "").strip().split("\n\n")[0].split())


def _contract(kind: registry.Kind, target: Any) -> str:
    if isinstance(target, Study):
        return f"tables: {', '.join(target.tables) or 'cases'}; options: routes {target.name} --help"
    if isinstance(target, Route):
        return f"needs: {', '.join(offer_names(target.needs))}"
    if isinstance(target, type) and issubclass(target, Problem):
        return f"offers: {', '.join(offer_names(target.offers))}"
    return "offers: what it is built with"
