"""Somebody's objective, treated as hostile to measurement: counted, copied from, its accidents kept."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

FOREIGN = (Exception, SystemExit, GeneratorExit)  # what code of others may raise
SINGLE = float(np.finfo(np.float32).eps)
DISTINCT = 5  # values that are no round numbers, which fit into float16 and tell nothing
DOUBLE = float(np.finfo(np.float64).eps)


class Spent(Exception):
    """The budget of objective calls is used up."""


@dataclass(frozen=True)
class Accident:
    """A point where J is no finite number, and what was said there."""

    p: Array
    what: str


@dataclass
class Account:
    """Calls made of what may be made, shared by an objective and its tightened and refined relatives."""

    budget: float = math.inf
    calls: int = 0
    gradients: int = 0


@dataclass
class Guarded:
    """objective(p) as a float, NaN where it raises or returns no finite real number.

    It gets a copy of p, so that changing it harms nobody; `mutates` tells of it.
    Raises Spent beyond the account's budget.
    """

    objective: Callable[[Array], Any]
    account: Account = field(default_factory=Account)
    accidents: list[Accident] = field(default_factory=list)
    mutates: bool = False
    _single: bool = True
    _values: set[float] = field(default_factory=set)

    def __call__(self, p: Array) -> float:
        if self.left() < 1:
            raise Spent
        self.account.calls += 1
        given = p.copy()
        try:
            with np.errstate(all="ignore"):
                value = number(self.objective(given))
        except FOREIGN as failure:
            self._accident(p, f"{type(failure).__name__}: {' '.join(str(failure).split())}")
            return math.nan
        self.mutates |= not np.array_equal(given, p)
        if not math.isfinite(value):
            self._accident(p, f"J = {value}")
            return math.nan
        with np.errstate(over="ignore"):
            self._single &= float(np.float32(value)) == value
            if len(self._values) < DISTINCT and float(np.float16(value)) != value:
                self._values.add(value)
        return value

    def sharing(self, objective: Callable[[Array], Any]) -> Guarded:
        """A relative on the same account."""
        return Guarded(objective, self.account, self.accidents)

    def left(self) -> float:
        """Calls still to be had."""
        return self.account.budget - self.account.calls

    @property
    def eps(self) -> float:
        """The epsilon of its numbers: float32's where many different ones all fit into it."""
        return SINGLE if self._single and len(self._values) == DISTINCT else DOUBLE

    def _accident(self, p: Array, what: str) -> None:
        self.accidents.append(Accident(p.copy(), what))


def number(value: Any) -> float:
    """A real number out of a scalar of any array library. Raises TypeError."""
    array = np.asarray(plain(value))
    if array.size != 1 or array.dtype.kind not in "fiub":
        raise TypeError(f"objective gave {array.dtype} of shape {array.shape}, not one real number")
    return float(array.reshape(()))


def plain(value: Any) -> Any:
    """An array that NumPy understands: PyTorch's are detached from their tape first."""
    detach = getattr(value, "detach", None)
    return detach().cpu() if callable(detach) else value
