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
FARTHER = 4.0  # times as far as the second point
FEWEST = 2  # exact components, and others off by one factor


@dataclass(frozen=True)
class Pair:
    """Along one line: slope by the gradient, quotient, uncertainty of the quotient."""

    line: Line
    slope: float
    quotient: float
    uncertainty: float

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


def compared(seen: Examination, reading: Reading) -> str | None:
    """What proves the gradient wrong, in words, from the plateau of `reading`; None where nothing does."""
    assert reading.level is not None
    h, uncertainty = reading.level.h, reading.level.uncertainty
    here = [pair for r in seen.readings if (pair := _pair(r)) is not None]
    chosen, pairs = _chosen(here, reading), []
    for q in _points(seen, len(here)):
        found = _at(seen, q, [p.line for p in chosen], h, uncertainty)
        if found is None:
            continue
        other, there = found
        said = _there(seen, other, chosen, there)
        if said is not None:
            return said
        pairs += there
    factor = _factor([*here, *pairs])
    if factor is not None and pairs and len(pairs) + len(here) >= FEW:
        return f"slopes of J and of the gradient have the ratio {factor:.6g} on every line, also at a second point"
    return _in_part(seen, here, h, uncertainty)


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
    return Pair(r.quotients.line, r.slope, r.quotient, r.level.uncertainty)


def _chosen(here: Sequence[Pair], reading: Reading) -> list[Pair]:
    """The deciding line first, then directions, then components."""
    ordered = sorted(here, key=lambda p: (p.line is not reading.quotients.line, p.line.index is not None))
    return ordered[:LINES]


def _at(
    seen: Examination, q: Array, lines: Sequence[Line], h: float, uncertainty: float
) -> tuple[Examination, list[Pair]] | None:
    """The subject at another point, and pairs there; None where there is no gradient."""
    if seen.J.left() < 1 + 2 * len(lines):
        return None
    try:
        other = Examination.lightly(seen.subject.moved(q), seen.plan, seen.J, seen.accepted)
    except Unusable:
        return None
    pairs = _quotients(other, lines, h, uncertainty)
    return (other, pairs) if pairs else None


def _quotients(seen: Examination, lines: Sequence[Line], h: float, uncertainty: float) -> list[Pair]:
    """By one central difference each, at the step that was best."""
    found = []
    for line in lines:
        q = quotients(seen.J, seen.J_0, seen.subject, seen.gradient, line, np.array([h]))
        slope, off = 0.5 * float(q.s_plus[0] + q.s_minus[0]), float(q.off_central[0])
        if np.isfinite(off):
            found.append(Pair(line, slope, slope + off, uncertainty))
    return found


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
    pairs = [(b, a) for b, a in both if abs(b.off) > CLEAR * b.uncertainty]
    if len(pairs) < FEWEST:
        return False
    for b, a in pairs:
        moved = abs(a.quotient / b.quotient - 1.0) if b.quotient else 1.0
        if moved < SAME or abs(a.off / b.off - 1.0) > SAME * moved:
            return False
    return True


def _in_part(seen: Examination, here: Sequence[Pair], h: float, known: float) -> str | None:
    """Exact components beside others that are off by one factor."""
    tested = [p.line.index for p in here if p.line.index is not None]
    others = np.setdiff1d(np.arange(len(seen.gradient)), tested)
    rng = np.random.default_rng(seen.plan.seed + 4)
    few = sorted(map(int, rng.permutation(others)[:MORE]))
    more = _quotients(seen, components(seen.subject, few), h, known) if seen.J.left() >= 2 * len(few) else []
    parts = [p for p in here if p.line.index is not None] + more
    exact, off = [p for p in parts if p.exact], [p for p in parts if p.clear]
    factor = _factor(off) if len(off) >= FEWEST <= len(exact) else None
    if factor is None or len(exact) + len(off) < len(parts):
        return None
    return f"{len(exact)} components are exact, {len(off)} are off by the factor {1.0 / factor:.6g}"
