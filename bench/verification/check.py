"""Is a gradient right? Plan, lines, readings, diagnosis, verdict, messages: the one flow."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification import messages
from gradient_routes.bench.verification.diagnosis import diagnose
from gradient_routes.bench.verification.examine import Examination, NoValue
from gradient_routes.bench.verification.guarded import Account, Guarded, Unusable
from gradient_routes.bench.verification.lines import directions
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.result import Check
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.bench.verification.verdict import verdict
from gradient_routes.problems.errors import InputError

NAME = "at a second point"
SECOND = 11  # objective calls that are kept for it, of a budget that is not smaller than
ENOUGH = 4  # times that
STATIONARY = "J is stationary at p, where a gradient of zero passes: judged at a point 5 % away"
SAME = "the gradient is that at p: it does not change with p"
DIFFERS = "at p the gradient agrees with differences; at a point 5 % away it does not"


def check(subject: Subject, plan: Plan, accept: float = 0.0) -> Check:
    """Is subject's gradient right? Never raises for what the subject does; what it prints goes to stderr.

    accept: a relative error, >= 0 and < 1, up to which the gradient counts as right (1e-7 at least). Raises InputError.
    """
    J = Guarded(subject.objective, Account(plan.budget))
    with redirect_stdout(sys.stderr), np.errstate(all="ignore"):
        found = _checked(subject, plan, J, accepted(accept))
    if found.located is not None:
        found = replace(found, located=found.located.at(subject.places))
    return replace(found, calls=J.account.calls, gradients=J.account.gradients)


def accepted(error: float) -> float:
    """A relative error that is good enough. Raises InputError."""
    if not 0.0 <= error < 1.0:
        raise InputError(f"check: accept={error:g} - give a relative error >= 0 and < 1")
    return error


def _checked(subject: Subject, plan: Plan, J: Guarded, accepted: float) -> Check:
    try:
        seen = Examination.of(subject, plan, J, accepted)
    except Unusable as failure:
        return messages.on_unusable(subject.name, failure)
    except NoValue:
        return messages.on_no_value(subject.name, J)
    if plan.budget >= ENOUGH * SECOND:
        J.account.kept = SECOND
    seen.run()
    J.account.kept = 0
    found = judged(seen)
    if found.verdict == "agrees":
        found = _at_a_second_point(seen, found)
    return replace(found, remarks=messages.remarks(found, seen))


def judged(seen: Examination) -> Check:
    """Diagnosis, verdict and words, from the readings there are."""
    found = diagnose(seen)
    return messages.explained(replace(found, verdict=verdict(found)), seen)


def _at_a_second_point(seen: Examination, found: Check) -> Check:
    """A gradient that agrees at p: what a second point says, where p cannot tell or where they disagree."""
    if seen.elsewhere is None:
        return _without_a_second_point(seen, found, "J has no value at one")
    moved = seen.subject.moved(seen.elsewhere)
    (line,) = directions(moved, 1, seen.plan.seed + 5)
    line = replace(line, name=NAME)
    best = found.deciding.level if found.deciding is not None else None
    h = seen.plan.near(best.h) if best is not None else seen.plan.steps
    if seen.J.left() < 1 + 2 * len(h):
        return _without_a_second_point(seen, found, "the budget is spent")
    try:
        other = Examination.lightly(moved, seen.plan, seen.J, seen.accepted)
    except Unusable as failure:
        return _without_a_second_point(seen, found, f"there {failure}")
    other.elsewhere = seen.subject.p
    other.like = seen.readings[0]
    reading = other.read(line, h)
    if reading.says == "plateau" and not seen.stationary and np.array_equal(other.gradient, seen.gradient):
        there = replace(found, verdict="wrong-gradient", deciding=reading, elsewhere=reading, compared=SAME)
        return replace(messages.explained(there, seen), moved=DIFFERS)
    if seen.stationary or reading.says == "plateau":
        other.like = None if seen.stationary else other.like
        other.run()
        there = judged(other)
        if there.verdict != "agrees" or seen.stationary:
            why = STATIONARY if seen.stationary else DIFFERS
            return replace(there, moved=why)
        reading = other.readings[0]
    return replace(found, elsewhere=reading)


def _without_a_second_point(seen: Examination, found: Check, why: str) -> Check:
    """A note; where J is stationary at p nothing is known, for a gradient of zero passes there."""
    found = replace(found, not_done=(*found.not_done, f"no second point: {why}"))
    if not seen.stationary:
        return found
    says = "J is stationary at p, where a gradient of zero passes, and no other point was judged"
    return replace(found, verdict="undetermined", says=says, todo="give another start, or a larger budget")
