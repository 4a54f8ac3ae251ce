"""Evidence beside difference quotients: Taylor remainders, complex steps, and the gradient factor by factor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gradient_routes.bench.verification.curve import slope
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.guarded import FOREIGN, gradient_of, one_line
from gradient_routes.bench.verification.lines import directions
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import ZERO
from gradient_routes.bench.verification.result import FRESH_J
from gradient_routes.problems.errors import RoutesError

COUNT = 3  # random directions of complex steps
COMPLEX = 1e-9  # relative error left by complex steps and linearized solves of tolerance 1e-12
FRESH = 1e-6  # relative difference of two ways to compute J
TIMES, SCALED = 1e9, 1e-4  # by which J is scaled, and the relative difference of gradients that its solver may leave
CLEAR = 100.0  # noises that a remainder has to exceed
LARGEST = 0.1  # step below which the remainder is dominated by one power of h
SECOND = 2
RATE = 0.15  # tolerance of rates
SCATTER = 0.4  # part of a rate below which a remainder is noise of J; a jump of J is told by itself
DECADES = 10.0**2.5  # of steps whose remainders tell a rate


def evidence(seen: Examination) -> Iterator[Finding]:
    """All that the subject allows. It explains a verdict; agreement is decided by difference quotients."""
    yield from taylor(seen)
    yield from complex_steps(seen)
    yield from fresh_value(seen)
    yield from scaled_gradient(seen)
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


def fresh_value(seen: Examination) -> Iterator[Finding]:
    """J at a second point, by the objective and computed anew: a recording may replay what held at p only."""
    subject, q = seen.subject, seen.elsewhere
    if subject.fresh is None:
        return
    if q is None or seen.J.left() < 2:
        yield Finding(FRESH_J, float("nan"), FRESH, "not compared: no second point, or no calls left")
        return
    value, anew = seen.J(q), seen.J.sharing(subject.fresh)(q)
    off = abs(value - anew) / (max(abs(value), abs(anew), abs(value - seen.J_0)) or 1.0)
    limit = max(FRESH, CLEAR * seen.readings[0].noise / (abs(anew) or 1.0))
    says = f"{value:.10g} and {anew:.10g} at a second point"
    culprit = None if not off > limit else "the recording: it gives another J at a second point than J computed anew"
    yield Finding(FRESH_J, off, limit, says, culprit)


def scaled_gradient(seen: Examination) -> Iterator[Finding]:
    """The gradient of J times 1e9, over 1e9: an absolute tolerance inside a linear solve shows so."""
    if seen.subject.scaled is None:
        return
    w, g = seen.subject.natural, seen.gradient
    try:
        seen.J.account.gradients += 1
        other = gradient_of(seen.subject.scaled(TIMES)).gradient / TIMES
    except FOREIGN as failure:
        yield Finding("gradient of J x 1e9", float("nan"), SCALED, one_line(failure))
        return
    size = max(float(np.linalg.norm(g * w)), float(np.linalg.norm(other * w)))
    off = float(np.linalg.norm((other - g) * w)) / (size or 1.0)
    culprit = None if off <= SCALED else "an absolute tolerance: the gradient does not grow with J"
    yield Finding("gradient of J x 1e9 against 1e9 times the gradient", off, SCALED, culprit=culprit)
