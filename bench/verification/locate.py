"""Which components of a gradient are wrong, by halving: a direction restricted to half of them tells which half."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.line import Line, components, sweep
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

MOST = 4  # wrong components searched for; more make the whole gradient suspect
AROUND = 10.0 ** np.array([-0.5, 0.0, 0.5])  # steps about the best one, to measure a component that was found
ALIKE = 0.02  # relative scatter of factors that are one factor


@dataclass(frozen=True)
class Worst:
    """A wrong component: given and by differences, dJ/dp_i both."""

    name: str
    index: int
    given: float
    found: float

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
    """worst components, largest first, and right, how many others were then found right; 0 where that is not known.

    slope      given / found of the whole gradient along the direction that showed the plateau
    everywhere more are wrong than were searched for
    """

    worst: tuple[Worst, ...]
    right: int = 0
    everywhere: bool = False
    slope: float | None = None

    @property
    def factor(self) -> float | None:
        """The one factor that the wrong components and the whole gradient are off by, if there is one."""
        factors = [w.factor for w in self.worst] + [self.slope]
        if len(factors) < 3 or None in factors:
            return None
        values = np.array(factors, dtype=float)
        middle = float(np.median(values))
        return middle if float(np.abs(values - middle).max()) <= ALIKE * abs(middle) else None


class Search:
    """Restricted directions at one step, against what noise and truncation allow at that step."""

    def __init__(self, J: Guarded, J_0: float, subject: Subject, gradient: Array, plateau: Reading, seed: int) -> None:
        assert plateau.level is not None
        self.J, self.J_0, self.subject = J, J_0, subject
        self.gradient, self.w = gradient.copy(), subject.natural
        self.h = np.array([plateau.level.h])
        self.allowed = max(DIFFERENT * plateau.level.uncertainty, plateau.accepted * plateau.size, plateau.by_nature)
        self.rng = np.random.default_rng(seed)
        self.plateau = plateau

    @property
    def ratio(self) -> float | None:
        """The slope given / the quotient found, along the whole direction."""
        return self.plateau.slope / self.plateau.quotient if self.plateau.quotient else None

    def off(self, members: Array) -> float:
        """|quotient - slope| along a random direction of these components; two calls."""
        v = np.zeros_like(self.w)
        xi = self.rng.choice([-1.0, 1.0], len(members)) * self.rng.uniform(0.75, 1.25, len(members))
        v[members] = xi * self.w[members]
        s = sweep(self.J, self.J_0, self.subject, self.gradient, Line("", v), self.h)
        off = s.off_central if s.two_sided else s.off_forward
        return float(np.abs(off[0]))

    def wrong(self, members: Array) -> bool:
        return len(members) > 0 and not self.off(members) <= self.allowed

    def one(self, members: Array) -> int | None:
        """A component among members that are wrong together: the left half tells which half; None without calls."""
        while len(members) > 1:
            if self.J.left() < 2:
                return None
            left, right = np.array_split(members, 2)
            members = left if self.wrong(left) else right
        return int(members[0])

    def measure(self, i: int) -> Worst | None:
        """The component by differences; None where it agrees after all."""
        if self.J.left() < 2 * len(AROUND):
            return None
        (line,) = components(self.subject, [i])
        s = sweep(self.J, self.J_0, self.subject, self.gradient, line, self.h * AROUND)
        like = self.plateau
        reading = Reading(s, like.noise, like.size, like.accepted, like.by_nature)
        return wrong_component(reading, self.subject) if reading.says == "plateau" else None


def locate(search: Search | None, known: Sequence[Reading], subject: Subject) -> Located:
    """Find wrong components; `known` are readings of components that were looked at anyway, to which it is confined
    where no direction shows that there is anything to search for."""
    worst = [wrong_component(r, subject) for r in known if r.says == "plateau"]
    if search is None:
        return _sorted(worst)
    n_p = len(search.gradient)
    if len(worst) == len(known) >= 3:
        return _sorted(worst, everywhere=True, slope=search.ratio)
    looked_at = [r.sweep.line.index for r in known if r.sweep.line.index is not None]
    if len(looked_at) == n_p:
        return _sorted(worst, right=n_p - len(worst))
    for w in worst:
        search.gradient[w.index] = w.found
    others = np.setdiff1d(np.arange(n_p), looked_at)
    while len(worst) < MOST + len(known):
        if search.J.left() < 2:
            return _sorted(worst)
        if not search.wrong(others):
            return _sorted(worst, right=n_p - len(worst))
        i = search.one(others)
        found = None if i is None else search.measure(i)
        if found is None:
            return _sorted(worst)
        worst.append(found)
        search.gradient[found.index] = found.found
        others = np.setdiff1d(others, [found.index])
    return _sorted(worst, everywhere=True, slope=search.ratio)


def wrong_component(reading: Reading, subject: Subject) -> Worst:
    i, quotient = reading.sweep.line.index, reading.quotient
    assert i is not None
    assert quotient is not None
    assert reading.level is not None
    w = float(subject.natural[i])
    found = quotient / w if abs(quotient) > reading.level.uncertainty else 0.0
    return Worst(subject.label(i), i, reading.slope / w, found)


def _sorted(worst: list[Worst], right: int = 0, everywhere: bool = False, slope: float | None = None) -> Located:
    return Located(tuple(sorted(worst, key=lambda w: -abs(w.given - w.found))), right, everywhere, slope)
