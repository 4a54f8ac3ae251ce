"""From difference quotients to a verdict: the one flow of questions, each with the numbers it is answered by."""

from __future__ import annotations

import math
import sys
from contextlib import redirect_stdout
from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification import diagnose as settle
from gradient_routes.bench.verification.evidence import evidence
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.gradient_call import Unusable
from gradient_routes.bench.verification.guarded import Account, Guarded
from gradient_routes.bench.verification.locate import Located, Search, locate
from gradient_routes.bench.verification.messages import (
    on_agreement,
    on_kink,
    on_noise,
    on_plateau,
    on_unusable,
    remarks,
    undetermined,
)
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check, Refined
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import InputError

BY_FAR = 1e-2
MANY = 3  # right components for every wrong one
SMALL = 1e-2  # a plateau below may be a loosely solved J: solvers are seldom looser
CLEARLY = 0.1  # error of a component, relative to itself, that no solver is loose enough for


def check(subject: Subject, plan: Plan, accept: float = 0.0) -> Check:
    """Is subject's gradient right? Never raises for what the subject does; what it prints goes to stderr.

    accept: a relative error, >= 0 and < 1, up to which the gradient need not be better (1e-7 at least). Raises
    InputError.
    """
    with redirect_stdout(sys.stderr), np.errstate(all="ignore"):
        return _checked(subject, plan, accepted(accept))


def accepted(error: float) -> float:
    """A relative error that is good enough. Raises InputError."""
    if not 0.0 <= error < 1.0:
        raise InputError(f"check: accept={error:g} - give a relative error >= 0 and < 1")
    return error


def _checked(subject: Subject, plan: Plan, accepted: float) -> Check:
    J = Guarded(subject.objective, Account(plan.budget))
    blank = Check(subject.name, "undetermined", "", "")
    try:
        seen = Examination.of(subject, plan, J, accepted)
    except Unusable as failure:
        return _counted(on_unusable(blank, failure), J)
    if not np.isfinite(seen.J_0):
        what = J.accidents[0].what if J.accidents else "J is not finite"
        return _counted(undetermined(blank, f"J cannot be had at p itself: {what}", "start where J is defined"), J)
    seen.look(seen.lines())
    found = _judged(replace(blank, readings=tuple(seen.readings), noise=seen.readings[0].noise), seen)
    return _counted(replace(found, remarks=remarks(found, seen)), J)


def _counted(found: Check, J: Guarded) -> Check:
    return replace(found, calls=J.account.calls, gradients=J.account.gradients)


def _judged(so_far: Check, seen: Examination) -> Check:
    """The verdict, by the worst that any line says; nothing agrees where no random direction does."""
    by = {says: [r for r in seen.readings if r.says == says] for says in ("kink", "plateau", "agrees", "noise")}
    so_far = replace(so_far, findings=tuple(evidence(seen)))
    if by["kink"]:
        return on_kink(replace(so_far, deciding=max(by["kink"], key=lambda r: r.kink or 0.0)), by["plateau"])
    if by["plateau"]:
        return _on_plateau(so_far, seen, _worst(by["plateau"]))
    whole = [r for r in by["agrees"] if r.sweep.line.index is None or len(seen.subject.p) == 1]
    if whole:
        return on_agreement(replace(so_far, deciding=_widest(whole)), by["noise"])
    if by["noise"] or by["agrees"]:
        return _on_noise(replace(so_far, deciding=_widest(by["noise"] or by["agrees"])), seen)
    return undetermined(so_far, "no line has three steps at which J is known", "mend J near p, or its bounds")


def _worst(readings: list[Reading]) -> Reading:
    """The line swept most widely and worst along a random direction, unless a component is worse by far.

    Along random directions an error is one of the whole gradient.
    """
    worst = max(readings, key=lambda r: r.off)
    whole = [r for r in readings if r.sweep.line.index is None and r.off > BY_FAR * worst.off]
    return max(whole, key=lambda r: (len(r.sweep.h), r.off)) if whole else worst


def _widest(readings: list[Reading]) -> Reading:
    """Of the lines swept most widely, whose curves are fullest, the one that knows least."""
    return max(readings, key=lambda r: (len(r.sweep.h), r.known_to))


def _on_noise(so_far: Check, seen: Examination) -> Check:
    """Noise that falls with the forward tolerance is the solver's."""
    assert so_far.deciding is not None
    if seen.subject.tighten is None:
        return on_noise(so_far)
    tightened, ended = settle.tighten(seen, so_far.deciding)
    return on_noise(replace(so_far, tightened=tightened, not_done=() if ended is None else (ended,)))


def _on_plateau(so_far: Check, seen: Examination, worst: Reading) -> Check:
    """A plateau that falls with the forward tolerance is the solver's, one that shrinks with h the discretization's."""
    so_far = replace(so_far, deciding=worst)
    ended = None
    if seen.subject.tighten is not None:
        tightened, ended = settle.tighten(seen, worst)
        so_far = replace(so_far, tightened=tightened, not_done=() if ended is None else (ended,))
    convicted = next((f for f in so_far.findings if f.culprit is not None), None)
    culprit = None if convicted is None else convicted.culprit
    if settle.falls(worst, so_far.tightened):
        return on_plateau(replace(so_far, culprit=culprit), "solver-limited")
    refined = None
    if convicted is None or convicted.by_mesh:
        refined, so_far = _refined(so_far, seen, worst)
    located = _located(seen, seen.readings)
    so_far = replace(so_far, located=located, refined=refined, culprit=culprit)
    if refined is not None and refined.order >= settle.SHRINKS and not _local(located):
        return on_plateau(so_far, "inconsistent-discretization")
    if convicted is not None or _local(located):
        return on_plateau(so_far, "wrong-gradient")
    tested = so_far.tightened and (so_far.findings_of_factors or any(t.moved for t in so_far.tightened))
    if tested and settle.moves(worst, so_far.tightened):
        return on_plateau(so_far, "undetermined")
    if not tested and (ended is not None or not _gross(seen.readings, located)):
        return on_plateau(so_far, "undetermined")
    return on_plateau(so_far, "wrong-gradient")


def _gross(readings: list[Reading], located: Located) -> bool:
    """Whether a gradient is off by more than a solver is ever loose."""
    whole = [r.off for r in readings if r.says == "plateau" and r.sweep.line.index is None]
    factor = 1.0 if located.factor is None else located.factor
    components = max((w.off for w in located.worst), default=0.0)
    return max(whole, default=0.0) >= SMALL or abs(factor - 1.0) >= SMALL or components >= CLEARLY


def _local(located: Located) -> bool:
    """Few components are wrong and many others right: no matter of a mesh, nor of a loosely solved J."""
    return bool(located.worst) and located.right >= MANY * len(located.worst)


def _located(seen: Examination, readings: list[Reading]) -> Located:
    """By halving where a random direction shows the plateau, else among the components looked at."""
    known = [r for r in readings if r.sweep.line.index is not None]
    shown = [r for r in readings if r.sweep.line.index is None and r.says == "plateau"]
    search = None
    if shown:
        search = Search(seen.J, seen.J_0, seen.subject, seen.gradient, _worst(shown), seen.plan.seed + 1)
    return locate(search, known, seen.subject)


def _refined(so_far: Check, seen: Examination, worst: Reading) -> tuple[Refined | None, Check]:
    """What a finer mesh says; why it says nothing, where it does not, is another finding."""
    if seen.subject.refine is None:
        return None, so_far
    refined = settle.refine(seen, worst)
    if isinstance(refined, str):
        why = Finding("mesh refinement", math.nan, settle.SHRINKS, refined)
        return None, replace(so_far, findings=(*so_far.findings, why))
    return refined, so_far
