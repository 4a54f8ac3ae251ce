"""What the end of an inversion rests on: dJ/dp = 0 by differences of J, and steps along which J fell as promised."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.diagnosis import MISLED, misled
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.slopes import EPS, ROUNDED, STEPS, Along, descent, examined, size
from gradient_routes.problems.problem import Array

CONVERGED = "converged"
LEVEL = "stopped: J is level here, p no longer matters to the data - choose another start, or bounds"
SEED = 0  # of the random directions
STEP = 1e-4  # of x along them, in natural changes: truncation is h^2, rounding of J is eps / h
CURVED = 10.0  # J''' / J'' over a natural change, at most
LOGARITHM = 100.0  # |x| up to which x may be one of a quantity in SI units, over which J bends as x changes by 1
INSIDE = 0.5  # part of the way to a bound that the largest step goes at most
WIDE = 1e-2  # of x along them, where J bends by no more than rounding over the first
ENDLESS = 0.01  # of max(1, |x|): what a Newton step still goes where J is level rather than at a minimum
SUSPECT = 0.05  # relative difference of promised and actual changes of J, the median over the steps


def confirmed(objective: Objective, history: History, end: str, tolerance: float, doubted: bool) -> str:
    """The end of an inversion, completed where differences of J confirm it, replaced where they do not.

    doubted  whether J of the route is not that of the problem
    """
    if end.startswith(MISLED):
        return end
    if history.ratios and abs(float(np.median(history.ratios)) - 1.0) > SUSPECT:
        assert history.first is not None
        seen = examined(objective, history.first, descent(history.first))
        if seen.blame == "gradient":
            return misled("at the start its slope along the steepest descent", seen.slopes)
    if not end.startswith(CONVERGED):
        return end
    before = objective.forward_solves
    remarks, around = [], [Beside(objective, v) for v in directions(objective)]
    for each in around:
        v = each.v
        claim = tolerance * objective.slope_scale * norm2(v)
        if not doubted and each.confirms(claim):
            continue
        seen = examined(objective, objective.accepted, v)
        if seen.blame == "gradient" and abs(seen.slopes.promised - seen.slopes.found) > claim:
            return misled("at the end its slope along a random direction", seen.slopes)
        if seen.blame == "solves":
            remarks.append(f"loose forward solves (--rtol {objective.model.solver.rtol:g}) leave a slope")
        elif seen.slopes.edge is not None:
            remarks.append(f"J is not defined beside it: {seen.slopes.edge}")
        elif seen.slopes.kink:
            remarks.append("J has a kink there")
    if all(each.level for each in around):
        return LEVEL
    if remarks:
        return f"{end}; not confirmed: {remarks[0]}"
    return f"{end}, confirmed by {objective.forward_solves - before} forward solves"


def directions(objective: Objective) -> list[Array]:
    """Two random ones: every x_i by 1/2 to 1 natural changes, less where a bound is near."""
    rng, at, q = np.random.default_rng(SEED), objective.accepted, objective.problem.parameters
    x, slope = at.x, objective.variables.slope(at.x)
    natural = np.maximum(1.0, np.abs(x) / LOGARITHM) / size(x)  # of steps relative to the size of x
    room = np.minimum(at.p - q.lower, q.upper - at.p)
    most = INSIDE * room / (STEPS[0] * size(x) * slope)
    found = []
    for _ in range(2):
        v = natural * rng.uniform(0.5, 1.0, len(x)) * rng.choice([-1.0, 1.0], len(x))
        found.append(np.clip(v, -most, most))
    return found


class Beside:
    """J on both sides of the last accepted step, by two forward solves."""

    def __init__(self, objective: Objective, v: Array) -> None:
        self.v, self.J, self.J_0 = v, Along(objective, objective.accepted.x, v), objective.accepted.J
        self.slope = self.J.size * float(objective.accepted.by_x @ v)  # over a natural change, as promised
        self.below, self.above = self.J(-STEP), self.J(STEP)
        self.rounding = ROUNDED * EPS * max(abs(self.J_0), abs(self.above), abs(self.below))

    def confirms(self, claim: float) -> bool:
        """Whether J(x + h v) - J(x - h v) is what the gradient promises, up to the slope that the inversion claims to
        have left, to rounding, and to truncation, which is h^3 J'''/3.
        """
        off = abs(self.above - self.below - 2.0 * STEP * self.slope)
        truncation = CURVED * STEP * abs(self._bend(self.below, self.above))
        return off <= 2.0 * STEP * self.J.size * claim + self.rounding + truncation  # never, where J is not defined

    @property
    def level(self) -> bool:
        """Whether J bends so little that a Newton step would go on, as where p no longer matters; by 0 or 2 solves."""
        if not self._bend(self.below, self.above) <= self.rounding:
            return False
        return self._bend(self.J(-WIDE), self.J(WIDE)) <= self.rounding + WIDE**2 * abs(self.slope) / ENDLESS

    def _bend(self, below: float, above: float) -> float:
        return above - 2.0 * self.J_0 + below
