"""Values of a state as text, in URLs and commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import param

NONE = "none"  # a list without items: a browser leaves out what is empty


def written(value: Any) -> str:
    """A value of a state as text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ",".join(map(written, value)) or NONE
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def within(bounds: tuple[Any, ...], values: list[Any]) -> None:
    """Raises ValueError for items that are not within two numbers, or no words of these."""
    if isinstance(bounds[0], str):
        if odd := [word for word in values if word not in bounds]:
            raise ValueError(f"{odd[0][:20]} is none of {', '.join(bounds)}")
        return
    low, high = bounds
    if odd := [x for x in values if not low <= x <= high]:
        raise ValueError(f"{written(odd[0])[:20]} is not from {low:g} to {high:g}")


def read(declared: param.Parameter, text: str) -> Any:
    """A value of a state from text. Raises ValueError; that it is within its bounds is for the parameter to say."""
    match declared:
        case param.Boolean():
            if text not in ("yes", "no"):
                raise ValueError("is yes or no")
            return text == "yes"
        case param.Integer():
            return _number(int, text)
        case param.Number():
            return None if text == "None" else _number(float, text)
        case param.List():
            return [_number(declared.item_type or str, item) for item in text.split(",") if item and text != NONE]
        case param.Selector() if text not in declared.objects:
            raise ValueError(f"is none of {', '.join(map(str, declared.objects))}")
    return text


def _number(kind: Callable[[str], Any], text: str) -> Any:
    try:
        return kind(text if kind is str else text.replace("_", "?"))  # Python would read 1_0 as 10
    except ValueError:
        raise ValueError("is no whole number" if kind is int else "is no number") from None


def option(name: str, value: str) -> tuple[str, ...]:
    """Words of a command for an option with a value, which may begin with a minus."""
    return (f"--{name}={value}",) if value.startswith("-") else (f"--{name}", value)
