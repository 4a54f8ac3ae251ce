"""Evaluate J along the lines of a plan and read every one: the part that costs objective calls."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.elsewhere import second_point
from gradient_routes.bench.verification.guarded import DOUBLE, Guarded, Returned
from gradient_routes.bench.verification.lines import Line, by_sensitivity, components, directions
from gradient_routes.bench.verification.noise import noise
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.quotients import Quotients, quotients
from gradient_routes.bench.verification.reading import Reading, stencil_changes
from gradient_routes.bench.verification.repeat import Repeated, once, repeated
from gradient_routes.bench.verification.scales import with_scales
from gradient_routes.bench.verification.staircase import abrupt, tread_noise
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

EQUAL = 1e-7  # relative error that counts as agreement: differences seldom resolve more
PER_EPS = 100.0  # relative error that is rounding, in eps of the gradient's precision
COARSEST = 1e-3  # largest such error: float16 has three digits
ALL = 6  # components that are all tested where there are no more
STATIONARY = 1e-5  # slope of J in a natural step, relative to what J changes by there
MACRO = 1e-2  # step at which treads are looked for where no range of steps suggests another
TREADS = 10.0  # noises of J that are its treads rather than chance


class NoValue(Exception):
    """J has no value at p."""


@dataclass
class Examination:
    """A subject, its gradient, its objective and the readings made so far.

    repeated   values of J(p) and gradients, asked for several times
    elsewhere  a second point (n_p,) at which J has a value
    like       a reading elsewhere, swept over all steps: its noise and its best step are taken
    remembers  by how much calls at other points changed J(p)
    treads     standard deviation of J in large steps, where small ones lie within a tread
    """

    subject: Subject
    plan: Plan
    J: Guarded
    repeated: Repeated
    accepted: float
    elsewhere: Array | None = None
    like: Reading | None = None
    readings: list[Reading] = field(default_factory=list)
    remembers: float = 0.0
    treads: float = 0.0

    @classmethod
    def of(cls, subject: Subject, plan: Plan, J: Guarded, accepted: float = 0.0) -> Examination:
        """Ask for J and its gradient repeatedly, find the scales that are unknown. Raises Unusable, NoValue."""
        values = [J(subject.p), J(subject.p)]
        if not np.isfinite(values).any():
            raise NoValue
        subject = with_scales(subject, J, values[0])
        q = second_point(subject, J, plan.seed) if np.isfinite(values).all() else None
        found = repeated(subject, J, values, q)
        return cls(subject, plan, J, found, _accepted(found.returned, accepted), q, remembers=found.by_calls)

    @classmethod
    def lightly(cls, subject: Subject, plan: Plan, J: Guarded, accepted: float = 0.0) -> Examination:
        """Ask for J and its gradient once: of a tightened, refined or moved version. Raises Unusable."""
        found = once(subject, J)
        return cls(subject, plan, J, found, _accepted(found.returned, accepted))

    @property
    def J_0(self) -> float:
        return self.repeated.J

    @property
    def returned(self) -> Returned:
        return self.repeated.returned

    @property
    def gradient(self) -> Array:
        return self.returned.gradient

    @property
    def size(self) -> float:
        """|g w|_2, the expected slope of J along a random natural change."""
        return norm2(self.gradient * self.subject.natural)

    @property
    def stationary(self) -> bool:
        """Whether gradient and quotients vanish at p beside what J changes by nearby: a gradient of zero passes."""
        first = self.readings[0]
        return first.moves and max(self.size, abs(first.quotient or 0.0)) <= STATIONARY * first.change

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
            best = base.level if (base := self._base) is not None else None
            if self.plan.everywhere or (k == 0 and self.like is None) or best is None:
                self.readings.append(self.read(line, self.plan.steps))
            else:
                self.readings.append(self._extended(self.read(line, self.plan.near(best.h))))
            if k == 0:
                self._test_memory()
            if k == 0 or (self.readings[-1].contradicted and not self.treads):
                self._test_treads(self.readings[-1])

    @property
    def _base(self) -> Reading | None:
        """A reading of all steps."""
        return self.like or (self.readings[0] if self.readings else None)

    def read(self, line: Line, h: Array) -> Reading:
        """The quotients of one line, as far as the budget goes."""
        return self._reading(quotients(self.J, self.J_0, self.subject, self.gradient, line, h))

    def _test_memory(self) -> None:
        """J(p) once more: a J that starts from its last solution differs now, and the difference counts as noise."""
        value = self.J(self.subject.p) if self.J.left() > 2 else self.J_0
        if value == self.J_0 or not np.isfinite(value) or self.repeated.scatters or self.repeated.by_gradient:
            return
        if self.J.left() > 2 and self.J(self.subject.p) == self.J_0:
            return  # one value that was another
        self.remembers = max(self.remembers, abs(value - self.J_0))
        self._read_again()

    def _test_treads(self, reading: Reading) -> None:
        """Where ranges of steps contradict each other, or the gradient: are the small ones within a tread of J?"""
        if reading.level is None or not (reading.says == "plateau" or reading.contradicted):
            return
        other = min(reading.contradicted, key=lambda a: a.uncertainty, default=None)
        small, large = sorted((reading.level, other or reading.level), key=lambda a: a.h)
        h = large.h if other is not None else max(large.h, MACRO)
        sigma = tread_noise(self.J, self.subject, reading.quotients.line, h)
        ends = small.value, large.value if other is not None else 0.0
        if sigma is not None and sigma > TREADS * reading.noise and abrupt(reading.quotients, *ends, self.J.eps):
            self.treads = sigma
            self._read_again()

    def _read_again(self) -> None:
        """With another noise of J."""
        readings, self.readings = self.readings, []
        self.readings = [self._reading(r.quotients) for r in readings]

    def _extended(self, reading: Reading) -> Reading:
        """With as many steps again, on the better side, where few steps leave a component or the line undecided."""
        frozen = reading.sampled and not reading.moves and bool(reading.slope)
        decided = not frozen and reading.says != "noise" and (reading.index is None or reading.own_scale)
        q = reading.quotients
        if decided or (reading.says in ("plateau", "nothing") and not frozen) or not q.two_sided or not reading.slope:
            return reading
        variation = np.abs(np.diff(q.off_central))
        below = np.nansum(variation[: len(variation) // 2]) < np.nansum(variation[len(variation) // 2 :])
        steps = self.plan.steps
        more = steps[steps < q.h[0]][-len(q.h) :] if below and not frozen else steps[steps > q.h[-1]][: len(q.h)]
        if self.J.left() < 2 * len(more):
            return reading
        return self._reading(q.joined(quotients(self.J, self.J_0, self.subject, self.gradient, q.line, more)))

    def _reading(self, q: Quotients) -> Reading:
        base = self._base if len(q.h) < len(self.plan.steps) else None  # all steps tell the noise better than few
        own = base.noise if base is not None else noise(q, self.J.eps, self.repeated.values)
        sigma = own if base is not None else max(own, self.remembers, self.treads)
        by_nature = self.subject.accuracy * max(self.size, abs(self.J_0))
        natural_change = self._base.change if self._base is not None else 0.0
        changes = stencil_changes(self.subject, q.line.v)
        again = not (self.repeated.scatters or self.remembers)
        return Reading(q, sigma, self.size, self.accepted, by_nature, changes, natural_change, self.J.eps, again)


def _accepted(returned: Returned, accepted: float) -> float:
    """The relative error that counts as agreement."""
    rounding = min(PER_EPS * returned.eps, COARSEST) if returned.eps > DOUBLE else 0.0
    return max(EQUAL, accepted, rounding)
