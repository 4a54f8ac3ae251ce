"""What the end of an inversion rests on: dJ/dp = 0 by differences of J, and steps along which J fell as promised."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.diagnosis import AT_MINIMUM, MISLED, misled
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.slopes import EPS, ROUNDED, STEPS, Along, descent, examined, size
from gradient_routes.problems.problem import Array

CONVERGED = "converged"
SEED = 0  # of the random directions
STEP = 1e-4  # of x along them, in natural changes: truncation is h^2, rounding of J is eps / h
CURVED = 10.0  # J''' / J'' over a natural change, at most
INSIDE = 0.5  # part of the way to a bound that the largest step goes at most
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
    if not end.startswith((CONVERGED, AT_MINIMUM)):
        return end
    before = objective.forward_solves
    remarks = []
    for v in directions(objective):
        claim = tolerance * objective.slope_scale * norm2(v)
        if not doubted and flat(objective, v, claim):
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
    if remarks:
        return f"{end}; not confirmed: {remarks[0]}"
    return f"{end}, confirmed by {objective.forward_solves - before} forward solves"


def directions(objective: Objective) -> list[Array]:
    """Two random ones: every x_i by 1/2 to 1 natural changes, less where a bound is near."""
    rng, at, q = np.random.default_rng(SEED), objective.accepted, objective.problem.parameters
    x, slope = at.x, objective.variables.slope(at.x)
    natural = np.maximum(1.0, np.abs(x)) / size(x)  # of steps relative to the size of x
    room = np.minimum(at.p - q.lower, q.upper - at.p)
    most = INSIDE * room / (STEPS[0] * size(x) * slope)
    found = []
    for _ in range(2):
        v = natural * rng.uniform(0.5, 1.0, len(x)) * rng.choice([-1.0, 1.0], len(x))
        found.append(np.clip(v, -most, most))
    return found


def flat(objective: Objective, v: Array, claim: float) -> bool:
    """Whether J(x + h v) - J(x - h v) is what the gradient promises, up to the slope that the inversion claims to have
    left, to rounding, and to truncation, which is h^3 J'''/3; two forward solves.
    """
    at = objective.accepted
    J = Along(objective, at.x, v)
    h = STEP * J.size
    below, above = J(-STEP), J(STEP)
    off = abs(above - below - 2.0 * h * float(at.by_x @ v))
    rounding = ROUNDED * EPS * max(abs(at.J), abs(above), abs(below))
    truncation = CURVED * STEP * abs(above - 2.0 * at.J + below)
    return off <= 2.0 * h * claim + rounding + truncation  # never, where J is not defined
