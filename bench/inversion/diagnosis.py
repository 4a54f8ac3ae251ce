"""Why an optimizer makes no progress: J is at its minimum, or its gradient is not that of J."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bench.inversion.objective import OUTSIDE, Objective
from problems.problem import Array

STEPS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)  # of x, which is of size one
AT_MINIMUM = "J cannot be told apart from its minimum"
DISAGREE = 1e-2  # relative difference of slopes that no such difference explains


@dataclass(frozen=True)
class Slopes:
    """Along a direction v: what the gradient promises, what differences of J say, and how well they know."""

    promised: float
    found: float
    uncertain: float

    @property
    def disagree(self) -> bool:
        return abs(self.promised - self.found) > DISAGREE * abs(self.found) + 3.0 * self.uncertain


def slopes(objective: Objective) -> Slopes:
    """Along the steepest descent that the gradient knows, from the last accepted step: ten forward solves.

    Two neighbouring steps whose central differences agree best tell the slope, and by how much they differ how well.
    """
    last = objective.accepted
    assert last is not None
    size = float(np.linalg.norm(last.by_x))
    v = -last.by_x / size if size else np.zeros_like(last.by_x)
    known = [q for q in (_central(objective, last.x, v, h) for h in STEPS) if q is not None]
    pairs = sorted((abs(a - b), b) for a, b in pairwise(known))
    if not pairs:
        return Slopes(-size, -size, np.inf)
    uncertain, found = pairs[0]
    return Slopes(-size, found, uncertain)


def explained(objective: Objective) -> str:
    """Why the line search came back without a step, in a sentence."""
    outside = next((tried.outside for tried in objective.tried if tried.outside is not None), None)
    if outside is not None and all(tried.outside is not None for tried in objective.tried):
        return f"every step leaves where J is defined: {outside}"
    found = slopes(objective)
    if found.disagree:
        return (
            "predicted decrease and actual decrease disagree: the gradient is inconsistent with J (slope"
            f" {found.promised:.4g} promised, {found.found:.4g} by differences of J); see routes vcurve"
        )
    return f"{AT_MINIMUM}: what is left of the slope is rounding"


def _central(objective: Objective, x: Array, v: Array, h: float) -> float | None:
    try:
        up, down = (objective.model.value(objective.variables.p(x + side * h * v)) for side in (1.0, -1.0))
    except OUTSIDE:
        return None
    return (up - down) / (2.0 * h)
