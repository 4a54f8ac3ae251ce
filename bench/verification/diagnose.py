"""On a plateau: does it move when the forward solve is tightened, does it shrink with the mesh?"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.gradient_call import Unusable
from gradient_routes.bench.verification.guarded import FOREIGN
from gradient_routes.bench.verification.line import directions
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Refined, Tightened
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Array

FACTORS = (1e-3, 1e-6)  # of the forward tolerance
FALLEN, STANDS = 1.0 / 3.0, 0.9  # of a plateau: it has fallen; it stands still
BESIDE = 0.5  # decades on both sides of the best step, where a line is looked at once more
SHRINKS = 0.6  # order in h from which on a plateau is one of the discretization
EXACT = 1e-6  # relative: of adjoints by solves to 1e-12


def falls(before: Reading, tightened: Sequence[Tightened]) -> bool:
    """Whether what stood in the way is gone when the solve is tightened, or still on its way down at the end."""
    if not tightened:
        return False
    last = tightened[-1].reading
    if last.says == "agrees":
        return True
    earlier = tightened[-2].reading if len(tightened) > 1 else before
    plateaus = before.says == last.says == earlier.says == "plateau"
    return plateaus and last.off < FALLEN * before.off and last.off < STANDS * earlier.off


def moves(before: Reading, tightened: Sequence[Tightened]) -> bool:
    """Whether it went down, but by less than would tell whose it is."""
    if not tightened:
        return False
    earlier = tightened[-2].reading if len(tightened) > 1 else before
    return earlier.says == "plateau" and tightened[-1].reading.off < STANDS * earlier.off


def tighten(seen: Examination, reading: Reading) -> tuple[tuple[Tightened, ...], str | None]:
    """The line of `reading` with a tighter forward solve, and a tighter one until nothing stands there any more.

    And why that ended early, where it did.
    """
    found: list[Tightened] = []
    for factor in reversed(FACTORS) if reading.says == "noise" else FACTORS:  # noise takes a sweep of all steps
        again = _again(seen, reading, factor)
        if isinstance(again, str):
            return tuple(found), again
        found.append(again)
        if again.reading.says == "agrees":
            break
    return tuple(found), None


def _again(seen: Examination, reading: Reading, factor: float) -> Tightened | str:
    """In words where the tightened subject cannot be had, or its calls are not left."""
    assert seen.subject.tighten is not None
    plan, line = seen.plan, reading.sweep.line
    near = not plan.everywhere and reading.level is not None and reading.says != "noise"
    h = plan.near(reading.level.h) if near and reading.level is not None else plan.steps
    needed = 2 * len(h) + 2
    if seen.J.left() < needed:
        return f"the forward solve was not tightened by {factor:g}: {seen.J.left():g} calls left, {needed} needed"
    try:
        subject = seen.subject.tighten(factor)
        other = Examination.of(subject, plan, seen.J.sharing(subject.objective), seen.accepted)
    except FOREIGN as failure:
        return f"tighten({factor:g}) gave nothing to look at: {type(failure).__name__}: {failure}"
    if near:
        other.readings.append(reading)  # tells the noise of J, which few steps cannot
    tight = other.read(line, h)
    if tight.says == "nothing":
        return f"J tightened by {factor:g} is not to be had along {line.name}"
    moved = norm2((other.gradient - seen.gradient) * seen.subject.natural)
    before, after = reading.quotient, tight.quotient
    by = math.nan if before is None or after is None else abs(after - before)
    changed = other.J_0 != seen.J_0 or not np.array_equal(other.gradient, seen.gradient)
    return Tightened(factor, tight, _relative(moved, seen.size), _relative(by, reading.scale), changed)


def _relative(value: float, scale: float) -> float:
    return value / scale if scale else value


def refine(seen: Examination, reading: Reading) -> Refined | str:
    """How far the gradient is from the exact one on both meshes, each held against quotients along a line.

    In words where that cannot be told.
    """
    assert seen.subject.refine is not None
    try:
        finer = seen.subject.refine()
    except RoutesError as failure:
        return str(failure)
    if finer is None or finer.exact is None or seen.subject.exact is None:
        return "there is no finer mesh for this unknown"
    (line,) = directions(finer, 1, seen.plan.seed)
    assert reading.level is not None
    h = seen.plan.near(reading.level.h, BESIDE)
    if seen.J.left() < 2 * len(h) + 2:
        return f"the mesh was not refined: {seen.J.left():g} calls left, {2 * len(h) + 2} needed"
    try:
        fine = Examination.of(finer, seen.plan, seen.J.sharing(finer.objective), seen.accepted)
        exact, exact_fine = seen.subject.exact(), finer.exact()
    except (Unusable, RoutesError) as failure:
        return f"on the finer mesh: {failure}"
    if not (_meets(exact, reading) and _meets(exact_fine, fine.read(line, h))):
        return "the exact gradient does not meet the quotients either"
    before, after = _off(seen, exact), _off(fine, exact_fine)
    if not before > seen.accepted:
        return "the gradient is the exact one"
    return Refined(before, after, math.log2(before / max(after, np.finfo(np.float64).tiny)))


def _meets(exact: Array, reading: Reading) -> bool:
    """Whether this gradient's slope is the quotient that a line has settled on."""
    if reading.level is None or reading.quotient is None:
        return False
    allowed = max(DIFFERENT * reading.level.uncertainty, EXACT * reading.scale)
    return abs(float(exact @ reading.sweep.line.v) - reading.quotient) <= allowed


def _off(seen: Examination, exact: Array) -> float:
    """|(g - exact) w| / |exact w|."""
    w = seen.subject.natural
    return _relative(norm2((seen.gradient - exact) * w), norm2(exact * w))
