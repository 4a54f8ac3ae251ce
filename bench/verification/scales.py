"""The natural change of a parameter that starts at 0, found from J itself: the step to which J responds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

RESPONSE = 0.1  # of |J(p)|, or of what J changes by when the other parameters change by a tenth
LEAST, GREATEST = 1e-18, 1e18  # natural changes that are looked for
FASTEST, SLOWEST = 1e3, 10.0**0.5  # growth of the step between two calls
MOST = 6  # parameters looked at one by one: more change together
SHOWN = 3


def with_scales(subject: Subject, J: Guarded, J_0: float) -> Subject:
    """The subject with its unknown scales (NaN) replaced; notes say what was assumed, and why."""
    unknown = np.flatnonzero(np.isnan(subject.scale))
    if not unknown.size or not np.isfinite(J_0):
        return subject
    assumed = np.where(np.isnan(subject.scale), _usual(subject.p), subject.scale)
    response = RESPONSE * max(abs(J_0), _change(subject, J, J_0))
    notes = []
    for group in unknown[:, None] if len(unknown) <= MOST else [unknown]:
        found = _responding(subject, J, J_0, group, response) if response > 0.0 else None
        if found is not None:
            assumed[group] = found
        how = "the step to which J responds" if found is not None else "of the other parameters: J does not respond"
        names = ", ".join(subject.label(int(i)) for i in group[:SHOWN]) + (" ..." if len(group) > SHOWN else "")
        notes.append(f"{names} starts at 0: a natural change of {assumed[group[0]]:.0e} was assumed, {how}")
    return replace(subject, scale=assumed, notes=(*subject.notes, *notes))


def _usual(p: Array) -> float:
    others = np.abs(p[p != 0.0])
    return float(np.median(others)) if others.size else 1.0


def _change(subject: Subject, J: Guarded, J_0: float) -> float:
    """|J(p + 0.1 |p|) - J(p)|: what the parameters whose scale is known do."""
    q = subject.p + RESPONSE * np.where(np.isnan(subject.scale), 0.0, np.abs(subject.p))
    if not subject.inside(q):
        return 0.0
    return float(np.nan_to_num(abs(J(q) - J_0), nan=0.0, posinf=0.0))


def _responding(subject: Subject, J: Guarded, J_0: float, group: Array, response: float) -> float | None:
    """The first step, growing, to which J responds; None where it does to none. The side that is within the bounds."""
    rounding = 1e4 * J.eps * abs(J_0)
    step, last = LEAST, None
    while step <= GREATEST and J.left() > 1:
        q = subject.p.copy()
        q[group] = step
        if not subject.inside(q):
            q[group] = -step
        change = abs(J(q) - J_0) if subject.inside(q) else np.nan
        if not np.isfinite(change):
            return last
        if change >= response * RESPONSE:
            return step
        last = step if change > rounding else None
        growth = response / change if change > rounding else FASTEST
        step *= float(np.clip(growth, SLOWEST, FASTEST))
    return None
