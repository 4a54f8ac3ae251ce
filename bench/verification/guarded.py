"""Calls of user code: objective and gradient as numbers, counted, with everything unusual about them on record."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Array
from gradient_routes.problems.text import shortened

FOREIGN = (Exception, SystemExit, GeneratorExit)  # what user code may raise
SINGLE, DOUBLE = (float(np.finfo(kind).eps) for kind in (np.float32, np.float64))
VALUES, COMPONENTS = 5, 3  # numbers that need more digits than float16 has, before a precision is concluded


class Spent(Exception):
    """The budget of objective calls is used up."""


class Unusable(RoutesError):
    """No gradient was returned; `wrong` tells a gradient that is invalid from one that could not be computed."""

    def __init__(self, message: str, wrong: bool) -> None:
        super().__init__(message)
        self.wrong = wrong


@dataclass(frozen=True)
class Accident:
    """A point without a finite J, and the reason."""

    p: Array
    what: str


@dataclass
class Account:
    """Calls made, allowed, and kept for later; shared by an objective and its tightened and refined versions."""

    budget: float = math.inf
    kept: int = 0
    calls: int = 0
    gradients: int = 0


@dataclass
class Guarded:
    """objective(p) as a float; NaN where it raises or returns no finite real number.

    It gets a copy of p; `mutates` tells whether it changes that in place. Raises Spent beyond the budget.
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
            value = number(self.objective(given))
        except FOREIGN as failure:
            return self._nothing(p, one_line(failure))
        self.mutates |= not (given == p).all()
        if not math.isfinite(value):
            return self._nothing(p, f"J = {value}")
        if self._single:
            self._look_at_precision(value)
        return value

    def _look_at_precision(self, value: float) -> None:
        with np.errstate(over="ignore"):
            self._single = float(np.float32(value)) == value
            if len(self._values) < VALUES and float(np.float16(value)) != value:
                self._values.add(value)

    def sharing(self, objective: Callable[[Array], Any]) -> Guarded:
        """Another objective on the same account."""
        return Guarded(objective, self.account, self.accidents)

    def left(self) -> float:
        """Calls left, those that are kept for later aside."""
        return self.account.budget - self.account.kept - self.account.calls

    @property
    def eps(self) -> float:
        """Machine epsilon of its values: that of float32 where several different ones are all float32 numbers."""
        return SINGLE if self._single and len(self._values) == VALUES else DOUBLE

    def _nothing(self, p: Array, why: str) -> float:
        self.accidents.append(Accident(p.copy(), why))
        return math.nan


@dataclass(frozen=True)
class Returned:
    """gradient (n_p,) float64; eps of the precision it was computed in; remarks on anything unusual."""

    gradient: Array
    eps: float
    remarks: tuple[str, ...]


def gradient_of(subject: Subject) -> Returned:
    """dJ/dp at subject.p, called once. Raises Unusable."""
    given, n_p = subject.p.copy(), len(subject.p)
    try:
        with np.errstate(all="ignore"):
            raw = np.asarray(detached(subject.gradient(given)))
    except FOREIGN as failure:
        raise Unusable(f"the gradient raises {one_line(failure)}", wrong=False) from failure
    if np.iscomplexobj(raw) or raw.dtype.kind not in "fiu":
        raise Unusable(f"the gradient is an array of {raw.dtype}, not of real numbers", wrong=True)
    if raw.size != n_p or (raw.ndim > 1 and raw.shape not in ((n_p, 1), (1, n_p))):
        raise Unusable(f"the gradient has the shape {raw.shape} for {n_p} parameters", wrong=True)
    gradient = raw.reshape(n_p).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(gradient))
    if bad.size:
        first = f"{subject.label(int(bad[0]))}: {gradient[bad[0]]}"
        raise Unusable(f"{bad.size} of {n_p} components of the gradient are not finite, first {first}", wrong=True)
    remarks, eps = [], precision(raw, gradient)
    if not np.array_equal(given, subject.p):
        remarks.append("the gradient changes p in place: it was given a copy")
    if raw.ndim != 1:
        remarks.append(f"the gradient has the shape {raw.shape}: read as ({n_p},)")
    if eps != DOUBLE:
        kind = f"is {raw.dtype}" if raw.dtype.itemsize < 8 else "holds float32 numbers"
        remarks.append(f"the gradient {kind}: judged with eps = {eps:.2g}")
    return Returned(gradient, eps, tuple(remarks))


def precision(raw: Any, gradient: Array) -> float:
    """The epsilon of the gradient's type, or that of float32 where all its numbers are float32 numbers.

    Short numbers such as 0.5 or 3 fit into float16 as well and prove nothing.
    """
    if raw.dtype.kind == "f" and raw.dtype.itemsize < 8:
        return max(SINGLE, float(np.finfo(raw.dtype).eps))
    with np.errstate(over="ignore"):
        fits = (gradient.astype(np.float32) == gradient).all()
        long = np.count_nonzero(gradient.astype(np.float16) != gradient)
    return SINGLE if fits and long >= COMPONENTS else DOUBLE


def number(value: Any) -> float:
    """A real number from a scalar of any array library. Raises TypeError."""
    array = np.asarray(detached(value))
    if array.size != 1 or array.dtype.kind not in "fiub":
        raise TypeError(f"the objective returned {array.dtype} of shape {array.shape}, not one real number")
    return float(array.reshape(()))


def detached(value: Any) -> Any:
    """The value itself, or a PyTorch tensor without its graph, which NumPy can convert."""
    detach = getattr(value, "detach", None)
    return detach().cpu() if callable(detach) else value


def one_line(failure: BaseException) -> str:
    """Type and message."""
    return f"{type(failure).__name__}: {' '.join(shortened(str(failure)).split())}"
