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
STAYS = 0.1  # part of what the plateau would make of the segment that the solver leaves


@dataclass(frozen=True)
class Segment:
    """|J(p + T v) - J(p) - integral of g . v|, the larger of T = +-LENGTH, and what the plateau predicts of it."""

    found: float
    predicted: float

    @property
    def by_solver(self) -> bool:
        """Whether the gradient is right over the segment, so that the plateau is of J at p."""
        return self.found <= STAYS * self.predicted


def segment(seen: Examination, reading: Reading) -> Segment | None:
    """Two calls of J, four of the gradient; None where the segment leaves the bounds or a value is missing."""
    assert reading.level is not None
    v, subject = reading.quotients.line.v, seen.subject
    ends = [subject.p + T * v for T in (LENGTH, -LENGTH)]
    if seen.J.left() < len(ends) or not all(map(subject.inside, ends)):
        return None
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    found = []
    for T, end in zip((LENGTH, -LENGTH), ends, strict=True):
        slopes = []
        for t in 0.5 * T * (1.0 + nodes):
            seen.J.account.gradients += 1
            try:
                slopes.append(float(gradient_of(subject.moved(subject.p + t * v)).gradient @ v))
            except Unusable:
                return None
        found.append(abs(seen.J(end) - seen.J_0 - 0.5 * T * float(weights @ slopes)))
    return Segment(max(found), LENGTH * abs(reading.level.value)) if np.isfinite(found).all() else None
