"""A second point some 5 % away from p, in natural changes: a gradient that is right once may be wrong there."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.lines import inward
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

AWAY = (0.05, 0.005, 0.0005)  # natural changes; the nearer where J has no value farther away


def second_point(subject: Subject, J: Guarded, seed: int) -> Array | None:
    """A point within the bounds at which J has a value, every component moved; None where there is none."""
    for away in AWAY:
        q = _moved(subject, away, seed)
        if J.left() > 1 and subject.inside(q) and np.isfinite(J(q)):
            return q
    return None


def _moved(subject: Subject, away: float, seed: int) -> Array:
    """Half the way to a bound at most, and away from one that is near."""
    rng, n_p = np.random.default_rng(seed + 3), len(subject.p)
    sign = np.where(inward(subject), inward(subject), rng.choice([-1.0, 1.0], n_p))
    step = away * sign * rng.uniform(0.5, 1.5, n_p) * subject.natural
    below, above = subject.p - subject.lower, subject.upper - subject.p
    return np.asarray(subject.p + np.clip(step, -0.5 * below, 0.5 * above))
