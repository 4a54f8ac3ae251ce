"""The value that difference quotients keep over a range of steps, with its uncertainty."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

import numpy as np

from gradient_routes.problems.problem import Array

DECADE, NEARLY = 10.0 * (1.0 + 1e-9), 0.8  # steps are rounded, and need not divide a decade
FEWEST = 3  # points of a range
NOISE = 3.0  # standard deviations
SLOWEST = 0.95  # largest ratio of successive differences that is distinguished from 1
DIFFERENT = 3.0  # uncertainties by which two ranges contradict each other


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

    def contradicts(self, other: Level) -> bool:
        return abs(self.value - other.value) > DIFFERENT * (self.uncertainty + other.uncertainty)


def level(h: Array, q: Array, noise: float, tolerable: float) -> Level | None:
    """The limit h -> 0 of quotients q (m,), NaN where unknown, whose noise is `noise` / h.

    The range of one decade with the least variation, noise included. A range of smaller steps that contradicts it
    replaces it if its uncertainty is at most `tolerable`: the derivative is the limit of small steps, and a kink
    between p and a larger step does not belong to it.
    """
    found = list(levels(h, q, noise))
    best = min(found, key=lambda a: a.uncertainty, default=None)
    while best is not None:
        nearer = [a for a in found if a.h_max < best.h_max and a.uncertainty <= tolerable and a.contradicts(best)]
        if not nearer:
            break
        best = min(nearer, key=lambda a: a.uncertainty)
    return best


def levels(h: Array, q: Array, noise: float) -> Iterator[Level]:
    """The median of every range of one decade; with five points or more the farthest from it is ignored.

    On lists: the ranges are of a few points each, and there are many.
    """
    known = np.isfinite(q)
    steps, quotients = h[known].tolist(), q[known].tolist()
    for first, h_min in enumerate(steps):
        last = bisect_right(steps, DECADE * h_min)
        if last - first < FEWEST or steps[last - 1] < NEARLY * DECADE * h_min:
            continue
        values = quotients[first:last]
        middle = median(values)
        off = sorted(abs(value - middle) for value in values)
        spread = (off[-2] if len(off) >= 5 else off[-1]) * _extrapolation(values)
        yield Level(middle, spread + NOISE * noise / h_min, h_min, steps[last - 1])


def _extrapolation(values: list[float]) -> float:
    """By how much the quotients may still change as h -> 0, in units of their spread.

    A geometric series where they are monotone and their differences shrink slowly, as those of |p|^1.1; else 1.
    """
    steps = [b - a for a, b in pairwise(values)]
    if not (min(steps) > 0 or max(steps) < 0):
        return 1.0
    ratio = float(abs(steps[0] / steps[-1]) ** (1.0 / (len(steps) - 1)))
    return 1.0 / (1.0 - min(ratio, SLOWEST))
