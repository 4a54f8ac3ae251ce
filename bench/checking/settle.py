"""On a plateau: does it move when the forward solve is tightened, does it shrink with the mesh?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.checking.asked import Unusable
from bench.checking.examine import Examination
from bench.checking.guarded import Guarded
from bench.checking.plan import Plan
from bench.checking.plateau import level
from bench.checking.probe import Probe, sweep
from bench.checking.reading import RESOLVED, Reading
from bench.checking.result import Refined, Tightened
from bench.checking.subject import Subject
from problems.errors import RoutesError
from problems.problem import Array

FACTORS = (1e-3, 1e-6)  # of the forward tolerance
FALLEN = 1.0 / 3.0
FIELDS = 2  # smooth directions compared between meshes
BESIDE = 0.5  # decades on both sides of the best step, where they are
WAVES = 0.75  # periods of a smooth direction across the body, at most
SHRINKS = 0.6  # order in h from which on a plateau is one of the discretization


def fell(before: Reading, after: Reading) -> bool:
    """Whether what stood in the way is gone, or on its way."""
    if after.says == "agrees":
        return True
    return before.says == after.says == "plateau" and after.off < FALLEN * before.off


def tighten(seen: Examination, reading: Reading) -> Iterator[Tightened]:
    """The line of `reading` once more with a tighter forward solve, and a tighter one until what stood there falls."""
    for factor in FACTORS:
        again = _again(seen, reading, factor)
        if again is None or again.reading.says == "nothing":  # a solver that cannot be tightened says nothing
            return
        yield again
        if fell(reading, again.reading):
            return


def _again(seen: Examination, reading: Reading, factor: float) -> Tightened | None:
    """None where the tightened subject cannot be had, or its calls are not left."""
    plan, line = seen.plan, reading.sweep.probe
    h = plan.steps if plan.everywhere or reading.level is None else plan.near(reading.level.h)
    if seen.subject.tighten is None or seen.J.left() < 2 * len(h) + 2:
        return None
    try:
        subject = seen.subject.tighten(factor)
        other = Examination.of(subject, plan, seen.J.sharing(subject.objective), seen.accepted)
        if not plan.everywhere:
            other.readings.append(reading)  # tells the noise of J, which few steps cannot
        tight = other.read(line, h)
    except (Unusable, RoutesError):
        return None
    moved = np.linalg.norm((other.gradient - seen.gradient) * seen.subject.natural)
    quotients = reading.quotient, tight.quotient
    by = abs(quotients[0] - quotients[1]) if None not in quotients else float("nan")  # type: ignore[operator]
    return Tightened(factor, tight, _relative(float(moved), seen.size), _relative(by, reading.scale))


def _relative(value: float, scale: float) -> float:
    return value / scale if scale else value


def refine(seen: Examination, other: Subject, h: float) -> Refined | None:
    """Plateaus along smooth fields of the parameters on both meshes, with steps about h.

    None where the two cannot be compared, or the budget does not suffice.
    """
    steps = seen.plan.near(h, BESIDE)
    if seen.J.left() < 4 * (FIELDS * len(steps) + 1):
        return None
    before = _plateau(seen.subject, seen.plan, seen.J, steps)
    after = _plateau(other, seen.plan, seen.J, steps)
    if before is None or after is None:
        return None
    order = float(np.log2(before / after)) if after > 0.0 < before else float("inf")
    return Refined(before, after, order)


def _plateau(subject: Subject, plan: Plan, J: Guarded, h: Array) -> float | None:
    """Root mean square of |quotient - slope| / sum |g_i v_i| along smooth fields v."""
    guarded, fields = J.sharing(subject.objective), smooth_fields(subject, plan.seed)
    try:
        seen = Examination.of(subject, plan, guarded)
    except Unusable:
        return None
    found = []
    for k, v in enumerate(fields):
        made = sweep(guarded, seen.J_0, subject, seen.gradient, Probe(f"smooth field {k + 1}", v), h)
        whole = float(np.abs(seen.gradient * v).sum())
        at = level(made.h, made.off_central, 0.0, RESOLVED * whole)
        if at is None or whole == 0.0:
            return None
        found.append(at.value / whole)
    return float(np.sqrt(np.mean(np.square(found)))) if found else None


def smooth_fields(subject: Subject, seed: int) -> list[Array]:
    """Natural changes that vary slowly in space, the same on every mesh: w_i cos(2 pi k . x_i + phi)."""
    x = subject.position
    if x is None:
        return []
    rng = np.random.default_rng(seed)
    low, extent = x.min(axis=0), np.ptp(x, axis=0)
    x = (x - low) / np.where(extent > 0, extent, 1.0)
    waves = rng.uniform(-WAVES, WAVES, (FIELDS, x.shape[1]))
    phases = rng.uniform(0.0, 2.0 * np.pi, FIELDS)
    return [subject.natural * np.cos(2.0 * np.pi * x @ k + phi) for k, phi in zip(waves, phases, strict=True)]
