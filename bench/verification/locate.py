"""Which components of a gradient are wrong, by bisection: a direction along half of them tells which half is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.lines import Line, components
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.quotients import Quotients, quotients
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

MOST = 4  # wrong components searched for, beyond those found on the lines of the plan
AROUND = 10.0 ** np.array([-0.5, 0.0, 0.5])  # steps about the best one, to measure a component that was found
SMALL, BESIDE = 1e-2, 1e-3  # an error that small of a component, and beside the largest, is the solver's rest
SEVERAL = 3  # components of the plan, all wrong: the search among the others ends
ALIKE, CLOSE = 0.02, 0.1  # scatter of factors that are one, relative to it, and to its distance from 1


@dataclass(frozen=True)
class Worst:
    """A wrong component: dJ/dp_i given by the gradient and found by differences; share: its error over |g w|_2."""

    name: str
    index: int
    given: float
    found: float
    share: float = 1.0

    @property
    def factor(self) -> float | None:
        """given / found."""
        return self.given / self.found if self.found else None

    @property
    def off(self) -> float:
        """|given - found| relative to the larger."""
        return abs(self.given - self.found) / (max(abs(self.given), abs(self.found)) or 1.0)


@dataclass(frozen=True)
class Located:
    """Wrong components, largest error first, and how many of the others are right; 0 where that is unknown.

    slope      given / found of the whole gradient along the direction that showed the plateau
    everywhere more components are wrong than were searched for
    contrast   the least error of the wrong components over the largest that the right ones may have
    """

    worst: tuple[Worst, ...]
    right: int = 0
    everywhere: bool = False
    slope: float | None = None
    contrast: float = 0.0

    @property
    def factor(self) -> float | None:
        """The common factor of the wrong components and the whole gradient, if there is one."""
        factors = [w.factor for w in self.worst] + [self.slope]
        if len(factors) < 3 or None in factors:
            return None
        values = np.array(factors, dtype=float)
        middle = float(np.median(values))
        alike = min(ALIKE * abs(middle), CLOSE * abs(middle - 1.0))
        return middle if float(np.abs(values - middle).max()) <= alike else None

    def at(self, places: Array | None) -> Located:
        """With the author's own indices."""
        if places is None:
            return self
        return replace(self, worst=tuple(replace(w, index=int(places[w.index])) for w in self.worst))


class Search:
    """Directions along some components, at the one step where noise and truncation are least."""

    def __init__(self, seen: Examination, plateau: Reading) -> None:
        assert plateau.level is not None
        self.seen, self.plateau, self.gradient = seen, plateau, seen.gradient.copy()
        self.h = np.array([plateau.level.h])
        self.allowed = max(DIFFERENT * plateau.level.uncertainty, plateau.accepted * plateau.size, plateau.by_nature)
        self.rng = np.random.default_rng(seen.plan.seed + 1)

    @property
    def ratio(self) -> float | None:
        """The slope given / the quotient found, along the whole direction."""
        return self.plateau.slope / self.plateau.quotient if self.plateau.quotient else None

    def can_call(self, points: int) -> bool:
        """Whether the budget allows two calls at so many steps."""
        return self.seen.J.left() >= 2 * points

    def wrong(self, members: Array) -> bool:
        """Whether a random direction along these components differs by more than the margin allows; two calls."""
        if not len(members):
            return False
        v = np.zeros_like(self.gradient)
        xi = self.rng.choice([-1.0, 1.0], len(members)) * self.rng.uniform(0.75, 1.25, len(members))
        v[members] = xi * self.seen.subject.natural[members]
        return not abs(self._along(Line("", v), self.h).off[0]) <= self.allowed

    def one(self, members: Array) -> int | None:
        """A wrong component among members of which some are; None where the calls do not suffice."""
        while len(members) > 1:
            if not self.can_call(1):
                return None
            left, right = np.array_split(members, 2)
            members = left if self.wrong(left) else right
        return int(members[0])

    def measure(self, i: int) -> Worst | None:
        """The component by differences; None where it agrees."""
        if not self.can_call(len(AROUND)):
            return None
        (line,) = components(self.seen.subject, [i])
        reading = replace(self.plateau, quotients=self._along(line, self.h * AROUND), changes=None)
        return wrong_component(reading, self.seen.subject) if reading.says == "plateau" else None

    def would_show(self, worst: Sequence[Worst], members: Array) -> bool:
        """Whether these components, were they off by the factors of the wrong ones, would have differed."""
        excess = min((abs(w.given - w.found) / (abs(w.found) or abs(w.given)) for w in worst), default=0.0)
        return min(excess, 1.0) * norm2((self.gradient * self.seen.subject.natural)[members]) > self.allowed

    def contrast(self, worst: Sequence[Worst]) -> float:
        """The least error of the wrong components over what the others may be off by."""
        natural = self.seen.subject.natural
        least = min((abs(w.given - w.found) * natural[w.index] for w in worst), default=0.0)
        return least / self.allowed if self.allowed else math.inf

    def _along(self, line: Line, h: Array) -> Quotients:
        return quotients(self.seen.J, self.seen.J_0, self.seen.subject, self.gradient, line, h)


def locate(seen: Examination, search: Search | None) -> Located:
    """The wrong components among those of the plan, and, where a direction shows an error, among the others."""
    known = [r for r in seen.readings if r.index is not None]
    worst = [wrong_component(r, seen.subject) for r in known if r.says == "plateau"]
    n_p = len(seen.gradient)
    if len(known) == n_p:
        agreeing = [r for r in known if r.says == "agrees"]
        everywhere, slope = len(worst) == n_p > 1, None if search is None else search.ratio
        return _sorted(worst, len(agreeing), everywhere, slope, _contrast_of(known, agreeing))
    if search is None:
        return _sorted(worst)
    for w in worst:
        search.gradient[w.index] = w.found
    others = np.setdiff1d(np.arange(n_p), [r.index for r in known])
    for _ in range(MOST + len(known) - len(worst)):
        if not search.can_call(1):
            return _sorted(worst)
        if not search.wrong(others):
            right = n_p - len(worst) if search.would_show(worst, others) else 0
            return _sorted(worst, right, contrast=search.contrast(worst))
        if len(worst) == len(known) >= SEVERAL:
            break
        i = search.one(others)
        found = None if i is None else search.measure(i)
        if found is None:
            return _sorted(worst)
        worst.append(found)
        search.gradient[found.index] = found.found
        others = np.setdiff1d(others, [found.index])
    return _sorted(worst, everywhere=True, slope=search.ratio)


def _contrast_of(known: Sequence[Reading], agreeing: Sequence[Reading]) -> float:
    """Of components that have all been read."""
    right = max((abs(r.level.value) + r.level.uncertainty for r in agreeing if r.level is not None), default=0.0)
    wrong = min((abs(r.level.value) for r in known if r.says == "plateau" and r.level is not None), default=0.0)
    return wrong / right if right else math.inf if wrong else 0.0


def wrong_component(reading: Reading, subject: Subject) -> Worst:
    i, quotient, level = reading.index, reading.quotient, reading.level
    assert i is not None
    assert quotient is not None
    assert level is not None
    w = float(subject.natural[i])
    found = quotient / w if abs(quotient) > level.uncertainty else 0.0
    return Worst(subject.label(i), i, reading.slope / w, found, abs(level.value) / (reading.size or abs(level.value)))


def _sorted(
    worst: Sequence[Worst],
    right: int = 0,
    everywhere: bool = False,
    slope: float | None = None,
    contrast: float = 0.0,
) -> Located:
    largest = max((w.share for w in worst), default=0.0)
    ordered = sorted(worst, key=lambda w: -abs(w.given - w.found))
    ordered = [w for w in ordered if w.off >= SMALL or w.share >= BESIDE * largest]
    return Located(tuple(ordered), right, everywhere, slope, contrast)
