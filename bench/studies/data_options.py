"""--columns and --units: how the problems of a command read their data files."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any

import click

from gradient_routes.bench.cases.selector import parse
from gradient_routes.problems.errors import InputError

Command = Callable[..., Any]

COLUMNS = "Columns of the problem's data file, as x=NAME,ux=NAME; y=3mm is one value for all rows. [by its header]"
UNITS = (
    "Units of these columns that the header does not state: mm, or x=mm,ux=um. m, mm, um; Pa, kPa, MPa, GPa, N/mm2;"
    " N, kN; 1, %, microstrain; s, ms, min, h; K, degC; px with its scale, px=0.02mm."
)
NAMES = ("selector", "problem", "problems")  # under which a command knows its --problem


def data_options(command: Command) -> Command:
    """--columns and --units, passed on as options columns= and units= of the problem that reads data=FILE."""

    @wraps(command)
    def with_data(*, columns: str | None, units: str | None, **others: Any) -> Any:
        key = next(name for name in NAMES if name in others)
        selectors = [others[key]] if others[key] else []
        read = reading(selectors, columns=columns, units=units)
        return command(**others | ({key: read[0]} if read else {}))

    named = click.option("--columns", metavar="LIST", help=COLUMNS)
    return named(click.option("--units", metavar="LIST", help=UNITS)(with_data))


def reading(selectors: Sequence[str], **given: str | None) -> list[str]:
    """The selectors, those of data=FILE with these options, too. Raises InputError."""
    options = {name: text for name, text in given.items() if text is not None}
    files = [text for text in selectors if "data" in parse(text).grid] if options else []
    if options and not files:
        raise InputError(f"--{next(iter(options))}: no --problem reads a file - write --problem 'NAME[data=FILE]'")
    return [_with(text, options) if text in files else text for text in selectors]


def _with(selector: str, options: dict[str, str]) -> str:
    for name, text in options.items():
        pairs = re.sub(r"(^|,)\s*(\w+)\s*=", r"\1\2:", text)  # a selector splits at =
        if "=" in pairs or "|" in pairs:
            raise InputError(f"--{name} {text}: names with = or | cannot be part of a selector - rename the column")
        if name in parse(selector).grid:
            raise InputError(f"--{name}: selector '{selector}' has {name}=, too - keep one")
        selector = f"{selector.rstrip()[:-1]},{name}={pairs}]"
    return selector
