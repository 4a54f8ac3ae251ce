"""The lines of a check again, the forward solve tightened."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.guarded import FOREIGN
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Tightened
from gradient_routes.problems.problem import Array

FACTORS = (1e-3, 1e-6, 1e-9, 1e-12)  # of the forward tolerance; the third and fourth where the second changed nothing
FELL = 0.1  # of a plateau: the solver was to blame for most of it, and what is left may be its, too
TWO = 2  # factors that are tried where each changes something
SWEEP = 2.5  # decades about the best step over which a line is swept, to see the noise of the tightened J
BESIDE = 0.5  # decades about its best step, where another line is read
LINES = 5  # read again: directions, and components that differed


def tighten(seen: Examination, reading: Reading) -> tuple[tuple[Tightened, ...], Examination | None, str | None]:
    """The lines with tighter forward solves, until they agree; the last examination; why that stopped early."""
    found: list[Tightened] = []
    last: Examination | None = None
    noise = reading.says == "noise"  # takes a sweep of all steps
    for factor in (FACTORS[1], FACTORS[0]) if noise else FACTORS:
        again = _tightened(seen, reading, factor)
        if isinstance(again, str):
            return tuple(found), last, again
        stuck = last is not None and _same(again[1], last) and _fell(again[0].reading, reading)
        found.append(again[0])
        last = again[1]
        if found[-1].sound or (len(found) >= TWO and not stuck):
            break
    return tuple(found), last, None


def _same(a: Examination, b: Examination) -> bool:
    """Whether J(p) and the gradient are the same numbers: the solver took the same iterate."""
    return a.J_0 == b.J_0 and np.array_equal(a.gradient, b.gradient)


def _fell(after: Reading, before: Reading) -> bool:
    return after.level is not None and before.level is not None and after.error < FELL * before.error


def _tightened(seen: Examination, reading: Reading, factor: float) -> tuple[Tightened, Examination] | str:
    """With one factor, or the reason why it was not possible."""
    assert seen.subject.tighten is not None
    lines = _lines(seen.readings, reading)
    steps = _steps(seen, reading)
    needed = 2 * len(steps) + 1
    if seen.J.left() < needed:
        return f"the forward solve was not tightened by {factor:g}: {seen.J.left():g} calls left, {needed} needed"
    try:
        subject = seen.subject.tighten(factor)
        other = Examination.lightly(subject, seen.plan, seen.J.sharing(subject.objective), seen.accepted)
    except FOREIGN as failure:
        return f"tighten({factor:g}) failed: {type(failure).__name__}: {failure}"
    first = other.read(lines[0].quotients.line, steps)
    if first.says == "nothing":
        return f"J tightened by {factor:g} cannot be evaluated along {lines[0].name}"
    other.readings.append(first)
    h = first.level.h if first.level is not None else reading.quotients.h[0]
    for line in lines[1:]:
        near = seen.plan.near(h, BESIDE)
        if seen.J.left() >= 2 * len(near):
            other.readings.append(other.read(line.quotients.line, near))
    gradient_moved = norm2((other.gradient - seen.gradient) * seen.subject.natural)
    tight = next((r for r in other.readings if r.quotients.line is reading.quotients.line), first)
    before, after = reading.quotient, tight.quotient
    quotient_moved = math.nan if before is None or after is None else abs(after - before)
    relative = _relative(gradient_moved, seen.size), _relative(quotient_moved, reading.scale)
    changed = other.J_0 != seen.J_0 or not np.array_equal(other.gradient, seen.gradient)
    return Tightened(factor, tight, tuple(other.readings), *relative, changed), other


def _lines(readings: Sequence[Reading], reading: Reading) -> list[Reading]:
    """A whole line first, the deciding one where it is; then it, the other whole lines, the worst components."""
    whole = [reading] if reading.quotients.line.whole else []
    whole += [r for r in readings if r.quotients.line.whole and r is not reading]
    parts = [r for r in readings if not r.quotients.line.whole and r.says == "plateau" and r is not reading]
    parts.sort(key=lambda r: -r.off)
    beside = [] if reading in whole[:1] or not whole else [reading]
    return [*(whole[:1] or [reading]), *beside, *whole[1:], *parts][:LINES]


def _steps(seen: Examination, reading: Reading) -> Array:
    """Those of the first line: all, or some decades about the best one."""
    if seen.plan.everywhere or reading.level is None or reading.says == "noise":
        return seen.plan.steps
    return seen.plan.near(reading.level.h, SWEEP)


def _relative(value: float, scale: float) -> float:
    return value / scale if scale else value
