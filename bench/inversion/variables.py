"""Optimization variables x of size one: p = T(x), with the units of the problem, positive on request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Parameters

Positive = Literal["none", "log", "softplus"]
DECADES = 3.0  # range of natural changes or of data above which the user is warned


@dataclass(frozen=True)
class Variables:
    """p = s x, or p = s exp(x), or p = s log(1 + exp(x)), with s (n_p,) the natural changes of p at the start."""

    scale: Array
    positive: Positive = "none"

    @classmethod
    def of(cls, parameters: Parameters, p: Array, positive: Positive, who: str) -> Variables:
        """Raises InputError where p cannot be kept positive."""
        if positive == "none":
            return cls(parameters.scale)
        if not ((p > 0.0).all() and (np.broadcast_to(parameters.lower, p.shape) <= 0.0).all()):
            raise InputError(
                f"{who}: --positive {positive} with a start of {p.min():g} - it is for parameters > 0; a log field is"
                " positive already"
            )
        return cls(np.abs(p), positive)

    def p(self, x: Array) -> Array:
        if self.positive == "log":
            return np.asarray(self.scale * np.exp(x))
        return np.asarray(self.scale * (np.logaddexp(0.0, x) if self.positive == "softplus" else x))

    def x(self, p: Array) -> Array:
        q = p / self.scale
        if self.positive == "log":
            return np.log(q)
        return np.asarray(q + np.log(-np.expm1(-q)) if self.positive == "softplus" else q)

    def slope(self, x: Array) -> Array:
        """dp/dx, (n_p,)."""
        if self.positive == "log":
            return self.p(x)
        return self.scale * (0.5 * (1.0 + np.tanh(0.5 * x))) if self.positive == "softplus" else self.scale

    @property
    def described(self) -> str:
        """The units of x, in words."""
        low, high = float(self.scale.min()), float(self.scale.max())
        size = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        how = {"none": "", "log": ", optimized in log p", "softplus": ", optimized in the argument of softplus"}
        return f"p in units of {size}{how[self.positive]}"

    def warning(self, data: Array | None) -> str | None:
        """What spans decades, and the remedy; None where all sizes are similar."""
        spanned = decades(self.scale)
        if spanned > DECADES:
            return (
                f"natural changes of parameters span {spanned:.1f} decades: an optimizer sees the large ones only -"
                " give Parameters a scale, or use a log parametrization"
            )
        if data is not None and decades(data) > DECADES:
            return (
                f"data span {decades(data):.1f} decades: the small ones do not affect |S u - d|^2 - weight them by"
                " their noise"
            )
        return None


def decades(values: Array) -> float:
    """From the lower quartile of the nonzero sizes to the largest, so that a few small ones do not count."""
    sizes = np.abs(values[values != 0.0])
    return float(np.log10(sizes.max() / np.quantile(sizes, 0.25))) if sizes.size else 0.0
