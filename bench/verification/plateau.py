"""The number that difference quotients settle on over a range of steps, and how well they know it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.problem import Array

DECADE, NEARLY = 10.0 * (1.0 + 1e-9), 0.8  # steps are rounded, and need not divide a decade
AT_LEAST = 3  # points that make a range
NOISE = 3.0  # standard deviations
SLOWEST = 0.95  # ratio of successive differences that is told from none
DIFFERENT = 3.0  # uncertainties, of two ranges that contradict each other


@dataclass(frozen=True)
class Level:
    """value +- uncertainty, of steps from h_min to h_max."""

    value: float
    uncertainty: float
    h_min: float
    h_max: float

    @property
    def h(self) -> float:
        return math.sqrt(self.h_min * self.h_max)


def level(h: Array, q: Array, noise: float, tolerable: float) -> Level | None:
    """The limit h -> 0 of quotients q (m,), NaN where there are none, whose noise is `noise` / h.

    Of all ranges of a decade the one whose quotients vary least, noise included. A range of smaller steps that
    contradicts it takes its place, if it knows its own value to `tolerable`: a derivative is a limit, and what lies
    between p and a larger step, a kink say, is no part of it.
    """
    found = list(levels(h, q, noise))
    if not found:
        return None
    best = min(found, key=lambda a: a.uncertainty)
    while True:
        nearer = [a for a in found if a.h_max < best.h_max and a.uncertainty <= tolerable and _differ(a, best)]
        if not nearer:
            return best
        best = min(nearer, key=lambda a: a.uncertainty)


def levels(h: Array, q: Array, noise: float) -> Iterator[Level]:
    """Every range of a decade: its median; the point that is farthest off is forgiven where there are five."""
    known = np.isfinite(q)
    h, q = h[known], q[known]
    for first, h_min in enumerate(h):
        last = int(np.searchsorted(h, DECADE * h_min, side="right"))
        if last - first < AT_LEAST or h[last - 1] < NEARLY * DECADE * h_min:
            continue
        values = q[first:last]
        middle = float(np.median(values))
        off = np.sort(np.abs(values - middle))
        spread = float(off[-2] if len(off) >= 5 else off[-1]) * _beyond(values)
        yield Level(middle, spread + NOISE * noise / float(h_min), float(h_min), float(h[last - 1]))


def _beyond(values: Array) -> float:
    """How much farther than they spread quotients may still go as h -> 0: a geometric series, where they all go one
    way and their differences shrink slowly, as those of |p|^1.1 do."""
    steps = np.diff(values)
    if not ((steps > 0).all() or (steps < 0).all()):
        return 1.0
    ratio = abs(steps[0] / steps[-1]) ** (1.0 / (len(steps) - 1))
    return float(1.0 / (1.0 - min(ratio, SLOWEST)))


def _differ(a: Level, b: Level) -> bool:
    return abs(a.value - b.value) > DIFFERENT * (a.uncertainty + b.uncertainty)
