"""A V-curve: the error of difference quotients against their step, falling by truncation, rising by round-off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.problem import Array

ASYMPTOTIC = 0.05  # relative error above which truncation follows no power law yet
CLEAR = 10.0  # floors above the floor, where a branch is no longer mixed with the other
USEFUL = 1e-3  # relative error of a step that is usable
AT_LEAST = 4  # points of a branch
NEIGHBOURS = 3  # points whose median is the floor: one lucky step is none


@dataclass(frozen=True)
class Curve:
    """What a V-curve shows; None where it does not show it.

    floor      least relative error, of three neighbours and not below what the noise of J predicts
    best_step  relative step there
    slope      of log error over log step on the truncation branch: 1 one-sided, 2 central
    roundoff   the same on the round-off branch: -1
    window     decades of steps about the best one with errors below 1e-3
    """

    floor: float | None
    best_step: float | None
    slope: float | None
    roundoff: float | None
    window: float


def fit(h: Array, error: Array, noise: float) -> Curve:
    """Read a V-curve off relative errors (m,) at steps h (m,), NaN where there are none; `noise` / h is that of J."""
    known = np.isfinite(error)
    h, error = h[known], error[known]
    if len(h) < NEIGHBOURS:
        return Curve(None, None, None, None, 0.0)
    medians = np.array([np.median(error[k : k + NEIGHBOURS]) for k in range(len(h) - NEIGHBOURS + 1)])
    middle = h[NEIGHBOURS // 2 :][: len(medians)]
    expected = np.maximum(medians, noise / middle)  # a lucky zero at a tiny step is no floor
    floor, best = float(expected.min()), float(middle[expected.argmin()])
    branch = (error > CLEAR * floor) & (error > 0.0) & (error < ASYMPTOTIC)
    return Curve(
        floor,
        best,
        slope(h, error, branch & (h > best)),
        slope(h, error, branch & (h < best)),
        _window(h, error <= USEFUL, int(np.abs(np.log10(h / best)).argmin())),
    )


def _window(h: Array, useful: Array, best: int) -> float:
    """Decades of the run of useful steps about the best one."""
    if not useful[best]:
        return 0.0
    first = last = best
    while first > 0 and useful[first - 1]:
        first -= 1
    while last < len(h) - 1 and useful[last + 1]:
        last += 1
    return float(np.log10(h[last] / h[first]))


def slope(h: Array, error: Array, branch: Array) -> float | None:
    """Median slope between all pairs of points at least half a decade apart (Theil 1950, Sen 1968); None of few."""
    if np.count_nonzero(branch) < AT_LEAST:
        return None
    x, y = np.log10(h[branch]), np.log10(error[branch])
    i, j = np.triu_indices(len(x), 1)
    apart = x[j] - x[i] >= 0.5 - 1e-9
    if not apart.any():
        return None
    return float(np.median((y[j] - y[i])[apart] / (x[j] - x[i])[apart]))
