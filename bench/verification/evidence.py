"""Second evidence: Taylor remainders, complex steps, and the factors of the gradient one by one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gradient_routes.bench.verification.curve import slope
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.line import directions
from gradient_routes.bench.verification.reading import ZERO
from gradient_routes.problems.errors import RoutesError

COUNT = 3  # random directions of complex steps
COMPLEX = 1e-9  # relative: what complex steps and linearized solves of tolerance 1e-12 leave
CLEAR, SMALL = 100.0, 0.1  # noises that a remainder has to exceed; steps from which powers of h are one power
RATE = 0.15  # of the rates 1 and 2 of Taylor remainders


def evidence(seen: Examination) -> Iterator[Finding]:
    """All there is: nothing of it decides a verdict of differences, all of it explains one."""
    yield from taylor(seen)
    yield from complex_steps(seen)
    if seen.subject.explain is not None:
        yield from seen.subject.explain(seen.gradient)


def taylor(seen: Examination) -> Iterator[Finding]:
    """Rates of |J(p + h v) - J(p)| ~ h and |J(p + h v) - J(p) - h g.v| ~ h^2, from the first line's own points."""
    if not seen.readings:
        return
    reading = seen.readings[0]
    made = reading.sweep
    for order, off in ((1, made.forward), (2, made.off_forward)):
        remainder = np.abs(off * made.h)
        clear = (remainder > CLEAR * reading.noise) & (made.h <= SMALL)
        rate = slope(made.h, remainder, clear)
        name = f"Taylor: J(p + h v) - J(p){' - h g.v' if order == 2 else ''} ~ h^{order}"
        if rate is None:
            yield Finding(name, float("nan"), RATE, f"too few steps clear of noise to see a rate of {order}")
        else:
            yield Finding(name, abs(rate - order), RATE, f"rate {rate:.3g}")


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
    size, change = float(np.linalg.norm(exact)), max((r.change for r in seen.readings), default=0.0)
    scale = size if size > ZERO * change else change  # at a minimum slopes are rounding
    off = float(np.linalg.norm(V.T @ seen.gradient - exact)) / (scale or 1.0)
    yield Finding("complex step", off, max(COMPLEX, subject.accuracy), f"{COUNT} directions")
