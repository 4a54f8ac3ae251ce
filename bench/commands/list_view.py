"""`routes list`: what exists, its options, what it offers or needs, and what cannot be imported."""

from __future__ import annotations

from typing import Any

from rich.console import Group
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.options import options_of
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Problem, offer_names
from gradient_routes.routes.route import Route


def listing(kind: registry.Kind) -> Group:
    """All problems or all routes, one block each."""
    blocks: list[Any] = [Text(f"{kind}s", style="bold")]
    for entry in registry.registered(kind):
        blocks.append(Padding(_block(kind, entry), (0, 0, 1, 2), expand=False))
    return Group(*blocks)


def _block(kind: registry.Kind, entry: registry.Entry) -> Group:
    origin = "" if entry.origin == registry.BUILT_IN else f"  (from {entry.origin})"
    name = Text(entry.name + origin, style=f"bold {route_style(entry.name)}")
    if registry.entries(kind)[entry.name] is not entry:
        return Group(name, Text(f"hidden by the {kind} of the same name above", style="red"))
    options = Table(box=None, pad_edge=False, show_header=False)
    options.add_column(no_wrap=True)
    options.add_column()
    try:
        target = entry.load()
        for option in options_of(registry.factory_of(target)).values():
            options.add_row(Text(option.text), Text(option.help))
    except InputError as error:
        return Group(name, Text(str(error), style="red"))
    return Group(name, Text(_summary(target)), Text(f"{_contract(kind, target)}", style="dim"), options)


def _summary(target: Any) -> str:
    if isinstance(target, Route):
        return target.summary
    return " ".join((target.__doc__ or "").strip().split("\n\n")[0].split())


def _contract(kind: registry.Kind, target: Any) -> str:
    if isinstance(target, Route):
        return f"needs: {', '.join(offer_names(target.needs))}"
    if isinstance(target, type) and issubclass(target, Problem):
        return f"offers: {', '.join(offer_names(target.offers))}"
    return "offers: what it is built with"
