"""Evaluate J along the lines of a plan and read every one: the part that costs objective calls."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.guarded import DOUBLE, Guarded, Returned, gradient_of
from gradient_routes.bench.verification.lines import Line, by_sensitivity, components, directions
from gradient_routes.bench.verification.noise import noise
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.quotients import Quotients, quotients
from gradient_routes.bench.verification.reading import Reading, stencil_changes
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

EQUAL = 1e-7  # relative error that counts as agreement: differences seldom resolve more
PER_EPS = 100.0  # relative error that is rounding, in eps of the gradient's precision
COARSEST = 1e-3  # largest such error: float16 has three digits
ALL = 6  # components that are all tested where there are no more
REPEATS = 4  # further evaluations at p, where two differ


@dataclass
class Examination:
    """A subject, its gradient, its objective and the readings made so far.

    repeated   values of J(p), evaluated several times
    remembers  by how much calls at other points changed J(p)
    """

    subject: Subject
    plan: Plan
    J: Guarded
    returned: Returned
    J_0: float
    repeated: Array
    accepted: float
    readings: list[Reading] = field(default_factory=list)
    remembers: float = 0.0

    @classmethod
    def of(cls, subject: Subject, plan: Plan, J: Guarded, accepted: float = 0.0) -> Examination:
        """Call the gradient once and J(p) twice, more often where the two values differ. Raises Unusable."""
        values = [J(subject.p), J(subject.p)]
        J.account.gradients += 1
        returned = gradient_of(subject)
        if np.isfinite(values).all() and values[0] != values[1]:
            values += [J(subject.p) for _ in range(REPEATS) if J.left() > 0]
        repeated = np.array([v for v in values if np.isfinite(v)])
        J_0 = float(repeated.mean()) if repeated.size else float("nan")
        rounding = min(PER_EPS * returned.eps, COARSEST) if returned.eps > DOUBLE else 0.0
        return cls(subject, plan, J, returned, J_0, repeated, max(EQUAL, accepted, rounding))

    @property
    def gradient(self) -> Array:
        return self.returned.gradient

    @property
    def size(self) -> float:
        """|g w|_2, the expected slope of J along a random natural change."""
        return norm2(self.gradient * self.subject.natural)

    def lines(self) -> list[Line]:
        """A random direction first, then components, then the other directions."""
        plan, n_p = self.plan, len(self.subject.p)
        if n_p == 1:
            return components(self.subject, [0])
        few = n_p if n_p <= ALL and not plan.everywhere else plan.components
        indices = by_sensitivity(self.gradient, self.subject.natural, few) if isinstance(few, int) else list(few)
        first, *others = directions(self.subject, plan.directions, plan.seed)
        return [first, *components(self.subject, indices), *others]

    def run(self) -> None:
        """Read every line: over all steps, or near the best step of the first."""
        for k, line in enumerate(self.lines()):
            if k == 1:
                self._test_memory()
            best = self.readings[0].level if self.readings else None
            if self.plan.everywhere or k == 0 or best is None:
                self.readings.append(self.read(line, self.plan.steps))
            else:
                self.readings.append(self._extended(self.read(line, self.plan.near(best.h))))

    def read(self, line: Line, h: Array) -> Reading:
        """The quotients of one line, as far as the budget goes."""
        return self._reading(quotients(self.J, self.J_0, self.subject, self.gradient, line, h))

    def _test_memory(self) -> None:
        """J(p) once more: a J that starts from its last solution differs now, and the difference counts as noise."""
        value = self.J(self.subject.p) if self.J.left() > 2 else self.J_0
        if value == self.J_0 or not np.isfinite(value) or len(self.repeated) > 2:
            return
        self.remembers = abs(value - self.J_0)
        self.repeated = np.append(self.repeated, value)
        self.readings = [self._reading(r.quotients) for r in self.readings]

    def _extended(self, reading: Reading) -> Reading:
        """With as many steps again, on the better side, where few steps leave a component or the line undecided."""
        decided = reading.says != "noise" and (reading.index is None or reading.own_scale)
        q = reading.quotients
        if decided or reading.says in ("plateau", "nothing") or not q.two_sided or not reading.slope:
            return reading
        variation = np.abs(np.diff(q.off_central))
        below = np.nansum(variation[: len(variation) // 2]) < np.nansum(variation[len(variation) // 2 :])
        steps = self.plan.steps
        more = steps[steps < q.h[0]][-len(q.h) :] if below else steps[steps > q.h[-1]][: len(q.h)]
        if self.J.left() < 2 * len(more):
            return reading
        return self._reading(q.joined(quotients(self.J, self.J_0, self.subject, self.gradient, q.line, more)))

    def _reading(self, q: Quotients) -> Reading:
        few = len(q.h) < len(self.plan.steps) and self.readings  # all steps of the first line estimate noise better
        sigma = self.readings[0].noise if few else max(noise(q, self.J.eps, self.repeated), self.remembers)
        by_nature = self.subject.accuracy * max(self.size, abs(self.J_0))
        natural_change = self.readings[0].change if self.readings else 0.0
        changes = stencil_changes(self.subject, q.line.v)
        return Reading(q, sigma, self.size, self.accepted, by_nature, changes, natural_change)
