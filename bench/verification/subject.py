"""What is checked: an objective and a gradient at a point, whoever wrote them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.bench.verification.finding import Finding
from gradient_routes.problems.problem import Array, default_label


@dataclass(frozen=True)
class Subject:
    """J and dJ/dp at p (n_p,), and what else the author offers.

    objective   p -> J(p), a number; gradient: p -> (n_p,)
    scale       (n_p,) > 0, natural changes: steps are relative to max(|p_i|, scale_i); NaN: to be found from J
    lower, upper (n_p,) bounds of p; `closed` tells whether J is defined on them
    label       name of component i
    tighten     factor < 1 -> the same subject, its solver tolerance times that
    scaled      factor -> the same subject, J times that
    fresh       p -> J(p), computed anew by other means than objective and gradient share
    active_set  p -> a hashable that names the smooth branch of J at p
    refine      () -> the same subject on a mesh of half the size
    exact       () -> dJ/dp (n_p,) by the adjoint method, for comparison
    slopes      V (n_p, m) -> V^T dJ/dp by complex steps
    explain     gradient -> findings on the factors of the gradient
    again       q -> the same subject at another point, with all that is known of it there
    accuracy    error that the gradient has by its nature, as one by finite differences, relative to |g w| or J
    notes       what was assumed or left out
    places      (n_p,) the author's own indices of the components; None where they are these
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
    scaled: Callable[[float], Subject] | None = None
    fresh: Callable[[Array], Any] | None = None
    active_set: Callable[[Array], Hashable] | None = None
    refine: Callable[[], Subject | None] | None = None
    exact: Callable[[], Array] | None = None
    slopes: Callable[[Array], Array] | None = None
    explain: Callable[[Array], list[Finding]] | None = None
    again: Callable[[Array], Subject] | None = None
    accuracy: float = 0.0
    notes: tuple[str, ...] = ()
    places: Array | None = None

    def moved(self, q: Array) -> Subject:
        """The same subject at another point; without `again`, what is known at p alone does not go with it."""
        if self.again is not None:
            return self.again(q)
        tighten = self.tighten
        tightened = None if tighten is None else lambda factor: tighten(factor).moved(q)
        return replace(self, p=q, tighten=tightened, refine=None, exact=None, slopes=None, explain=None, scaled=None)

    @property
    def natural(self) -> Array:
        """w (n_p,): the change of each component at a relative step of 1."""
        return np.asarray(np.maximum(np.abs(self.p), self.scale))

    def inside(self, q: Array) -> bool:
        """Whether J is defined at q."""
        if self.closed:
            return bool(((q >= self.lower) & (q <= self.upper)).all())
        return bool(((q > self.lower) & (q < self.upper)).all())
