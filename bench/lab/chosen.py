"""What is chosen on a page as selectors: registered names only, options read by the registry, no files."""

from __future__ import annotations

from functools import cache
from typing import Any

from gradient_routes.bench.cases import case, registry, selector
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Offers, Problem
from gradient_routes.routes.route import Route

FILES = {"data": "a file; drop it on the page of own data", "mesh": "a file", "command": "a program"}
SLASHED = "units"  # N/mm2
SMALL: dict[str, dict[str, str]] = {  # so that a gradient takes seconds
    "block": {"n": "2"},
    "plate": {"n": "2"},
    "rod": {"n": "8"},
    "advection": {"n": "4"},
    "heat": {"n": "4"},
    "advection-in-time": {"n": "4", "steps": "10"},
    "impact-block": {"n": "1", "steps": "20"},
}


def names(kind: registry.Kind) -> list[str]:
    """All that are registered and can be imported without being told to: those of plug-ins, too."""
    return [*registry.entries(kind)]


def problem(name: str, options: str = "", small: bool = False, **fixed: str) -> str:
    """The selector of a problem: its small size where wanted, options as text, those of the page. Raises InputError."""
    text = (SMALL.get(name, {}) if small else {}) | _given("problem", name, options, fixed) | fixed
    chosen = _written(name, text)
    case.problems([_written(name, {key: value for key, value in text.items() if key != "data"})])
    return chosen


def route(name: str, **options: str) -> str:
    """The selector of a route. Raises InputError."""
    chosen = _written(name, _given("route", name, "", {}) | options)
    case.routes([chosen])
    return chosen


@cache
def offers(name: str) -> Offers | None:
    """What a problem offers; None where that depends on what it is built with."""
    target: Any = registry.find("problem", name).load()
    return target.offers if isinstance(target, type) and issubclass(target, Problem) else None


@cache
def applying(name: str) -> tuple[list[str], list[str]]:
    """Routes that can run on a problem, ours and those of other codes; none that runs a program of one's choice."""
    found: tuple[list[str], list[str]] = [], []
    for entry in registry.entries("route").values():
        if entry.failure is None and entry.name != "adapter":
            target = entry.load()
            assert isinstance(target, Route)
            offered = offers(name)
            if offered is None or target.needs in offered:
                found[Offers.CASE in target.needs].append(entry.name)
    return found


def sound(name: str) -> bool:
    """Whether `all` names a route."""
    return registry.find("route", name).sound


def _given(kind: registry.Kind, name: str, options: str, fixed: dict[str, str]) -> dict[str, str]:
    """Options as text. Raises InputError for unknown names, several values, files, options set elsewhere."""
    known = registry.entries(kind)
    if name not in known:
        raise InputError(f"no {kind} '{name[:40]}' - {did_you_mean(name, known)}")
    given = {}
    for key, values in selector.parse(f"{name}[{options}]").grid.items():
        value = values[0]
        if len(values) > 1:
            raise InputError(f"{name}: {key}={'|'.join(values)} - the page takes one value at a time")
        if key in FILES and (key, value) != ("data", "twin"):
            raise InputError(f"{name}: {key}= names {FILES[key]} - the page takes no others: leave it out")
        if key != SLASHED and ("/" in value or "\\" in value):
            raise InputError(f"{name}: {key}={value} - the page takes no paths: write a value without / and \\")
        if key in fixed:
            raise InputError(f"{name}: {key} has a field of its own on the page - set it there")
        given[key] = value
    return given


def _written(name: str, options: dict[str, str]) -> str:
    return f"{name}[{','.join(f'{key}={value}' for key, value in options.items())}]" if options else name
