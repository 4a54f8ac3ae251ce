"""Evidence beside difference quotients: Taylor remainders, complex steps, and the gradient factor by factor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gradient_routes.bench.verification.curve import slope
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.lines import directions
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import ZERO
from gradient_routes.problems.errors import RoutesError

COUNT = 3  # random directions of complex steps
COMPLEX = 1e-9  # relative error left by complex steps and linearized solves of tolerance 1e-12
CLEAR = 100.0  # noises that a remainder has to exceed
LARGEST = 0.1  # step below which the remainder is dominated by one power of h
SECOND = 2
RATE = 0.15  # tolerance of rates
SCATTER = 0.3  # part of a rate below which a remainder is noise of J; a jump of J is told by itself
DECADES = 10.0**2.5  # of steps whose remainders tell a rate


def evidence(seen: Examination) -> Iterator[Finding]:
    """All that the subject allows. It explains a verdict; agreement is decided by difference quotients."""
    yield from taylor(seen)
    yield from complex_steps(seen)
    if seen.subject.explain is not None:
        yield from seen.subject.explain(seen.gradient)


def taylor(seen: Examination) -> Iterator[Finding]:
    """Rates of |J(p + h v) - J(p)| ~ h and |J(p + h v) - J(p) - h g.v| ~ h^2, on the first line.

    Of the least steps at which they are clear of the noise. What falls faster is sound: a slope of zero, a curvature of
    zero; a remainder that falls like h is not, nor is a change of J that falls more slowly than h.
    """
    reading = seen.readings[0]
    q = reading.quotients
    for order, off, less, least in ((1, q.forward, "", 1.0), (2, q.off_forward, " - h g.v", 1.0 + 2.0 * RATE)):
        remainder = np.abs(off * q.h)
        clear = (remainder > CLEAR * reading.noise) & (q.h <= LARGEST)
        if order == SECOND:  # a gradient of few digits is as far off as they are
            clear &= np.abs(off) > DIFFERENT * reading.accepted * reading.size
        if clear.any():
            clear &= q.h <= DECADES * q.h[clear].min()
        rate = slope(q.h, remainder, clear)
        scatters = rate is not None and rate < SCATTER * order
        value = float("nan") if rate is None or scatters else max(least - rate, 0.0)
        says = f"too few steps above the noise to measure the rate {order}" if rate is None else f"rate {rate:.3g}"
        says += ": noise" if scatters else ""
        yield Finding(f"Taylor: J(p + h v) - J(p){less} ~ h^{order}", value, RATE, says)


def complex_steps(seen: Examination) -> Iterator[Finding]:
    """V^T g against Im J(p + i h v) / h."""
    subject = seen.subject
    if subject.slopes is None:
        return
    V = np.column_stack([line.v for line in directions(subject, COUNT, seen.plan.seed + 2)])
    try:
        exact = subject.slopes(V)
    except RoutesError as failure:
        yield Finding("complex step", float("nan"), COMPLEX, str(failure))
        return
    size, change = float(np.linalg.norm(exact)), max(r.change for r in seen.readings)
    scale = size if size > ZERO * change else change  # at a minimum slopes are rounding
    off = float(np.linalg.norm(V.T @ seen.gradient - exact)) / (scale or 1.0)
    yield Finding("complex step", off, max(COMPLEX, subject.accuracy), f"{COUNT} directions")
