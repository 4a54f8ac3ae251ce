"""Where two lines t = fixed + each m cross, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.studies.scaling.power_law import CONFIDENCE
from gradient_routes.problems.problem import Array

FEWEST = 3  # points of a line that knows its errors


@dataclass(frozen=True)
class CostLine:
    """t = fixed + each m, the covariance (2, 2) of the two, and the degrees of freedom that is known with."""

    fixed: float
    each: float
    covariance: Array
    freedom: int

    def __call__(self, m: float) -> float:
        return self.fixed + self.each * m


@dataclass(frozen=True)
class Crossing:
    """m at which the lines meet, be it below 1 or 0, with its interval; None where the slopes are not told apart."""

    at: float | None
    low: float | None = None
    high: float | None = None


def line(m: Sequence[float], t: Sequence[float]) -> CostLine:
    """Least squares of relative errors through at least FEWEST points, with a slope >= 0.

    No parameter costs less than nothing: a slope that noise makes negative is 0, which errs by less, and the covariance
    remains that of the fit without this knowledge.
    """
    times = np.asarray(t, dtype=np.float64)
    A = np.column_stack([np.ones_like(times), m]) / times[:, None]
    (fixed, each), *_ = np.linalg.lstsq(A, np.ones_like(times), rcond=None)
    freedom = len(times) - 2
    left = A @ (fixed, each) - 1.0
    covariance = np.linalg.inv(A.T @ A) * (left @ left) / freedom
    if each < 0.0:
        fixed, each = A[:, 0].sum() / (A[:, 0] @ A[:, 0]), 0.0
    return CostLine(float(fixed), float(each), covariance, freedom)


def exact(fixed: float, each: float) -> CostLine:
    """A line known without errors."""
    return CostLine(fixed, each, np.zeros((2, 2)), 1)


def crossing(first: CostLine, second: CostLine) -> Crossing:
    """The m that a test at the level of CONFIDENCE does not exclude as the crossing (Fieller 1954).

    The errors of the two are taken as independent, with the fewer degrees of freedom of both.
    """
    from scipy.stats import t

    a, b = first.fixed - second.fixed, first.each - second.each
    tt = float(t.ppf(0.5 + CONFIDENCE / 2, min(first.freedom, second.freedom))) ** 2
    (v_aa, v_ab), (_, v_bb) = first.covariance + second.covariance
    # (a + b m)^2 <= t^2 (v_aa + 2 v_ab m + v_bb m^2)
    square, half, rest = b * b - tt * v_bb, a * b - tt * v_ab, a * a - tt * v_aa
    if square <= 0.0:
        return Crossing(None)
    root = np.sqrt(max(half * half - square * rest, 0.0))
    high = float((-half + root) / square)
    return Crossing(-a / b + 0.0, float((-half - root) / square), high)


def cheaper(names: tuple[str, str], lines: tuple[CostLine, CostLine], m_measured: float) -> str:
    """Who is cheaper where, in words; from m = 1 on."""
    first, second = lines
    if not _told_apart(*lines):
        return _parallel(names, lines, m_measured)
    few, many = (int(first(1.0) > second(1.0)), int(first.each > second.each))
    met = crossing(first, second).at
    if few == many or met is None or met <= 1.0:
        return f"{names[many]} is cheaper from the first parameter on"
    return f"{names[many]} is cheaper from n_p = {int(np.floor(met)) + 1} on"


def _told_apart(first: CostLine, second: CostLine) -> bool:
    from scipy.stats import t

    limit = float(t.ppf(0.5 + CONFIDENCE / 2, min(first.freedom, second.freedom)))
    variance = float((first.covariance + second.covariance)[1, 1])
    return bool(abs(first.each - second.each) > limit * np.sqrt(variance))


def _parallel(names: tuple[str, str], lines: tuple[CostLine, CostLine], m: float) -> str:
    first, second = lines
    name = names[int(first(m) > second(m))]
    return f"not told apart by what a parameter costs; at n_p = {m:.3g} {name} is cheaper"
