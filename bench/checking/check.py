"""From difference quotients to a verdict: the one flow of questions, each with the numbers it is answered by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.checking import settle
from bench.checking.asked import Unusable
from bench.checking.evidence import evidence
from bench.checking.examine import Examination
from bench.checking.finding import Finding
from bench.checking.guarded import Account, Guarded
from bench.checking.locate import Located, Search, locate
from bench.checking.plan import Plan
from bench.checking.reading import Reading
from bench.checking.result import Check, Refined
from bench.checking.subject import Subject
from bench.checking.words import on_agreement, on_kink, on_noise, on_plateau, on_unusable, remarks, undetermined
from problems.errors import RoutesError

BY_FAR = 1e-2
MANY = 3  # right components for every wrong one
SMALL = 1e-2  # a plateau below may be a loosely solved J: solvers are seldom looser


def check(subject: Subject, plan: Plan, accepted: float = 0.0) -> Check:
    """Is subject's gradient right? Never raises for what the subject does.

    accepted: a relative error up to which the gradient need not be better (1e-7 at least).
    """
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
    """The verdict, by the worst that any line says."""
    by = {says: [r for r in seen.readings if r.says == says] for says in ("kink", "plateau", "agrees", "noise")}
    findings = tuple(evidence(seen))
    so_far = replace(so_far, findings=findings)
    if by["kink"]:
        return on_kink(replace(so_far, deciding=max(by["kink"], key=lambda r: r.kink or 0.0)))
    if by["plateau"]:
        return _on_plateau(so_far, seen, _worst(by["plateau"]), findings)
    if by["agrees"]:
        return on_agreement(replace(so_far, deciding=_clearest(by["agrees"])), by["noise"])
    if by["noise"]:
        return _on_noise(replace(so_far, deciding=_clearest(by["noise"])), seen)
    return undetermined(so_far, "no line has three steps at which J is known", "mend J near p, or its bounds")


def _worst(readings: list[Reading]) -> Reading:
    """The line swept most widely and worst along a random direction, unless a component is worse by far.

    Along random directions an error is one of the whole gradient.
    """
    worst = max(readings, key=lambda r: r.off)
    whole = [r for r in readings if r.sweep.probe.index is None and r.off > BY_FAR * worst.off]
    return max(whole, key=lambda r: (len(r.sweep.h), r.off)) if whole else worst


def _clearest(readings: list[Reading]) -> Reading:
    """The first line of all steps has the fullest curve."""
    return max(readings, key=lambda r: (len(r.sweep.h), -r.known_to))


def _on_noise(so_far: Check, seen: Examination) -> Check:
    """Noise that falls with the forward tolerance is the solver's."""
    assert so_far.deciding is not None
    tightened = tuple(settle.tighten(seen, so_far.deciding)) if seen.subject.tighten is not None else ()
    return on_noise(replace(so_far, tightened=tightened))


def _on_plateau(so_far: Check, seen: Examination, worst: Reading, findings: tuple[Finding, ...]) -> Check:
    """A plateau that falls with the forward tolerance is the solver's, one that shrinks with h the discretization's."""
    tightened = tuple(settle.tighten(seen, worst)) if seen.subject.tighten is not None else ()
    so_far = replace(so_far, deciding=worst, tightened=tightened)
    convicted = next((f for f in findings if f.culprit is not None), None)
    if tightened and settle.fell(worst, tightened[-1].reading):
        return on_plateau(replace(so_far, culprit=None if convicted is None else convicted.culprit), "solver-limited")
    by_mesh = convicted is None or convicted.by_mesh
    refined, why_not = _refined(seen, worst) if by_mesh else (None, ())
    located = _located(seen, seen.readings)
    culprit = None if convicted is None else convicted.culprit
    so_far = replace(so_far, located=located, refined=refined, culprit=culprit, findings=(*findings, *why_not))
    if refined is not None and refined.order >= settle.SHRINKS and not _local(located):
        return on_plateau(so_far, "inconsistent-discretization")
    if convicted is not None:
        return on_plateau(so_far, "wrong-gradient")
    if not tightened and worst.off < SMALL and not _local(located):
        return on_plateau(so_far, "undetermined")
    return on_plateau(so_far, "wrong-gradient")


def _local(located: Located) -> bool:
    """Few components are wrong and many others right: no matter of a mesh, nor of a loosely solved J."""
    return bool(located.worst) and located.right >= MANY * len(located.worst)


def _located(seen: Examination, readings: list[Reading]) -> Located:
    """By halving where a random direction shows the plateau, else among the components looked at."""
    known = [r for r in readings if r.sweep.probe.index is not None]
    shown = [r for r in readings if r.sweep.probe.index is None and r.says == "plateau"]
    search = None
    if shown:
        search = Search(seen.J, seen.J_0, seen.subject, seen.gradient, _worst(shown), seen.plan.seed + 1)
    return locate(search, known, seen.subject)


def _refined(seen: Examination, worst: Reading) -> tuple[Refined | None, tuple[Finding, ...]]:
    """The plateau on a finer mesh, or why it was not looked at there."""
    assert worst.level is not None
    if seen.subject.refine is None:
        return None, ()
    try:
        other = seen.subject.refine()
        refined = None if other is None else settle.refine(seen, other, worst.level.h)
    except RoutesError as failure:
        return None, (Finding("mesh refinement", float("nan"), settle.SHRINKS, str(failure)),)
    if refined is None:
        why = "no finer mesh for this unknown, or too few calls left"
        return None, (Finding("mesh refinement", float("nan"), settle.SHRINKS, why),)
    return refined, ()
