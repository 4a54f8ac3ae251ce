"""Options of problems and routes, read off the keyword-only parameters of their factories.

    def spring(*, n: Annotated[int, "number of springs"] = 3) -> Problem

declares one option, its type, its default and its help. Nothing is declared twice.
"""

from __future__ import annotations

import inspect
import math
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.problems.errors import InputError


@dataclass(frozen=True)
class Option:
    """One option: `kinds` are the types (or literals) its value may have."""

    name: str
    kinds: tuple[Any, ...]
    default: Any
    help: str

    @property
    def choices(self) -> tuple[str, ...]:
        """The literals it may take, if it is a choice."""
        return tuple(str(c) for kind in self.kinds if get_origin(kind) is Literal for c in get_args(kind))

    @property
    def text(self) -> str:
        """`name=default`, or `name=a|b` with the default first."""
        if self.choices:
            first = [] if self.default is None else [str(self.default)]
            return f"{self.name}={'|'.join([*first, *(c for c in self.choices if c not in first)])}"
        return f"{self.name}={'' if self.default is None else self.default}"


@dataclass(frozen=True, eq=False)
class Described:
    """Options that another process has read off a factory; it stands in place of the factory."""

    options: Mapping[str, Option]


@lru_cache(maxsize=256)  # a store may have 100 000 rows of a few factories
def options_of(factory: Callable[..., Any] | Described) -> dict[str, Option]:
    """The options `factory` declares: its keyword-only parameters, by name."""
    if isinstance(factory, Described):
        return dict(factory.options)
    try:
        parameters = inspect.signature(factory, eval_str=True).parameters.values()
    except Exception as error:  # annotations of a plug-in are its own code
        raise InputError(f"{factory!r}: its options cannot be read: {error} - mend its annotations") from error
    return {q.name: _option(q) for q in parameters if q.kind is q.KEYWORD_ONLY}


def _option(q: inspect.Parameter) -> Option:
    annotation, help = q.annotation, ""
    if get_origin(annotation) is Annotated:
        annotation, help = get_args(annotation)[:2]
    default = None if q.default is q.empty else q.default
    return Option(q.name, _kinds(annotation), default, str(help))


def _kinds(annotation: Any) -> tuple[Any, ...]:
    if get_origin(annotation) is Annotated:
        return _kinds(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType):
        return tuple(kind for part in get_args(annotation) for kind in _kinds(part))
    return (annotation,)


def resolve(factory: Callable[..., Any] | Described, grid: dict[str, list[str]], who: str) -> Iterator[dict[str, Any]]:
    """All options of `factory` at each point of the grid of texts, defaults elsewhere. Raises InputError."""
    options = options_of(factory)
    unknown = [name for name in grid if name not in options]
    if unknown:
        known = did_you_mean(unknown[0], options)
        raise InputError(f"{who}: no option '{unknown[0]}' - {known or 'it has none'}")
    values = [[convert(options[name], text, who) for text in texts] for name, texts in grid.items()]
    defaults = {name: option.default for name, option in options.items()}
    return (defaults | dict(zip(grid, point, strict=True)) for point in product(*values))


def convert(option: Option, text: str, who: str) -> Any:
    """The value `text` stands for. Raises InputError saying what was expected."""
    for kind in sorted(option.kinds, key=lambda kind: kind is str):  # text would take everything
        try:
            return _converted(kind, text)
        except ValueError:
            continue
    if option.choices:
        raise InputError(f"{who}: {option.name}={text} - {did_you_mean(text, option.choices)}")
    wanted = " or ".join(NAMES[kind] for kind in option.kinds if kind in NAMES)
    grid = f"; for several values write {option.name}={text.replace(',', '|')}" if "," in text else ""
    raise InputError(f"{who}: {option.name}={text} is not {wanted} - write {option.name}=VALUE{grid}")


NAMES = {int: "a whole number", float: "a number", bool: "true or false", str: "text", type(None): "none"}


def _converted(kind: Any, text: str) -> Any:
    """Raises ValueError where `text` is no `kind`."""
    if get_origin(kind) is Literal:
        choices = {str(choice): choice for choice in get_args(kind)}
        return choices[text] if text in choices else _refuse(text)
    if kind in (int, float) and "_" in text:
        return _refuse(text)  # Python would read 1_0 as 10
    if kind is int:
        return _whole_number(text)
    if kind is bool:
        return text.lower() == "true" if text.lower() in ("true", "false") else _refuse(text)
    if kind is type(None):
        return None if text.lower() == "none" else _refuse(text)
    if kind is float:
        return float(text) if math.isfinite(float(text)) else _refuse(text)
    return text if kind is str else _refuse(text)


def _whole_number(text: str) -> int:
    """Also 1e6, which people write; not 1e300, which a float rounds."""
    number = float(text)
    if not abs(number) < 2**53 or number != int(number):
        return int(_refuse(text))
    return int(number)


def _refuse(text: str) -> Any:
    raise ValueError(text)
