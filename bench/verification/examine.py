"""Look at a gradient along several lines: the part that costs objective calls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.gradient_call import Asked, ask
from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.line import Line, Sweep, chosen_components, components, directions, sweep
from gradient_routes.bench.verification.noise import noise
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.reading import Reading, stencil_changes
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

EQUAL = 1e-7  # seven digits: differences seldom give more, and nobody asks for more
PER_EPS = 100.0  # relative error that is rounding, in eps of the numbers
COARSEST = 1e-3  # of that: float16 has three digits
ALL = 6  # components that are all looked at where there are no more
REPEATS = 4  # further evaluations at p, where two differ


@dataclass
class Examination:
    """A subject, its gradient, its J with everything known of it, and the readings made so far.

    repeated   what J(p) was each time; remembers: by how much calls at other points have changed it
    """

    subject: Subject
    plan: Plan
    J: Guarded
    asked: Asked
    J_0: float
    repeated: Array
    accepted: float
    readings: list[Reading] = field(default_factory=list)
    remembers: float = 0.0

    @classmethod
    def of(cls, subject: Subject, plan: Plan, J: Guarded, accepted: float = 0.0) -> Examination:
        """Ask for the gradient once and for J(p) twice. Raises Unusable."""
        values = [J(subject.p), J(subject.p)]
        J.account.gradients += 1
        asked = ask(subject)
        if np.isfinite(values).all() and values[0] != values[1]:
            values += [J(subject.p) for _ in range(REPEATS) if J.left() > 0]
        repeated = np.array([v for v in values if np.isfinite(v)])
        J_0 = float(repeated.mean()) if repeated.size else float("nan")
        by_precision = min(PER_EPS * asked.eps, COARSEST) if asked.eps > np.finfo(np.float64).eps else 0.0
        allowed = max(EQUAL, accepted, by_precision)
        return cls(subject, plan, J, asked, J_0, repeated, allowed)

    @property
    def gradient(self) -> Array:
        return self.asked.gradient

    @property
    def size(self) -> float:
        """|g w|_2, the slope of J along a random natural change."""
        return norm2(self.gradient * self.subject.natural)

    def lines(self) -> list[Line]:
        """A random direction first, then components, then the other directions."""
        plan, n_p = self.plan, len(self.subject.p)
        few = n_p if n_p <= ALL and not plan.everywhere else plan.components
        indices = chosen_components(self.gradient, self.subject.natural, few) if isinstance(few, int) else list(few)
        first, *others = directions(self.subject, plan.directions, plan.seed)
        if n_p == 1:
            return components(self.subject, [0])
        return [first, *components(self.subject, indices), *others]

    def look(self, lines: Sequence[Line]) -> None:
        """Read every line: over all steps, or near the best step of the first. After that, J(p) is asked for again."""
        for k, line in enumerate(lines):
            if k == 1:
                self._ask_again()
            best = self.readings[0].level if self.readings else None
            if self.plan.everywhere or k == 0 or best is None:
                self.readings.append(self.read(line, self.plan.steps))
                continue
            reading = self.read(line, self.plan.near(best.h))
            self.readings.append(self._wider(reading))

    def _ask_again(self) -> None:
        """A J that starts where its last call ended tells by now: what it remembers counts as noise."""
        value = self.J(self.subject.p) if self.J.left() > 2 else self.J_0
        if value == self.J_0 or not np.isfinite(value) or len(self.repeated) > 2:
            return
        self.remembers = abs(value - self.J_0)
        self.repeated = np.append(self.repeated, value)
        self.readings = [self._reading(r.sweep) for r in self.readings]

    def read(self, line: Line, h: Array) -> Reading:
        """The sweep of one line, as far as the budget goes."""
        return self._reading(sweep(self.J, self.J_0, self.subject, self.gradient, line, h))

    def _wider(self, reading: Reading) -> Reading:
        """Where few steps could not tell, or not of the component itself, as many again where it gets better."""
        told = reading.says != "noise" and (reading.sweep.line.index is None or reading.own_scale)
        if told or reading.says in ("plateau", "nothing") or not reading.sweep.two_sided or not reading.slope:
            return reading
        h, variation = reading.sweep.h, np.abs(np.diff(reading.sweep.off_central))
        below = np.nansum(variation[: len(variation) // 2]) < np.nansum(variation[len(variation) // 2 :])
        steps = self.plan.steps
        more = steps[steps < h[0]][-len(h) :] if below else steps[steps > h[-1]][: len(h)]
        if self.J.left() < 2 * len(more):
            return reading
        extra = sweep(self.J, self.J_0, self.subject, self.gradient, reading.sweep.line, more)
        return self._reading(reading.sweep.joined(extra))

    def _reading(self, made: Sweep) -> Reading:
        alone = len(made.h) < len(self.plan.steps) and self.readings  # few steps tell less of J's noise than all do
        sigma = self.readings[0].noise if alone else max(noise(made, self.J.eps, self.repeated), self.remembers)
        by_nature = self.subject.accuracy * max(self.size, abs(self.J_0))
        changes = stencil_changes(self.subject, made.line.v)
        natural_change = self.readings[0].change if self.readings else 0.0
        return Reading(made, sigma, self.size, self.accepted, by_nature, changes, natural_change)
