"""The error of a gradient over finer meshes: one of the discretization shrinks, a mistake stays."""

from __future__ import annotations

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.guarded import Unusable
from gradient_routes.bench.verification.lines import directions
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import SHRINKS, Refined
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Array

MESHES = 3  # finer ones: before the asymptotic range an error need not shrink yet
BESIDE = 0.5  # decades on both sides of the best step, where a line is sampled on the finer mesh
EXACT = 1e-6  # relative error of adjoints by solves to 1e-12


def refine(seen: Examination, reading: Reading) -> Refined | str:
    """The distance of the gradient from the exact one, on meshes of half the size each, until it shrinks.

    A string gives the reason where that cannot be measured on one finer mesh.
    """
    found = _off(seen, reading)
    if isinstance(found, str):
        return found
    if not found > seen.accepted:
        return "the gradient is the exact one"
    errors, refined, subject, ended = [found], None, seen.subject, ""
    while len(errors) <= MESHES and not (refined and refined.order >= SHRINKS):
        finer = _finer(subject)
        error = finer if isinstance(finer, str) else _off_on(finer, seen, reading)
        if isinstance(error, str):
            ended = error
            break
        assert not isinstance(finer, str)
        errors.append(error)
        refined, subject = Refined(tuple(errors)), finer
    return refined or ended


def _finer(subject: Subject) -> Subject | str:
    assert subject.refine is not None
    try:
        finer = subject.refine()
    except RoutesError as failure:
        return str(failure)
    return "there is no finer mesh for this unknown" if finer is None or finer.refine is None else finer


def _off_on(finer: Subject, seen: Examination, reading: Reading) -> float | str:
    """The same distance on a finer mesh."""
    assert reading.level is not None
    (line,) = directions(finer, 1, seen.plan.seed)
    h = seen.plan.near(reading.level.h, BESIDE)
    needed = 2 * len(h) + 1
    if seen.J.left() < needed:
        return f"the mesh was not refined: {seen.J.left():g} calls left, {needed} needed"
    try:
        fine = Examination.lightly(finer, seen.plan, seen.J.sharing(finer.objective), seen.accepted)
    except Unusable as failure:
        return f"on the finer mesh: {failure}"
    return _off(fine, fine.read(line, h))


def _off(seen: Examination, reading: Reading) -> float | str:
    """|(g - exact) w| / |exact w|, where the exact gradient meets the quotients of a line."""
    if seen.subject.exact is None:
        return "there is no exact gradient for this unknown"
    try:
        exact = seen.subject.exact()
    except RoutesError as failure:
        return f"the exact gradient: {failure}"
    if not _meets(exact, reading):
        return "the exact gradient does not agree with the quotients either"
    w = seen.subject.natural
    size = norm2(exact * w)
    return norm2((seen.gradient - exact) * w) / (size or 1.0)


def _meets(exact: Array, reading: Reading) -> bool:
    """Whether the slope of this gradient is the level of the quotients."""
    if reading.level is None or reading.quotient is None:
        return False
    allowed = max(DIFFERENT * reading.level.uncertainty, EXACT * reading.scale)
    return abs(float(exact @ reading.quotients.line.v) - reading.quotient) <= allowed
