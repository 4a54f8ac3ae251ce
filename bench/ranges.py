"""Types of numeric options: every number of the command line has a range, and is finite unless `inf` means no limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import click

from gradient_routes.problems.errors import InputError

LONGEST = 40  # characters of what was given that an error repeats


class Whole(click.IntRange):
    """Whole numbers from `min` to `max`. Raises InputError, also for what is none."""

    def __init__(self, min: int = 1, max: int = 1_000_000) -> None:
        super().__init__(min, max)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        return int(_within(self, int, value, param, f"a whole number from {self.min} to {self.max}"))


class Real(click.FloatRange):
    """Finite numbers of a range; infinity too where that means `endless`. Raises InputError, also for what is none."""

    def __init__(self, *, endless: bool = False, unit: str = "a number", **bounds: Any) -> None:
        super().__init__(**bounds)
        self.endless, self.unit = endless, unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        low = None if self.min is None else f">{'' if self.min_open else '='} {self.min:g}"
        high = None if self.max is None else f"<{'' if self.max_open else '='} {self.max:g}"
        wanted = f"{self.unit} {' and '.join(bound for bound in (low, high) if bound)}{', or inf' * self.endless}"
        return float(_within(self, float, value, param, wanted))


def _within(
    range: Whole | Real, kind: Callable[[Any], float], value: Any, param: click.Parameter | None, wanted: str
) -> float:
    text = str(value)
    try:
        number = kind(value)
        endless = isinstance(range, Real) and range.endless and text in ("inf", "Infinity")  # 1e400 is a mistake
        inside = "_" not in text and (math.isfinite(number) or endless)
    except (ValueError, OverflowError):
        number, inside = math.nan, False
    below = range.min is not None and (number <= range.min if range.min_open else number < range.min)
    above = range.max is not None and (number >= range.max if range.max_open else number > range.max)
    if not inside or below or above:
        name = param.opts[0] if param is not None and param.opts else "a number"
        given = text[:LONGEST] or "''"
        raise InputError(f"{name} {given} - give {wanted}")
    return number


COUNT = Whole()
MANY = Whole(1, 10**9)
SEED = Whole(0, 2**63 - 1)  # what the store holds
POSITIVE = Real(min=0.0, min_open=True)
FRACTION = Real(min=0.0, min_open=True, max=1.0, max_open=True)
FROM_ZERO = Real(min=0.0, max=1.0, max_open=True)  # a tolerance of 0 is never met, an error of 0 never accepted
SECONDS = Real(min=0.0, min_open=True, unit="seconds", endless=True)
SHORT = Real(min=0.0, max=86_400.0, unit="seconds")
