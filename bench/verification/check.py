"""Is a gradient right? Plan, lines, readings, diagnosis, verdict, messages: the one flow."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification import messages
from gradient_routes.bench.verification.diagnosis import diagnose
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.guarded import Account, Guarded, Unusable
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.result import Check
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.bench.verification.verdict import verdict
from gradient_routes.problems.errors import InputError


def check(subject: Subject, plan: Plan, accept: float = 0.0) -> Check:
    """Is subject's gradient right? Never raises for what the subject does; what it prints goes to stderr.

    accept: a relative error, >= 0 and < 1, up to which the gradient counts as right (1e-7 at least). Raises InputError.
    """
    J = Guarded(subject.objective, Account(plan.budget))
    with redirect_stdout(sys.stderr), np.errstate(all="ignore"):
        found = _checked(subject, plan, J, accepted(accept))
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
    if not np.isfinite(seen.J_0):
        return messages.on_no_value(subject.name, J)
    seen.run()
    found = diagnose(seen)
    found = messages.explained(replace(found, verdict=verdict(found)), seen)
    return replace(found, remarks=messages.remarks(found, seen))
