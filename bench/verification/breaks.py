"""J that breaks at p: it jumps to another value on one side, or its slope there is infinite.

Told from the increments J(p + h v) - J(p) of a deterministic J at the least steps, where a smooth J has rounding only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradient_routes.bench.verification.quotients import Quotients
from gradient_routes.problems.problem import Array

ROUNDINGS = 1e3  # roundings of J that an increment must exceed
CONSTANT = 0.02  # relative scatter of increments that are one number
DECADES, POINTS = 3.0, 5  # of steps over which they must be
INFINITE = 0.8  # rate of increments ~ h^rate below which the slope of J is infinite
BOUNDED = 0.15  # rate above which they are no jump


@dataclass(frozen=True)
class Break:
    """A jump of J by `size` on the sides named, or a slope that grows like h^(rate - 1)."""

    kind: Literal["jump", "infinite slope"]
    size: float
    sides: tuple[str, ...]


def break_at(q: Quotients, eps: float) -> Break | None:
    """The break of J at p along a line, None where the increments show none."""
    sides = {"ahead": q.J_plus - q.J, "behind": q.J_minus - q.J}
    rounding = ROUNDINGS * eps * abs(q.J)
    jumps = {side: size for side, dJ in sides.items() if (size := _jump(q.h, dJ, rounding))}
    if jumps:
        return Break("jump", max(jumps.values(), key=abs), tuple(jumps))
    rates = {side: rate for side, dJ in sides.items() if (rate := _infinite(q.h, dJ, rounding))}
    return Break("infinite slope", min(rates.values()), tuple(rates)) if rates else None


def _jump(h: Array, dJ: Array, rounding: float) -> float | None:
    """The increment of the least steps, where it is the same one over some decades."""
    known = np.isfinite(dJ)
    h, dJ = h[known], dJ[known]
    if len(h) < POINTS or abs(dJ[0]) <= rounding:
        return None
    other = np.flatnonzero(np.abs(dJ - dJ[0]) > CONSTANT * abs(dJ[0]))
    last = (int(other[0]) if other.size else len(h)) - 1
    lasts = last + 1 >= POINTS and h[last] / h[0] >= 10.0**DECADES * (1.0 - 1e-9)
    return float(dJ[0]) if lasts else None


def _infinite(h: Array, dJ: Array, rounding: float) -> float | None:
    """The rate of the least increments clear of rounding, where it is the same one below 1 over some decades."""
    known = np.isfinite(dJ) & (np.abs(dJ) > rounding)
    h, size = np.log10(h[known]), np.log10(np.abs(dJ[known]))
    if len(h) < POINTS or h[-1] - h[0] < DECADES:
        return None
    least = h <= h[0] + DECADES + 1e-9
    if np.count_nonzero(least) < POINTS:
        return None
    rates = np.diff(size[least]) / np.diff(h[least])
    rate = float(np.median(rates))
    alike = float(np.abs(rates - rate).max()) <= BOUNDED
    return rate if BOUNDED < rate < INFINITE and alike else None
