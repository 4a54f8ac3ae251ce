"""The noise of an objective, estimated from values it has already returned."""

from __future__ import annotations

import math
from statistics import median

import numpy as np

from gradient_routes.bench.verification.quotients import Quotients
from gradient_routes.problems.problem import Array

WINDOW = 5  # steps per running median: one outlier changes nothing
NORMAL = 0.6745  # median of |x| for x standard normal
REPRESENTABLE = 0.29  # standard deviation of rounding to the nearest number, in eps


def noise(q: Quotients, eps: float, repeated: Array) -> float:
    """Standard deviation of one evaluation of J near p: the largest of three estimates.

    - The second difference J(p + h) - 2 J(p) + J(p - h) is truncation error at large h and has the variance 6 sigma^2
      at small h (Hamming 1973, chapter 6; More & Wild 2011). The least of its running medians tells the steps at which
      it is noise; the median over these and all smaller ones is used, for the least of several is too small.
    - The standard deviation of `repeated` evaluations at p.
    - The rounding of J: the spacing of floating-point numbers, or, where some step leaves J unchanged, the least
      distance between two values seen, which is larger where J is printed or cancels.
    """
    second = np.abs(q.jump * q.h)
    if not q.two_sided:  # one side only: subtract the slope predicted by the gradient instead
        second = np.abs(q.off_forward * q.h) * np.sqrt(3.0)
    known = second[np.isfinite(second)].tolist()
    count = min(WINDOW, len(known))
    medians = [median(known[k : k + count]) for k in range(len(known) - count + 1)] if count > 2 else []
    least = min(medians, default=0.0)
    typical = max(least, median(known[: medians.index(least) + count])) if medians else 0.0
    scatter = float(np.std(repeated, ddof=1)) if len(repeated) > 1 else 0.0
    seen = np.concatenate([q.J_plus, q.J_minus, [q.J]])
    gaps = np.diff(np.unique(seen[np.isfinite(seen)]))
    unchanged = np.count_nonzero(seen == q.J) > 1  # J itself is one of them
    rounding = REPRESENTABLE * max(eps * abs(q.J), float(gaps.min()) if gaps.size and unchanged else 0.0)
    return max(typical / (NORMAL * math.sqrt(6.0)), scatter, rounding)
