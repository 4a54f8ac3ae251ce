"""Whether a gradient is right on the large scale: J(p + T v) - J(p) against the integral of g . v along the segment.

The difference of a loosely solved J and the integral of a right gradient stays as small as the errors of the two values
of J; that of a wrong gradient grows with T. An error of J that is as smooth as J itself is not told so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.guarded import Unusable, gradient_of
from gradient_routes.bench.verification.reading import Reading

LENGTH = 0.05  # natural changes, on both sides of p
NODES = 2  # of Gauss-Legendre: the error in T^4 is small beside a tenth of a plateau
BENDS = 0.1  # change of the slope of J over it, relative to the gradient
STAYS = 0.1  # part of what the plateau would make of the segment that the solver leaves


@dataclass(frozen=True)
class Segment:
    """|J(p + T v) - J(p) - integral of g . v|, the larger of T = +-LENGTH, and what the plateau predicts of it.

    at_p  whether the plateau is there at p alone: the slopes beside p tend to that of J, not to that of the gradient
    """

    found: float
    predicted: float
    at_p: bool = False

    @property
    def by_solver(self) -> bool:
        """Whether the gradient is right over the segment and smooth at p, so that the plateau is of J at p."""
        return self.found <= STAYS * self.predicted and not self.at_p


def segment(seen: Examination, reading: Reading) -> Segment | None:
    """Two calls of J, four of the gradient; None where the segment leaves the bounds or a value is missing."""
    assert reading.level is not None
    v, subject = reading.quotients.line.v, seen.subject
    if reading.truncation(LENGTH) > BENDS * max(reading.size, abs(reading.slope + reading.level.value)):
        return None  # J bends too much on the way
    ends = [subject.p + T * v for T in (LENGTH, -LENGTH)]
    if seen.J.left() < len(ends) or not all(map(subject.inside, ends)):
        return None
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    found, at, slopes = [], [], []
    for T, end in zip((LENGTH, -LENGTH), ends, strict=True):
        for t in 0.5 * T * (1.0 + nodes):
            seen.J.account.gradients += 1
            try:
                slopes.append(float(gradient_of(subject.moved(subject.p + t * v)).gradient @ v))
            except Unusable:
                return None
            at.append(t)
        found.append(abs(seen.J(end) - seen.J_0 - 0.5 * T * float(weights @ slopes[-NODES:])))
    if not np.isfinite(found).all():
        return None
    limit = float(np.polynomial.Polynomial.fit(at, slopes, len(at) - 1)(0.0))
    value = reading.level.value
    at_p = abs(limit - (reading.slope + value)) < abs(limit - reading.slope)
    return Segment(max(found), LENGTH * abs(value), at_p)
