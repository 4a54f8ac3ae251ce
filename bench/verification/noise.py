"""The noise of an objective, from values it has already given."""

from __future__ import annotations

import math

import numpy as np

from gradient_routes.bench.verification.line import Sweep
from gradient_routes.problems.problem import Array

WINDOW = 5  # steps whose median second difference is taken: one dead or lucky point decides nothing
NORMAL = 0.6745  # median of |x| for x standard normal
REPRESENTABLE = 0.29  # standard deviation of rounding to the nearest number, in eps


def noise(sweep: Sweep, eps: float, repeated: Array) -> float:
    """Standard deviation of one evaluation of J near p.

    The second difference J(p + h) - 2 J(p) + J(p - h) is truncation where h is large and has the variance 6 sigma^2
    where it is small (Hamming 1973, chapter 6; More & Wild 2011): the least of its running medians counts. Or, if that
    is more, what `repeated` evaluations at p scatter by, or the rounding of J: to the spacing of floating-point
    numbers, or, where steps leave J as it is to the last digit, to the least distance between any two values seen:
    that is larger where J is printed or cancels.
    """
    second = np.abs(sweep.jump * sweep.h)
    if not sweep.two_sided:  # a step is lost to the slope, which the gradient predicts
        second = np.abs(sweep.off_forward * sweep.h) * np.sqrt(3.0)
    visible = second[np.isfinite(second)]
    count = min(WINDOW, len(visible))
    medians = [np.median(visible[k : k + count]) for k in range(len(visible) - count + 1)] if count > 2 else [0.0]
    scatter = float(np.std(repeated, ddof=1)) if len(repeated) > 1 else 0.0
    seen = np.concatenate([sweep.J_plus, sweep.J_minus, [sweep.J]])
    gaps = np.diff(np.unique(seen[np.isfinite(seen)]))
    still = np.count_nonzero(seen == sweep.J) > 1  # J itself is one of them
    rounding = REPRESENTABLE * max(eps * abs(sweep.J), float(gaps.min()) if gaps.size and still else 0.0)
    return max(float(min(medians)) / (NORMAL * math.sqrt(6.0)), scatter, rounding)
