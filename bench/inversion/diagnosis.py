"""Why a line search comes back without a step: J is at its minimum, or noise hides the rest of its slope, or it has a
kink or an edge there, or its gradient is not that of J.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.objective import OUTSIDE, Objective
from gradient_routes.problems.problem import Array

AT_MINIMUM = "J cannot be told apart from its minimum"
STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # of x, relative to its size where that is above one
CLOSE = 1e-8  # steps over which J is straight, so that second differences are noise
DISAGREE = 1e-2  # relative difference of slopes that no uncertainty explains
EPS = float(np.finfo(np.float64).eps)
ROUNDED = 1e3  # eps |J|: rounding of the terms of J; more is noise
KINKED = 0.5  # of the difference of one-sided slopes that is left at a tenth of the step: of a curve it is a tenth
LOOSE = 1e-6  # tolerance of a forward solve that may be what disturbs J


@dataclass(frozen=True)
class Slopes:
    """Along the steepest descent that the gradient knows.

    promised   by the gradient
    found      by central differences of J, uncertain by so much
    noise      of J, what second differences over tiny steps leave
    left, right  one-sided slopes there
    kink       they do not meet as the step goes to 0
    edge       why J is not defined beside the point; None where it is
    """

    promised: float
    found: float
    uncertain: float
    noise: float
    left: float
    right: float
    kink: bool
    edge: str | None

    @property
    def disagree(self) -> bool:
        return abs(self.promised - self.found) > DISAGREE * abs(self.found) + 3.0 * self.uncertain

    @property
    def hidden(self) -> bool:
        """Whether differences could not tell the promised slope from none."""
        return abs(self.promised) <= 3.0 * self.uncertain


class Line:
    """J along v from the last accepted step, in forward solves that are counted with the others."""

    def __init__(self, objective: Objective, v: Array) -> None:
        last = objective.accepted
        assert last is not None
        self.objective, self.x, self.v, self.J = objective, last.x, v, last.J
        self.size = max(1.0, float(np.abs(last.x).max(initial=0.0)))
        self.outside: str | None = None

    def __call__(self, h: float) -> float:
        """J(x + h v), NaN where it is not defined."""
        try:
            J = float(self.objective.model.value(self.objective.variables.p(self.x + h * self.size * self.v)))
        except OUTSIDE as error:
            self.outside = str(error)
            return math.nan
        if not math.isfinite(J):
            self.outside = f"J = {J}"
        return J


def slopes(objective: Objective) -> Slopes:
    """From the last accepted step: some 15 forward solves."""
    last = objective.accepted
    assert last is not None
    size = norm2(last.by_x)
    v = -last.by_x / size if size else np.zeros_like(last.by_x)
    line = Line(objective, v)
    near = np.array([line(k * CLOSE) for k in (-2, -1, 0, 1, 2)])
    sides = [(h, line(-h), line(h)) for h in STEPS]
    noise = max(float(np.abs(np.diff(near, 2)).max()), 8.0 * EPS * abs(line.J), _resolution(sides, near[2], line, size))
    if any(not math.isfinite(value) for each in sides for value in each) or not math.isfinite(noise):
        return Slopes(-size, math.nan, math.inf, noise, math.nan, math.nan, False, line.outside or "J is not finite")
    central = [(above - below) / (2.0 * h * line.size) for h, below, above in sides]
    doubt = [
        noise / (h * line.size) + (abs(central[k] - central[k - 1]) if k else math.inf) for k, h in enumerate(STEPS)
    ]
    best = int(np.argmin(doubt))
    gaps = [(above - 2.0 * near[2] + below) / (h * line.size) for h, below, above in sides]  # right less left
    kink = any(
        abs(finer) > max(KINKED * abs(gap), DISAGREE * size, 10.0 * noise / (h * line.size))
        for gap, finer, h in zip(gaps[1:], gaps[2:], STEPS[2:], strict=False)
    )
    best = min(best, len(STEPS) - 3) if kink else best  # a step that reaches over it
    h, below, above = sides[best]
    left, right = (near[2] - below) / (h * line.size), (above - near[2]) / (h * line.size)
    return Slopes(-size, central[best], doubt[best], noise, left, right, kink, None)


def _resolution(sides: Sequence[tuple[float, float, float]], J: float, line: Line, slope: float) -> float:
    """The least change of J that is seen, where it stays the same over steps that should have changed it; else 0."""
    changes = [(h, abs(value - J)) for h, *both in sides for value in both]
    stuck = any(change == 0.0 and slope * h * line.size > ROUNDED * EPS * abs(J) for h, change in changes)
    return min((change for _, change in changes if change > 0.0), default=0.0) if stuck else 0.0


def explained(objective: Objective) -> str:
    """Why the line search came back without a step, in a sentence."""
    tried = [each.outside for each in objective.tried]
    if tried and all(tried):
        return f"every step leaves where J is defined: {tried[-1]}"
    found = slopes(objective)
    if found.edge is not None:
        return f"J is not defined beside this point: {found.edge}"
    if found.kink:
        return (
            f"J has a kink here, slopes {found.left:.4g} and {found.right:.4g} on its two sides: no gradient leads on;"
            " see routes vcurve"
        )
    if found.disagree:
        return f"{_accused(found)}{_if_loose(objective)}; see routes vcurve"
    assert objective.accepted is not None
    if found.noise > ROUNDED * EPS * abs(objective.accepted.J) and found.hidden:
        return f"noise of J, about {found.noise:.2g}, hides a slope of {-found.promised:.2g}{_if_loose(objective)}"
    if found.hidden or objective.accepted.J == 0.0 or abs(found.promised) < math.sqrt(EPS) * objective.slope_0:
        return f"{AT_MINIMUM}: what is left of the slope is rounding"
    return f"no step was found, though J falls by {-found.promised:.2g} as the gradient says - take another optimizer"


def _accused(found: Slopes) -> str:
    return (
        "predicted decrease and actual decrease disagree: the gradient is inconsistent with J (slope"
        f" {found.promised:.4g} promised, {found.found:.4g} by differences of J)"
    )


def _if_loose(objective: Objective) -> str:
    solver, problem = objective.model.solver, objective.problem
    iterates = not problem.linear or solver.linear.iterates
    if solver.rtol <= LOOSE or not iterates:
        return ""
    return f"; forward solves are as loose as --rtol {solver.rtol:g}: tighten them before blaming it"
