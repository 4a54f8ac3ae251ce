"""A plateau compared with a second point: whose error is alike there, as no loosely solved J makes it?

A slope s of the gradient, a quotient d and its uncertainty, on the same lines at p and at a second point, and on some
more components at p. Each rule names a kind of mistake; none of them is one that a solver makes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.guarded import Unusable
from gradient_routes.bench.verification.lines import Line, components
from gradient_routes.bench.verification.locate import Located, Worst
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.quotients import quotients
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.problems.problem import Array

LINES, MORE = 4, 6  # lines at the second point, further components at p
GROSS = 2e-2  # relative error of a direction there that no usual tolerance explains
ALIKE = 0.05  # relative scatter of one factor, less 1
SAME = 0.02  # change of one difference, relative to that of the slopes
CLEAR = 30.0  # uncertainties by which a slope, or a difference of slopes, is known
FEW = 3  # lines, those at other points included, whose factor is compared
LEAST = 5e-4  # factor, less 1, of so few lines at p: a fixed number of steps may make a smaller one
FARTHER = 4.0  # times as far as the second point
FEWEST = 2  # exact components, and others off by one factor


@dataclass(frozen=True)
class Pair:
    """Along one line: slope by the gradient, quotient at the step h, uncertainty of the quotient."""

    line: Line
    slope: float
    quotient: float
    uncertainty: float
    h: float

    @property
    def off(self) -> float:
        return self.quotient - self.slope

    @property
    def excess(self) -> float:
        """quotient / slope - 1."""
        return self.off / self.slope

    @property
    def clear(self) -> bool:
        """Whether slope and difference are known well enough to compare factors."""
        known = CLEAR * self.uncertainty
        return abs(self.slope) > known and abs(self.off) > known

    @property
    def exact(self) -> bool:
        return abs(self.off) <= DIFFERENT * self.uncertainty and abs(self.slope) > CLEAR**2 * self.uncertainty


def compared(seen: Examination, reading: Reading, located: Located) -> str | None:
    """What proves the gradient wrong, in words, from the plateau of `reading`; None where nothing does."""
    here = [pair for r in seen.readings if (pair := _pair(r)) is not None]
    here += [_pair_of(w, seen, reading) for w in located.worst if w.index not in {p.line.index for p in here}]
    chosen, pairs = _chosen(here, reading, {w.index for w in located.worst}), []
    for q in _points(seen, len(here)):
        found = _at(seen, q, chosen)
        if found is None:
            continue
        other, there = found
        said = _there(seen, other, chosen, there)
        if said is not None:
            return said
        pairs += there
    factor = _factor([*here, *pairs])
    least = LEAST if len(here) < FEW else 0.0
    if factor is not None and pairs and len(pairs) + len(here) >= FEW and abs(factor - 1.0) >= least:
        return f"slopes of J and of the gradient have the ratio {factor:.6g} on every line, also at a second point"
    return _in_part(seen, [*here, *pairs], _pair(reading))


def _points(seen: Examination, lines: int) -> Iterator[Array]:
    """The second point; a third one farther away on the other side, where lines are few."""
    p, q, subject = seen.subject.p, seen.elsewhere, seen.subject
    if q is not None:
        yield q
        opposite = p - FARTHER * (q - p)
        if lines < FEW and subject.inside(opposite):
            yield opposite


def _there(seen: Examination, other: Examination, before: Sequence[Pair], after: Sequence[Pair]) -> str | None:
    """What the second point alone proves."""
    both = [(b, a) for a in after for b in before if b.line is a.line]
    moved = any(abs(b.quotient - a.quotient) > CLEAR * a.uncertainty for b, a in both)
    if moved and np.array_equal(other.gradient, seen.gradient):
        return "the gradient is the same at a second point, where the slopes of J are others"
    worst = max((abs(p.off) for p in after if p.line.whole), default=0.0)
    if worst > GROSS * other.size > 0.0:
        return f"at a second point it is off by {worst / other.size:.2g}"
    if _constant(both):
        return "slopes of J and of the gradient differ by the same number at a second point: a term is missing"
    return None


def _pair(r: Reading) -> Pair | None:
    if r.level is None or r.quotient is None:
        return None
    return Pair(r.quotients.line, r.slope, r.quotient, r.level.uncertainty, r.level.h)


def _pair_of(w: Worst, seen: Examination, reading: Reading) -> Pair:
    """A component that the search has found, known as well as the line that showed it."""
    assert reading.level is not None
    (line,) = components(seen.subject, [w.index])
    natural = float(seen.subject.natural[w.index])
    return Pair(line, w.given * natural, w.found * natural, reading.level.uncertainty, reading.level.h)


def _chosen(here: Sequence[Pair], reading: Reading, wrong: set[int]) -> list[Pair]:
    """The deciding line first, then wrong components, directions, other components."""

    def order(p: Pair) -> tuple[bool, bool, bool]:
        return p.line is not reading.quotients.line, p.line.index not in wrong, p.line.index is not None

    return sorted(here, key=order)[:LINES]


def _at(seen: Examination, q: Array, pairs: Sequence[Pair]) -> tuple[Examination, list[Pair]] | None:
    """The subject at another point, and the same lines there; None where there is no gradient."""
    if seen.J.left() < 1 + 2 * len(pairs):
        return None
    try:
        other = Examination.lightly(seen.subject.moved(q), seen.plan, seen.J, seen.accepted)
    except Unusable:
        return None
    found = [pair for p in pairs if (pair := _quotient(other, p.line, p)) is not None]
    return (other, found) if found else None


def _quotient(seen: Examination, line: Line, like: Pair) -> Pair | None:
    """By one central difference, at the step that was best and as certain as there."""
    q = quotients(seen.J, seen.J_0, seen.subject, seen.gradient, line, np.array([like.h]))
    slope, off = 0.5 * float(q.s_plus[0] + q.s_minus[0]), float(q.off_central[0])
    return Pair(line, slope, slope + off, like.uncertainty, like.h) if np.isfinite(off) else None


def _factor(pairs: Sequence[Pair]) -> float | None:
    """quotient / slope, where it is one number on every line whose slope is clear, components among them."""
    if not pairs or not all(p.clear for p in pairs if abs(p.slope) > CLEAR * p.uncertainty):
        return None
    excess = np.array([p.excess for p in pairs if p.clear])
    if not excess.size:
        return None
    middle = float(np.median(excess))
    alike = float(np.abs(excess - middle).max()) <= ALIKE * abs(middle)
    return 1.0 + middle if alike and len(excess) >= FEWEST else None


def _constant(both: Sequence[tuple[Pair, Pair]]) -> bool:
    """Whether the differences are the same at both points, while the slopes are not."""
    moved = 0
    for b, a in both:
        change = abs(a.quotient - b.quotient) / (abs(b.quotient) or 1.0)
        known = DIFFERENT * (a.uncertainty + b.uncertainty)
        if abs(a.off - b.off) > max(SAME * min(change, 1.0) * abs(b.off), known):
            return False
        moved += change >= SAME and abs(b.off) > CLEAR * b.uncertainty
    return moved >= FEWEST


def _in_part(seen: Examination, pairs: Sequence[Pair], like: Pair | None) -> str | None:
    """Exact components beside others that are off by one factor, at any point."""
    parts = [p for p in pairs if p.line.index is not None]
    others = np.setdiff1d(np.arange(len(seen.gradient)), [p.line.index for p in parts])
    few = sorted(map(int, np.random.default_rng(seen.plan.seed + 4).permutation(others)[:MORE]))
    if like is not None and seen.J.left() >= 2 * len(few):
        lines = components(seen.subject, few)
        parts += [pair for line in lines if (pair := _quotient(seen, line, like)) is not None]
    exact, off = [p for p in parts if p.exact], [p for p in parts if p.clear]
    factor = _factor(off) if len(off) >= FEWEST <= len(exact) else None
    if factor is None:
        return None
    return f"{len(exact)} slopes along components are exact, {len(off)} are off by the factor {1.0 / factor:.6g}"
