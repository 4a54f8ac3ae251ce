"""What is checked: an objective and a gradient at a point, whoever wrote them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.bench.verification.finding import Finding
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, default_label

Slopes = Callable[[Array], Array]


@dataclass(frozen=True)
class Subject:
    """J and dJ/dp at p (n_p,), and what else their author offers.

    objective   p -> J(p), a number; gradient: p -> (n_p,)
    scale       (n_p,) > 0, natural changes: steps are relative to max(|p_i|, scale_i)
    lower, upper (n_p,) bounds of p; `closed` tells whether J may be asked for on them
    label       name of component i
    tighten     factor < 1 -> the same subject, its solver's tolerance times that
    active_set  p -> which smooth branch of J holds there
    refine      () -> the same subject on a mesh of half the size
    exact       () -> dJ/dp (n_p,) by the adjoint method, for comparison only
    slopes      V (n_p, m) -> V^T dJ/dp by complex steps, which need no step size
    explain     gradient -> findings on the factors it is made of
    accuracy    error that the gradient may have by its nature, as one by finite differences has, relative to |g w| or J
    """

    name: str
    objective: Callable[[Array], Any]
    gradient: Callable[[Array], Any]
    p: Array
    scale: Array
    lower: Array
    upper: Array
    closed: bool = True
    label: Callable[[int], str] = default_label
    tighten: Callable[[float], Subject] | None = None
    active_set: Callable[[Array], Hashable] | None = None
    refine: Callable[[], Subject | None] | None = None
    exact: Callable[[], Array] | None = None
    slopes: Slopes | None = None
    explain: Callable[[Array], list[Finding]] | None = None
    accuracy: float = 0.0

    @property
    def natural(self) -> Array:
        """w (n_p,): the change of each component that a relative step of 1 stands for."""
        return np.asarray(np.maximum(np.abs(self.p), self.scale))

    def inside(self, q: Array) -> bool:
        """Whether J may be asked for at q."""
        if self.closed:
            return bool(((q >= self.lower) & (q <= self.upper)).all())
        return bool(((q > self.lower) & (q < self.upper)).all())


def natural_scale(p: Array) -> Array:
    """Where nobody says what a natural change is: |p_i|, and for zeros the median of the others, or 1."""
    size = np.abs(p)
    others = size[size > 0]
    return np.where(size > 0, size, np.median(others) if others.size else 1.0)


def vector(values: Any, n_p: int | None, what: str) -> Array:
    """(n_p,) finite float64 from what a user gave, copied. Raises InputError."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"check: {what} is no array of real numbers ({error}) - give one of length n_p") from error
    if array.ndim == 0 and n_p is not None:
        array = np.full(n_p, float(array))
    if array.ndim != 1 or array.size == 0 or (n_p is not None and array.size != n_p):
        wanted = "a vector" if n_p is None else f"{n_p} of them"
        raise InputError(f"check: {what} has the shape {array.shape} - give {wanted}")
    if np.isnan(array).any():
        raise InputError(f"check: {what}[{int(np.flatnonzero(np.isnan(array))[0])}] is NaN - give numbers")
    return array
