"""What the quotients on one line say of a gradient: it agrees, it is off by so much, or they cannot tell."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from gradient_routes.bench.verification.curve import Curve, fit
from gradient_routes.bench.verification.guarded import FOREIGN
from gradient_routes.bench.verification.line import Sweep
from gradient_routes.bench.verification.plateau import DIFFERENT, Level, level
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

Says = Literal["agrees", "plateau", "kink", "noise", "nothing"]
RESOLVED = 1e-3  # relative uncertainty of a quotient that can judge anything
NEARER = 0.1  # the same of smaller steps that contradict larger ones
ZERO = 1e3 * float(np.finfo(np.float64).eps)  # of what J changes by in natural steps, a slope that is rounding
TINY = 1e-6  # relative jump of one-sided quotients that is no kink worth the name


@dataclass(frozen=True)
class Reading:
    """A sweep read against a gradient.

    noise    standard deviation of J
    size     |g w|_2, what slopes along natural changes are to be compared with
    accepted relative error that is none
    by_nature error of slopes that is none: of gradients made of differences, say, which know nothing of components
    natural_change  what J was seen to change by in natural steps along another line
    changes  step -> how often the active set changes inside its stencil, where the subject knows
    """

    sweep: Sweep
    noise: float
    size: float
    accepted: float
    by_nature: float = 0.0
    changes: Callable[[float], int] | None = None
    natural_change: float = 0.0

    @cached_property
    def level(self) -> Level | None:
        """Of quotient less slope: where its value is zero within its uncertainty, the gradient is right."""
        s = self.sweep
        q, noise = (s.off_central, self.noise / np.sqrt(2.0)) if s.two_sided else (s.off_forward, 1.5 * self.noise)
        return level(s.h, q, noise, NEARER * self.size)

    @cached_property
    def slope(self) -> float:
        """g . v, as the gradient says."""
        slopes = np.concatenate([self.sweep.s_plus, self.sweep.s_minus])
        known = slopes[np.isfinite(slopes)]
        return float(np.median(known)) if known.size else float("nan")

    @property
    def quotient(self) -> float | None:
        """The slope that differences give."""
        return None if self.level is None else self.slope + self.level.value

    @cached_property
    def scale(self) -> float:
        """What errors are relative to: a component's own slope where differences resolve it, else the gradient's.

        A random direction may meet a gradient at any angle: its errors are always relative to the gradient. Where that
        is zero up to rounding, as at a minimum, they are relative to what J changes by in natural steps.
        """
        own = abs(self.slope) if self.quotient is None else max(abs(self.slope), abs(self.quotient))
        change = max(self.change, self.natural_change)
        known = self.level is not None and self.level.uncertainty <= RESOLVED * own and own > ZERO * change
        if known and self.sweep.line.index is not None:
            return own
        whole = max(self.size, own)
        return whole if whole > ZERO * change else change

    @cached_property
    def change(self) -> float:
        """The largest |J(p +- h v) - J(p)| seen."""
        seen = np.abs(np.concatenate([self.sweep.J_plus, self.sweep.J_minus]) - self.sweep.J)
        return float(np.nanmax(seen)) if np.isfinite(seen).any() else 0.0

    @property
    def own_scale(self) -> bool:
        """Whether that is a component's own slope."""
        return self.sweep.line.index is not None and self.scale < self.size

    @property
    def looked_at(self) -> bool:
        """Whether there were calls left for it."""
        return bool(np.isfinite(self.sweep.s_plus).any() or np.isfinite(self.sweep.s_minus).any())

    @property
    def off(self) -> float:
        """|quotient - slope| / scale at the level."""
        assert self.level is not None
        return abs(self.level.value) / self.scale if self.scale else 0.0

    @property
    def known_to(self) -> float:
        """Uncertainty of that."""
        assert self.level is not None
        return self.level.uncertainty / self.scale if self.scale else 0.0

    @cached_property
    def _jump(self) -> Level | None:
        """Between one-sided slopes, where it is one; None where J is smooth as far as quotients tell."""
        if not self.sweep.two_sided:
            return None
        found = level(self.sweep.h, self.sweep.jump, np.sqrt(6.0) * self.noise, NEARER * self.size)
        if found is None or abs(found.value) <= max(DIFFERENT * found.uncertainty, TINY * self.scale):
            return None
        return found

    @property
    def kink(self) -> float | None:
        """That jump, relative to the slopes; None where there is none."""
        if self._jump is None:
            return None
        jump = abs(self._jump.value)
        return jump / max(self.scale, 0.5 * jump)

    @property
    def between(self) -> bool:
        """Whether the gradient's slope lies between the one-sided ones, or is one of them."""
        assert self._jump is not None
        assert self.level is not None
        room = 0.5 * abs(self._jump.value) + DIFFERENT * (self._jump.uncertainty + self.level.uncertainty)
        return abs(self.level.value) <= room

    @cached_property
    def inside(self) -> int | None:
        """Changes of the active set inside the stencil that the level rests on."""
        if self.changes is None or self.level is None:
            return None
        return self.changes(self.level.h_min)

    @cached_property
    def says(self) -> Says:
        if self.level is None:
            return "nothing"
        if (self.kink is not None and self.between) or (self.kink is None and self.inside):
            return "kink"
        value, uncertainty = abs(self.level.value), self.level.uncertainty
        by_nature = min(self.by_nature, RESOLVED * self.size)
        if value > max(DIFFERENT * uncertainty, self.accepted * self.scale, by_nature):
            return "plateau"
        nothing_changes = self.size == 0.0 == self.change
        return "agrees" if uncertainty <= RESOLVED * self.scale or nothing_changes else "noise"

    # --- the curves a person looks at

    def errors(self, central: bool) -> Array:
        """Relative errors (m,) of the quotients: of the gradient; on a plateau, of the level instead."""
        off = self.sweep.off_central if central else self.sweep.off_forward
        if self.level is not None and self.off > DIFFERENT * self.known_to:
            off = off - self.level.value
        return np.asarray(np.abs(off) / (self.scale or 1.0))

    @cached_property
    def central(self) -> Curve:
        return fit(self.sweep.h, self.errors(central=True), self.noise / (self.scale or 1.0) / np.sqrt(2.0))

    @cached_property
    def one_sided(self) -> Curve:
        return fit(self.sweep.h, self.errors(central=False), self.noise / (self.scale or 1.0))


def stencil_changes(subject: Subject, v: Array) -> Callable[[float], int] | None:
    """step -> changes of the active set from p - h v over p to p + h v; points where it is not known do not count."""
    active_set = subject.active_set
    if active_set is None:
        return None

    def at(q: Array) -> Hashable | None:
        if not subject.inside(q):
            return None
        try:
            found = active_set(q.copy())
            return found if found is None else repr(np.asarray(found).tolist())
        except FOREIGN:
            return None

    def changes(h: float) -> int:
        known = [found for t in (-1.0, 0.0, 1.0) if (found := at(subject.p + t * h * v)) is not None]
        return sum(a != b for a, b in pairwise(known))

    return changes
