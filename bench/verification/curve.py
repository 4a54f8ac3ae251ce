"""A V-curve: the error of difference quotients over the step, truncation error at large h and round-off at small h."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.problem import Array

ASYMPTOTIC = 0.05  # relative error above which truncation does not follow its power law yet
CLEAR = 10.0  # times the floor: errors above belong to one branch only
USEFUL = 1e-3  # relative error of a usable step
FEWEST = 4  # points of a branch
NEIGHBOURS = 3  # points whose median is the floor: one small error by chance does not count


@dataclass(frozen=True)
class Curve:
    """Properties of a V-curve; None where the data do not show them.

    floor      least relative error, median of three neighbours, at least what the noise of J predicts
    best_step  relative step of the floor
    slope      of log error over log step on the truncation branch: 1 one-sided, 2 central
    roundoff   slope of the round-off branch: -1
    window     decades of steps around the best one with errors below 1e-3
    """

    floor: float | None = None
    best_step: float | None = None
    slope: float | None = None
    roundoff: float | None = None
    window: float = 0.0


def fit(h: Array, error: Array, noise: float) -> Curve:
    """The properties of relative errors (m,) at steps h (m,), NaN where unknown; `noise` / h is the noise of J."""
    known = np.isfinite(error)
    h, error = h[known], error[known]
    if len(h) < NEIGHBOURS:
        return Curve()
    medians = np.array([np.median(error[k : k + NEIGHBOURS]) for k in range(len(h) - NEIGHBOURS + 1)])
    middle = h[NEIGHBOURS // 2 :][: len(medians)]
    expected = np.maximum(medians, noise / middle)  # an error of zero at a tiny step is chance
    floor, best = float(expected.min()), float(middle[expected.argmin()])
    branch = (error > CLEAR * floor) & (error > 0.0) & (error < ASYMPTOTIC)
    truncation, roundoff = (slope(h, error, branch & side) for side in (h > best, h < best))
    window = _window(h, error <= USEFUL, int(np.abs(np.log10(h / best)).argmin()))
    return Curve(floor, best, truncation, roundoff, window)


def _window(h: Array, useful: Array, best: int) -> float:
    """Decades of the contiguous useful steps around the best one."""
    if not useful[best]:
        return 0.0
    useless = np.flatnonzero(~useful)
    first = max(useless[useless < best], default=-1) + 1
    last = min(useless[useless > best], default=len(h)) - 1
    return float(np.log10(h[last] / h[first]))


def slope(h: Array, error: Array, branch: Array) -> float | None:
    """Median slope of all pairs of points at least half a decade apart (Theil 1950, Sen 1968); None for few points."""
    if np.count_nonzero(branch) < FEWEST:
        return None
    x, y = np.log10(h[branch]), np.log10(error[branch])
    i, j = np.triu_indices(len(x), 1)
    apart = x[j] - x[i] >= 0.5 - 1e-9
    return float(np.median((y[j] - y[i])[apart] / (x[j] - x[i])[apart])) if apart.any() else None
