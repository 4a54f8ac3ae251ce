"""What the quotients on one line say about a gradient: it agrees, it differs, or they cannot tell."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from gradient_routes.bench.verification.breaks import Break, break_at
from gradient_routes.bench.verification.curve import Curve, fit
from gradient_routes.bench.verification.guarded import DOUBLE, FOREIGN
from gradient_routes.bench.verification.plateau import DIFFERENT, Level, level, levels
from gradient_routes.bench.verification.quotients import Quotients
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array
from gradient_routes.problems.transient import ActiveSteps

Says = Literal["agrees", "plateau", "kink", "noise", "nothing"]
RESOLVED = 1e-3  # largest relative uncertainty of a quotient that can judge a gradient
NEARER = 0.1  # the same for smaller steps that contradict larger ones
ZERO = 1e3 * float(np.finfo(np.float64).eps)  # a slope below this part of the change of J is rounding
TINY = 1e-6  # relative jump of one-sided quotients that is not a kink
CLEAR = 10.0  # noises of a quotient beyond which its error is truncation
APART = 0.49  # decades between two ranges of steps that both show a kink: one alone may be noise
NATURAL = 1e-3  # steps from which on the change of J is one of natural size


@dataclass(frozen=True)
class Changes:
    """Of the active set; of a march in time, the steps after which it is another."""

    count: int
    of_steps: bool

    def __str__(self) -> str:
        if not self.of_steps:
            return f"the active set changes {self.count} times"
        return f"the active set of {self.count} step{'s' if self.count > 1 else ''} flips"


@dataclass(frozen=True)
class Reading:
    """Quotients compared with the slope of a gradient.

    noise    standard deviation of J
    size     |g w|_2, the expected slope along natural changes
    accepted relative error that counts as agreement
    by_nature absolute error of slopes that the gradient may have by its nature, as one by finite differences
    changes  step -> active-set changes inside its stencil, where the subject knows
    natural_change  `change` of another line, sampled more widely
    eps      of the precision of J; repeatable: whether J is the same again at the same point
    """

    quotients: Quotients
    noise: float
    size: float
    accepted: float
    by_nature: float = 0.0
    changes: Callable[[float], Changes] | None = None
    natural_change: float = 0.0
    eps: float = DOUBLE
    repeatable: bool = True

    @property
    def name(self) -> str:
        return self.quotients.line.name

    @property
    def index(self) -> int | None:
        """The component, where the line is one."""
        return self.quotients.line.index

    @cached_property
    def level(self) -> Level | None:
        """Of quotient less slope: the gradient is right where the value is zero within its uncertainty."""
        return level(self.quotients.h, self.quotients.off, self._noise_of_quotients, NEARER * self.size)

    @property
    def _noise_of_quotients(self) -> float:
        return self.noise / float(np.sqrt(2.0)) if self.quotients.two_sided else 1.5 * self.noise

    @cached_property
    def ranges(self) -> list[Level]:
        """Every decade of steps whose quotients are one number, to a tenth of the gradient's size."""
        found = levels(self.quotients.h, self.quotients.off, self._noise_of_quotients)
        return [a for a in found if a.uncertainty <= NEARER * max(self.size, abs(a.value))]

    @property
    def contradicted(self) -> list[Level]:
        """Those of them that contradict the level."""
        return [] if self.level is None else [a for a in self.ranges if a.contradicts(self.level)]

    @cached_property
    def slope(self) -> float:
        """g . v, by the gradient."""
        slopes = np.concatenate([self.quotients.s_plus, self.quotients.s_minus])
        known = slopes[np.isfinite(slopes)]
        return float(np.median(known)) if known.size else float("nan")

    def truncation(self, h: float) -> float:
        """The error of quotients at step h, were it c h^2 with the least c of smaller steps that are clear of noise."""
        q = self.quotients
        if self.level is None:
            return float("inf")
        error = np.abs(q.off - self.level.value)
        clear = np.isfinite(error) & (error > CLEAR * self.noise / q.h) & (q.h <= h * (1.0 + 1e-9))
        return float((error / q.h**2)[clear].min()) * h**2 if clear.any() else 0.0

    @property
    def quotient(self) -> float | None:
        """The slope by differences."""
        return None if self.level is None else self.slope + self.level.value

    @cached_property
    def scale(self) -> float:
        """What errors are relative to: a component's own slope where differences resolve it, else the gradient's size.

        A random direction may be nearly orthogonal to the gradient: its errors are always relative to the size. Where
        that is rounding only, as at a minimum, they are relative to what J changes by in natural steps.
        """
        own = abs(self.slope) if self.quotient is None else max(abs(self.slope), abs(self.quotient))
        change = max(self.change, self.natural_change)
        resolved = self.level is not None and self.level.uncertainty <= RESOLVED * own and own > ZERO * change
        if resolved and self.index is not None:
            return own
        whole = max(self.size, own)
        return whole if whole > ZERO * change else change

    @cached_property
    def change(self) -> float:
        """The least |J(p +- h v) - J(p)| / h^2 of natural steps: what J changes by in one of them, were it quadratic.

        The least, for J may grow without bounds where a step is not small: as exp(p) does, or a value for failure.
        """
        q = self.quotients
        seen = np.fmax(np.abs(q.J_plus - q.J), np.abs(q.J_minus - q.J)) / q.h**2
        seen = seen[np.isfinite(seen) & (q.h >= NATURAL)]
        return float(seen.min()) if seen.size else 0.0

    @cached_property
    def moves(self) -> bool:
        """Whether J changes at all along this line."""
        seen = np.concatenate([self.quotients.J_plus, self.quotients.J_minus])
        return bool((np.isfinite(seen) & (seen != self.quotients.J)).any())

    @cached_property
    def broken(self) -> Break | None:
        """The jump of J, or its infinite slope, at p."""
        return break_at(self.quotients, self.eps) if self.repeatable else None

    @property
    def own_scale(self) -> bool:
        """Whether errors are relative to the component's own slope."""
        return self.index is not None and self.scale < self.size

    @property
    def sampled(self) -> bool:
        """Whether J was called on this line at all."""
        return bool(np.isfinite([self.quotients.s_plus, self.quotients.s_minus]).any())

    @property
    def error(self) -> float:
        """|quotient - slope| at the level: what compares readings of one line, whatever each is relative to."""
        return abs(self.level.value) if self.level is not None else 0.0

    @property
    def off(self) -> float:
        """|quotient - slope| / scale at the level."""
        assert self.level is not None
        return abs(self.level.value) / self.scale if self.scale else 0.0

    @property
    def known_to(self) -> float:
        """The uncertainty of `off`."""
        assert self.level is not None
        return self.level.uncertainty / self.scale if self.scale else 0.0

    @cached_property
    def _jump(self) -> Level | None:
        """The difference of the one-sided slopes; None where J is smooth as far as the quotients show."""
        if not self.quotients.two_sided:
            return None
        found = level(self.quotients.h, self.quotients.jump, np.sqrt(6.0) * self.noise, NEARER * self.size)
        if found is None or abs(found.value) <= max(DIFFERENT * found.uncertainty, TINY * self.scale):
            return None
        every = levels(self.quotients.h, self.quotients.jump, np.sqrt(6.0) * self.noise)
        apart = [a for a in every if abs(np.log10(a.h / found.h)) >= APART and not a.contradicts(found)]
        return found if any(abs(a.value) > DIFFERENT * a.uncertainty for a in apart) else None

    @property
    def kink(self) -> float | None:
        """That difference relative to the slopes; None where there is none."""
        if self._jump is None:
            return None
        jump = abs(self._jump.value)
        return jump / max(self.scale, 0.5 * jump)

    @property
    def between(self) -> bool:
        """Whether the slope of the gradient lies between the one-sided slopes, ends included."""
        assert self._jump is not None
        assert self.level is not None
        room = 0.5 * abs(self._jump.value) + DIFFERENT * (self._jump.uncertainty + self.level.uncertainty)
        return abs(self.level.value) <= room

    @cached_property
    def changed(self) -> Changes | None:
        """Active-set changes inside the smallest stencil of the level."""
        return None if self.changes is None or self.level is None else self.changes(self.level.h_min)

    @property
    def inside(self) -> int | None:
        """Their number."""
        return None if self.changed is None else self.changed.count

    @cached_property
    def says(self) -> Says:
        if self.broken is not None:
            return "kink"
        if self.level is None:
            return "nothing"
        if self.kink is not None and self.between:
            return "kink"
        value, uncertainty = abs(self.level.value), self.level.uncertainty
        by_nature = min(self.by_nature, RESOLVED * self.size)
        if value > max(DIFFERENT * uncertainty, self.accepted * self.scale, by_nature):
            return "plateau"
        constant = self.size == 0.0 and not self.moves
        return "agrees" if uncertainty <= RESOLVED * self.scale or constant else "noise"

    @cached_property
    def central(self) -> Curve:
        """The V-curve of central quotients."""
        return self._curve(self.quotients.off_central, np.sqrt(2.0))

    @cached_property
    def one_sided(self) -> Curve:
        return self._curve(self.quotients.off_forward, 1.0)

    @property
    def curve(self) -> Curve:
        """The central one where there is one."""
        return self.central if self.quotients.two_sided else self.one_sided

    def _curve(self, off: Array, quieter: float) -> Curve:
        """Errors relative to the gradient; on a plateau, to the level. The noise of J is divided by `quieter`."""
        if self.level is not None and self.off > DIFFERENT * self.known_to:
            off = off - self.level.value
        scale = self.scale or 1.0
        return fit(self.quotients.h, np.abs(off) / scale, self.noise / scale / quieter)


def stencil_changes(subject: Subject, v: Array) -> Callable[[float], Changes] | None:
    """step -> changes of the active set from p - h v over p to p + h v; points where it is unknown do not count."""
    active_set = subject.active_set
    if active_set is None:
        return None

    def at(q: Array) -> Hashable | None:
        if not subject.inside(q):
            return None
        try:
            found = active_set(q.copy())
            keep = found is None or isinstance(found, ActiveSteps)
            return found if keep else repr(np.asarray(found).tolist())
        except FOREIGN:
            return None

    def changes(h: float) -> Changes:
        known = [found for t in (-1.0, 0.0, 1.0) if (found := at(subject.p + t * h * v)) is not None]
        marched = [found for found in known if isinstance(found, ActiveSteps)]
        if marched:
            return Changes(len({t for a, b in pairwise(marched) for t in a.flips(b)}), of_steps=True)
        return Changes(sum(a != b for a, b in pairwise(known)), of_steps=False)

    return changes
