"""How a quantity grows: y = constant + prefactor x^exponent, exactly where counts allow it, else with confidence.

At small sizes the interpreter is measured, not the method. Where there are four sizes or more, a constant c is fitted
along, y = c + a x^k in relative errors. Sizes at which c is more than a tenth of y are left out, c is taken from the
others, and those give the exponent: least squares of logarithms, its interval by Student's t with two degrees of
freedom less than points. It holds for the sizes fitted, and for errors that are alike and independent in log y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np

from gradient_routes.problems.problem import Array

FEWEST = 3  # points of a fit
CONFIDENCE = 0.95
OVERHEAD = 0.1  # share of a constant in y from which a size does not show how y grows
FLAT = 2.0  # growth of y over all sizes below which slow growth and a constant look the same
LARGEST = 4.0  # exponent looked for


@dataclass(frozen=True)
class Fit:
    """The law over `points` sizes from `fitted_from` to `fitted_to`; without one, the reason."""

    law: Literal["affine", "power"] | None = None
    no_law: str | None = None
    exponent: float | None = None
    exponent_low: float | None = None
    exponent_high: float | None = None
    prefactor: float | None = None
    constant: float | None = None
    points: int = 0
    fitted_from: float | None = None
    fitted_to: float | None = None
    fit_residual: float | None = None


def fit(x: Sequence[float], y: Sequence[float], counted: bool = False) -> Fit:
    """The law of y over x, both > 0, in any order; `counted`: whole numbers without errors, which may be 0."""
    if len(set(x)) < FEWEST:
        known = len(set(x))
        return Fit(no_law=f"{known} size{'s' * (known != 1)}, {FEWEST} are needed", points=len(x))
    order = np.argsort(x, kind="stable")
    sizes, values = np.asarray(x, dtype=np.float64)[order], np.asarray(y, dtype=np.float64)[order]
    exact = affine([x[i] for i in order], [y[i] for i in order]) if counted else None
    return exact or power(sizes, values)


def affine(x: Sequence[float], y: Sequence[float]) -> Fit | None:
    """y = constant + prefactor x through every point, in exact arithmetic; None where there is no such line."""
    xs, ys = [Fraction(v) for v in x], [Fraction(v) for v in y]
    slope = (ys[-1] - ys[0]) / (xs[-1] - xs[0])
    constant = ys[0] - slope * xs[0]
    if any(constant + slope * a != b for a, b in zip(xs, ys, strict=True)):
        return None
    k = float(slope != 0)
    return Fit("affine", None, k, k, k, float(slope), float(constant), len(x), float(x[0]), float(x[-1]), 0.0)


def power(x: Array, y: Array) -> Fit:
    """Least squares in logarithms where y is no longer overhead; x ascending."""
    from scipy.stats import linregress, t

    growth = y.max() / y.min() if y.min() > 0.0 else np.inf
    if not FLAT <= growth < np.inf:
        return Fit(no_law=f"grows x {growth:.2g} only over {len(x)} sizes", points=len(x))
    c = overhead(x, y) if len(x) > FEWEST else 0.0
    used = c <= OVERHEAD * y
    if used.sum() < FEWEST:
        seen = f"overhead is more than {100 * OVERHEAD:.0f} % at {(~used).sum()} of {len(x)} sizes"
        return Fit(no_law=seen, constant=c, points=int(used.sum()))
    c = 0.0 if used.all() else c
    sizes, values = x[used], y[used] - c
    line = linregress(np.log(sizes), np.log(values))
    within = float(t.ppf(0.5 + CONFIDENCE / 2, len(sizes) - 2)) * line.stderr
    prefactor = float(np.exp(line.intercept))
    off = np.abs((c + prefactor * sizes**line.slope) / y[used] - 1.0).max()
    return Fit(
        "power",
        None,
        float(line.slope),
        float(line.slope - within),
        float(line.slope + within),
        prefactor,
        float(c),
        len(sizes),
        float(sizes[0]),
        float(sizes[-1]),
        float(off),
    )


def overhead(x: Array, y: Array) -> float:
    """c >= 0 of y = c + a x^k, least squares of relative errors."""
    from scipy.optimize import minimize_scalar

    exponents = np.linspace(0.05, LARGEST, 80)
    nearest = min(exponents, key=lambda k: _constant_and_misfit(x, y, k)[1])
    step = exponents[1] - exponents[0]
    bounds = (max(nearest - step, 0.5 * step), nearest + step)
    k = minimize_scalar(lambda k: _constant_and_misfit(x, y, k)[1], bounds=bounds, method="bounded").x
    return _constant_and_misfit(x, y, k)[0]


def _constant_and_misfit(x: Array, y: Array, k: float) -> tuple[float, float]:
    from scipy.optimize import nnls

    shares = np.column_stack([1.0 / y, (x / x[-1]) ** k / y])
    (constant, _), misfit = nnls(shares, np.ones_like(y))
    return float(constant), float(misfit)
