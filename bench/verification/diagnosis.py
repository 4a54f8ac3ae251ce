"""Everything that is measured before a verdict: the deciding line, and on a plateau whose error it is.

An error that falls with the tolerance of the forward solve is the solver's; one that shrinks with the mesh size is the
discretization's; one confined to few components, or to one factor, is the gradient's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification import verdict
from gradient_routes.bench.verification.evidence import evidence
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.guarded import FOREIGN, Unusable
from gradient_routes.bench.verification.lines import directions
from gradient_routes.bench.verification.locate import Search, locate
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check, Refined, Tightened
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Array

FACTORS = (1e-3, 1e-6)  # of the forward tolerance
BESIDE = 0.5  # decades on both sides of the best step, where a line is sampled on the finer mesh
BY_FAR = 1e-2  # part of the largest error from which on a random direction decides rather than a component
EXACT = 1e-6  # relative error of adjoints by solves to 1e-12


def diagnose(seen: Examination) -> Check:
    """The readings, the deciding one, and what explains it; verdict and words are left open."""
    reading = deciding(seen.readings)
    name, readings, findings = seen.subject.name, tuple(seen.readings), tuple(evidence(seen))
    found = Check(name, readings=readings, deciding=reading, findings=findings, noise=readings[0].noise)
    if reading is None or reading.says == "kink" or verdict.agreed(reading):
        return found
    if seen.subject.tighten is not None:
        tightened, ended = tighten(seen, reading)
        found = replace(found, tightened=tightened, not_done=() if ended is None else (ended,))
    if reading.says != "plateau" or verdict.solver_explains(found):
        return found
    if seen.subject.refine is not None and (found.proof is None or found.proof.by_mesh):
        refined = refine(seen, reading)
        if isinstance(refined, Refined):
            found = replace(found, refined=refined)
        else:
            why = Finding("mesh refinement", math.nan, verdict.SHRINKS, refined)
            found = replace(found, findings=(*findings, why))
    shown = [r for r in seen.readings if r.index is None and r.says == "plateau"]
    return replace(found, located=locate(seen, Search(seen, _worst(shown)) if shown else None))


def deciding(readings: Sequence[Reading]) -> Reading | None:
    """The line that the verdict rests on: kinks before plateaus before agreement of the whole before noise."""
    by = {says: [r for r in readings if r.says == says] for says in ("kink", "plateau", "agrees", "noise")}
    if by["kink"]:
        return max(by["kink"], key=lambda r: r.kink or 0.0)
    if by["plateau"]:
        return _worst(by["plateau"])
    undecided = [r for r in by["agrees"] if verdict.agreed(r)] or by["noise"] or by["agrees"]
    return max(undecided, key=lambda r: (len(r.quotients.h), r.known_to), default=None)  # fullest, least certain


def _worst(readings: Sequence[Reading]) -> Reading:
    """The most widely sampled and worst random direction, unless a component is worse by far.

    An error along a random direction is one of the whole gradient.
    """
    worst = max(readings, key=lambda r: r.off)
    whole = [r for r in readings if r.index is None and r.off > BY_FAR * worst.off]
    return max(whole, key=lambda r: (len(r.quotients.h), r.off)) if whole else worst


def tighten(seen: Examination, reading: Reading) -> tuple[tuple[Tightened, ...], str | None]:
    """The line of `reading` with tighter forward solves, until it agrees; and why that stopped early, where it did."""
    found: list[Tightened] = []
    for factor in reversed(FACTORS) if reading.says == "noise" else FACTORS:  # noise takes a sweep of all steps
        again = _tightened(seen, reading, factor)
        if isinstance(again, str):
            return tuple(found), again
        found.append(again)
        if again.reading.says == "agrees":
            break
    return tuple(found), None


def _tightened(seen: Examination, reading: Reading, factor: float) -> Tightened | str:
    """One of them, or the reason why there is none."""
    assert seen.subject.tighten is not None
    plan, line = seen.plan, reading.quotients.line
    near = not plan.everywhere and reading.level is not None and reading.says != "noise"
    h = plan.near(reading.level.h) if near and reading.level is not None else plan.steps
    needed = 2 * len(h) + 2
    if seen.J.left() < needed:
        return f"the forward solve was not tightened by {factor:g}: {seen.J.left():g} calls left, {needed} needed"
    try:
        subject = seen.subject.tighten(factor)
        other = Examination.of(subject, plan, seen.J.sharing(subject.objective), seen.accepted)
    except FOREIGN as failure:
        return f"tighten({factor:g}) failed: {type(failure).__name__}: {failure}"
    if near:
        other.readings.append(reading)  # its estimate of noise, which few steps cannot give
    tight = other.read(line, h)
    if tight.says == "nothing":
        return f"J tightened by {factor:g} cannot be evaluated along {line.name}"
    gradient_moved = norm2((other.gradient - seen.gradient) * seen.subject.natural)
    before, after = reading.quotient, tight.quotient
    quotient_moved = math.nan if before is None or after is None else abs(after - before)
    changed = other.J_0 != seen.J_0 or not np.array_equal(other.gradient, seen.gradient)
    relative = _relative(gradient_moved, seen.size), _relative(quotient_moved, reading.scale)
    return Tightened(factor, tight, *relative, changed)


def refine(seen: Examination, reading: Reading) -> Refined | str:
    """The distance of the gradient from the exact one on both meshes, each exact one checked by quotients on a line.

    A string gives the reason where that cannot be measured.
    """
    assert seen.subject.refine is not None
    assert reading.level is not None
    try:
        finer = seen.subject.refine()
    except RoutesError as failure:
        return str(failure)
    if finer is None or finer.exact is None or seen.subject.exact is None:
        return "there is no finer mesh for this unknown"
    (line,) = directions(finer, 1, seen.plan.seed)
    h = seen.plan.near(reading.level.h, BESIDE)
    if seen.J.left() < 2 * len(h) + 2:
        return f"the mesh was not refined: {seen.J.left():g} calls left, {2 * len(h) + 2} needed"
    try:
        fine = Examination.of(finer, seen.plan, seen.J.sharing(finer.objective), seen.accepted)
        exact, exact_fine = seen.subject.exact(), finer.exact()
    except (Unusable, RoutesError) as failure:
        return f"on the finer mesh: {failure}"
    if not (_meets(exact, reading) and _meets(exact_fine, fine.read(line, h))):
        return "the exact gradient does not agree with the quotients either"
    before, after = _off(seen, exact), _off(fine, exact_fine)
    if not before > seen.accepted:
        return "the gradient is the exact one"
    return Refined(before, after, math.log2(before / max(after, np.finfo(np.float64).tiny)))


def _meets(exact: Array, reading: Reading) -> bool:
    """Whether the slope of this gradient is the level of the quotients."""
    if reading.level is None or reading.quotient is None:
        return False
    allowed = max(DIFFERENT * reading.level.uncertainty, EXACT * reading.scale)
    return abs(float(exact @ reading.quotients.line.v) - reading.quotient) <= allowed


def _off(seen: Examination, exact: Array) -> float:
    """|(g - exact) w| / |exact w|."""
    w = seen.subject.natural
    return _relative(norm2((seen.gradient - exact) * w), norm2(exact * w))


def _relative(value: float, scale: float) -> float:
    return value / scale if scale else value
