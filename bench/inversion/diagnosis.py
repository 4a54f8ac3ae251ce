"""Why a line search returned without a step: J is at its minimum, or noise hides its slope, or J has a kink or an edge
there, or the gradient is not that of J.
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
CLOSE = 1e-8  # step over which J is straight, so that second differences are noise
DISAGREE = 1e-2  # relative difference of slopes that no uncertainty explains
EPS = float(np.finfo(np.float64).eps)
ROUNDED = 1e3  # eps |J|: rounding of the terms of J; more is noise
KINKED = 0.5  # part of the difference of one-sided slopes left at a tenth of the step: 0.1 where J is smooth
LOOSE = 1e-6  # tolerance of a forward solve above which it may disturb J


@dataclass(frozen=True)
class Slopes:
    """Of J along the steepest descent.

    promised   by the gradient
    found      by central differences, with its uncertainty
    noise      of J, from second differences over tiny steps
    left, right  one-sided slopes
    kink       whether these differ in the limit
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
        """Whether the promised slope is within the uncertainty of differences."""
        return abs(self.promised) <= 3.0 * self.uncertain


class Along:
    """h -> J(x + h |x| v) from the last accepted step x; NaN where undefined, `edge` then tells why."""

    def __init__(self, objective: Objective, v: Array) -> None:
        self.objective, self.x, self.v = objective, objective.accepted.x, v
        self.size = max(1.0, float(np.abs(self.x).max(initial=0.0)))
        self.edge: str | None = None

    def __call__(self, h: float) -> float:
        try:
            J = float(self.objective.model.value(self.objective.variables.p(self.x + h * self.size * self.v)))
        except OUTSIDE as error:
            self.edge = str(error)
            return math.nan
        if not math.isfinite(J):
            self.edge = f"J = {J}"
        return J


def slopes(objective: Objective) -> Slopes:
    """From the last accepted step, by 15 forward solves."""
    last = objective.accepted
    slope = norm2(last.by_x)
    J = Along(objective, -last.by_x / slope if slope else np.zeros_like(last.by_x))
    near = np.array([J(k * CLOSE) for k in (-2, -1, 0, 1, 2)])
    here, below, above = near[2], *np.array([(J(-h), J(h)) for h in STEPS]).T
    h = np.array(STEPS) * J.size
    resolution = _resolution(h, np.abs([below - here, above - here]), slope, abs(here))
    noise = max(float(np.abs(np.diff(near, 2)).max()), 8.0 * EPS * abs(last.J), resolution)
    if not (np.isfinite([below, above]).all() and math.isfinite(noise)):
        return Slopes(-slope, math.nan, math.inf, noise, math.nan, math.nan, False, J.edge or "J is not finite")
    central, gap = (above - below) / (2.0 * h), (above - 2.0 * here + below) / h  # gap: right less left slope
    uncertain = noise / h + np.abs(np.diff(central, prepend=math.inf))
    stays = np.abs(gap[2:]) > np.maximum(KINKED * np.abs(gap[1:-1]), np.maximum(DISAGREE * slope, 10.0 * noise / h[2:]))
    kink = bool(stays.any())
    best = int(np.argmin(uncertain))
    best = min(best, len(h) - 3) if kink else best  # a step that reaches over the kink
    left, right = (here - below[best]) / h[best], (above[best] - here) / h[best]
    return Slopes(-slope, float(central[best]), float(uncertain[best]), noise, float(left), float(right), kink, None)


def _resolution(h: Array, changes: Array, slope: float, J: float) -> float:
    """The least change of J that is seen (changes (2, m)), where J is constant over steps that should change it."""
    constant = bool(((changes == 0.0) & (slope * h > ROUNDED * EPS * J)).any())
    return float(changes[changes > 0.0].min(initial=math.inf)) if constant and (changes > 0.0).any() else 0.0


def explained(objective: Objective) -> str:
    """Why the line search returned without a step, in a sentence."""
    tried: Sequence[str | None] = [each.outside for each in objective.tried]
    if tried and all(tried):
        return f"every step leaves the domain of J: {tried[-1]}"
    found, J = slopes(objective), objective.accepted.J
    if found.edge is not None:
        return f"J is not defined beside this point: {found.edge}"
    if found.kink:
        return f"J has a kink here, with slopes {found.left:.4g} and {found.right:.4g} on its sides; see routes vcurve"
    if found.disagree:
        return (
            "predicted decrease and actual decrease disagree: the gradient is inconsistent with J (slope"
            f" {found.promised:.4g} promised, {found.found:.4g} by differences of J){_if_loose(objective)}"
            "; see routes vcurve"
        )
    if found.noise > ROUNDED * EPS * abs(J) and found.hidden:
        return f"noise of J, about {found.noise:.2g}, hides a slope of {-found.promised:.2g}{_if_loose(objective)}"
    if found.hidden or J == 0.0 or abs(found.promised) < math.sqrt(EPS) * objective.slope_0:
        return f"{AT_MINIMUM}: what is left of the slope is rounding"
    return f"no step was found, though J falls by {-found.promised:.2g} as the gradient says - use another optimizer"


def _if_loose(objective: Objective) -> str:
    solver, problem = objective.model.solver, objective.problem
    iterates = not problem.linear or solver.linear.iterates
    if solver.rtol <= LOOSE or not iterates:
        return ""
    return f"; the forward solves are loose (--rtol {solver.rtol:g}): tighten them first"
