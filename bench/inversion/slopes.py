"""J along a direction: its slope by differences, and the slope that a gradient promises."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.objective import Evaluation, Objective
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array

STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # of x, relative to its size where that is above one
CLOSE = 1e-8  # step over which J is straight, so that second differences are noise
DISAGREE = 1e-2  # relative difference of slopes that no uncertainty explains
EPS = float(np.finfo(np.float64).eps)
ROUNDED = 1e3  # eps |J|: rounding of the terms of J; more is noise
KINKED = 0.5  # part of the difference of one-sided slopes left at a tenth of the step: 0.1 where J is smooth
PRECISE = 1e-9  # of the gradient at the start: error that linear solves leave in any gradient
TIGHT = 1e-12  # tolerance of forward solves that disturbs neither J nor its gradient


@dataclass(frozen=True)
class Slopes:
    """Of J along a direction.

    promised   by the gradient
    natural    error that the gradient of the route has by nature
    found      by central differences, with its uncertainty
    noise      of J, from second differences over tiny steps
    left, right  one-sided slopes
    curvature  second derivative, absolute
    kink       whether these differ in the limit
    edge       why J is not defined beside the point; None where it is
    """

    promised: float
    natural: float
    found: float
    uncertain: float
    noise: float
    left: float
    right: float
    curvature: float
    kink: bool
    edge: str | None

    @property
    def disagree(self) -> bool:
        return abs(self.promised - self.found) > DISAGREE * abs(self.found) + 3.0 * self.uncertain

    @property
    def wrong(self) -> bool:
        """Whether they disagree where J is smooth, by more than is in the nature of the route."""
        smooth = self.edge is None and not self.kink
        return smooth and self.disagree and abs(self.promised - self.found) > self.natural

    @property
    def to_gain(self) -> float:
        """By how much a Newton step along the direction would lower J."""
        return 0.5 * self.promised**2 / self.curvature if self.curvature else math.inf

    @property
    def hidden(self) -> bool:
        """Whether the promised slope is within the uncertainty of differences."""
        return abs(self.promised) <= 3.0 * self.uncertain


class Along:
    """h -> J(x + h |x| v); NaN where undefined, `edge` then tells why."""

    def __init__(self, objective: Objective, x: Array, v: Array) -> None:
        self.objective, self.x, self.v = objective, x, v
        self.size = size(x)
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


def size(x: Array) -> float:
    return max(1.0, float(np.abs(x).max(initial=0.0)))


def descent(at: Evaluation) -> Array:
    """The unit vector of steepest descent, 0 where the gradient is."""
    slope = norm2(at.by_x)
    return -at.by_x / slope if slope else np.zeros_like(at.by_x)


def slopes(objective: Objective, at: Evaluation, v: Array) -> Slopes:
    """Of J at an evaluation along v, by 15 forward solves."""
    promised = float(at.by_x @ v)
    J = Along(objective, at.x, v)
    near = np.array([J(k * CLOSE) for k in (-2, -1, 0, 1, 2)])
    here, below, above = near[2], *np.array([(J(-h), J(h)) for h in STEPS]).T
    h = np.array(STEPS) * J.size
    resolution = _resolution(h, np.abs([below - here, above - here]), abs(promised), abs(here))
    noise = max(float(np.abs(np.diff(near, 2)).max()), 8.0 * EPS * abs(at.J), resolution)
    if not (np.isfinite([below, above]).all() and math.isfinite(noise)):
        edge = J.edge or "J is not finite"
        return Slopes(promised, math.inf, math.nan, math.inf, noise, math.nan, math.nan, math.nan, False, edge)
    central, gap = (above - below) / (2.0 * h), (above - 2.0 * here + below) / h  # gap: right less left slope
    uncertain = noise / h + np.abs(np.diff(central, prepend=math.inf))
    least = np.maximum(DISAGREE * abs(promised), 10.0 * noise / h[2:])
    kink = bool((np.abs(gap[2:]) > np.maximum(KINKED * np.abs(gap[1:-1]), least)).any())
    best = int(np.argmin(uncertain))
    best = min(best, len(h) - 3) if kink else best  # a step that reaches over the kink
    left, right = (here - below[best]) / h[best], (above[best] - here) / h[best]
    curvature = abs(float(gap[best] / h[best]))
    steepest = objective.slope_0 * norm2(v)
    natural = max(PRECISE * steepest, objective.route.accuracy * (steepest + curvature))
    found, off = float(central[best]), float(uncertain[best])
    return Slopes(promised, natural, found, off, noise, float(left), float(right), curvature, kink, None)


def _resolution(h: Array, changes: Array, slope: float, J: float) -> float:
    """The least change of J that is seen (changes (2, m)), where J is constant over steps that should change it."""
    constant = bool(((changes == 0.0) & (slope * h > ROUNDED * EPS * J)).any())
    return float(changes[changes > 0.0].min(initial=math.inf)) if constant and (changes > 0.0).any() else 0.0


def loose(objective: Objective) -> bool:
    """Whether the forward solves iterate and end before rounding."""
    solver = objective.model.solver
    return solver.rtol > TIGHT and (not objective.problem.linear or solver.linear.iterates)


def tightened(objective: Objective, p: Array) -> Objective:
    """The objective with its forward solves tightened, started at p; its work is counted with the other's.

    Raises what the route raises there.
    """
    model = objective.model
    tight = objective.with_solver(replace(model.solver, rtol=TIGHT))
    tight.model.tally = model.tally
    tight.start(p)
    return tight


@dataclass(frozen=True)
class Examined:
    """Slopes, and what is to `blame` where they disagree: the gradient, or the forward solves, which are too loose."""

    slopes: Slopes
    blame: Literal["gradient", "solves"] | None = None


def examined(objective: Objective, at: Evaluation, v: Array) -> Examined:
    """By 15 forward solves; where they are loose and the slopes disagree, by 15 tight ones and another gradient."""
    found = slopes(objective, at, v)
    if not found.wrong:
        return Examined(found)
    if not loose(objective):
        return Examined(found, "gradient")
    try:
        tight = tightened(objective, at.p)
    except OUTSIDE:  # nobody knows
        return Examined(found, "solves")
    again = slopes(tight, tight.accepted, v)
    return Examined(again, "gradient") if again.wrong else Examined(found, "solves")
