"""Verdicts in words: one sentence with the numbers, and the next thing to do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification.curve import Curve
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.gradient_call import Unusable
from gradient_routes.bench.verification.guarded import Accident
from gradient_routes.bench.verification.locate import Located, Worst
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check, Verdict

SHOWN = 3  # accidents and components named in a sentence
NEXT_TO_ONE = 0.01
ODD = 0.25  # off the slopes 1 and 2
TIGHTEN = "offer tighten(factor), which returns the same thing with its solver tightened"


def on_unusable(check: Check, failure: Unusable) -> Check:
    verdict: Verdict = "wrong-gradient" if failure.wrong else "undetermined"
    todo = "mend what the gradient returns" if failure.wrong else "mend the gradient, which gives nothing at p"
    return replace(check, verdict=verdict, says=str(failure), todo=todo)


def undetermined(check: Check, why: str, todo: str) -> Check:
    return replace(check, verdict="undetermined", says=why, todo=todo)


def on_agreement(check: Check, noisy: Sequence[Reading]) -> Check:
    reading = check.deciding
    assert reading is not None
    agreeing = [r for r in check.readings if r.says == "agrees" and (r.sweep.line.index is None or r is reading)]
    to = max(max(r.off, r.known_to) for r in agreeing)
    says = (
        f"differences agree with the gradient to {to:.1e} along {_lines(check)};"
        f" best step {number(_curve(reading).best_step, 2)}, floor {number(_curve(reading).floor, 2)}"
    )
    if noisy:
        names = ", ".join(r.sweep.line.name for r in noisy[:SHOWN])
        says += f"; too small for the noise of J to tell: {names}"
    unsound = [f for f in check.findings if f.sound is False and not f.name.startswith("Taylor")]
    todo = "use it"
    if unsound:
        says += f"; yet {unsound[0].name}: {unsound[0].value:.1e}"
        todo = f"look at {unsound[0].culprit or unsound[0].name}"
        if any(f.name.startswith("complex step") for f in unsound):
            todo = "differences side with the gradient: do J and R take complex numbers (abs, norm, conj do not)?"
    return replace(check, verdict="agrees", says=says, todo=todo)


def on_kink(check: Check, plateaus: Sequence[Reading]) -> Check:
    reading = check.deciding
    assert reading is not None
    where = f"along {reading.sweep.line.name}"
    h = "" if reading.level is None else f" at h = {reading.level.h_min:.1e}"
    inside = "" if not reading.inside else f"{reading.inside} active-set changes inside the stencil{h}"
    if reading.kink is None:
        says = f"{inside} {where}: J has a kink there, and quotients mix its two slopes"
    else:
        says = f"one-sided quotients {where} converge to numbers {reading.kink:.2g} apart, relative to them"
        says += f"; {inside}" if inside else ""
    todo = "move p off the kink, or difference to one side of it only: the gradient lies between the slopes of the two"
    if plateaus:
        worst = max(plateaus, key=lambda r: r.off)
        todo += f"; along {worst.sweep.line.name}, which is smooth, it is off by {worst.off:.2g} {_relative_to(worst)}"
    return replace(check, verdict="non-smooth", says=says, todo=todo)


def on_noise(check: Check) -> Check:
    reading = check.deciding
    assert reading is not None
    noise = f"J scatters by {reading.noise:.1e}"
    if check.tightened and check.tightened[-1].reading.says == "agrees":
        last = check.tightened[-1]
        says = (
            f"{noise} until its forward solve is tightened by {last.factor:g}: then differences agree to"
            f" {last.reading.known_to:.1e}"
        )
        return replace(check, verdict="solver-limited", says=says, todo=_tighten_for_good(check))
    says = f"{noise}: the best step leaves a relative uncertainty of {reading.known_to:.1e}, and nothing can be told"
    todo = "tighten the forward solve"
    todo += ", or check by other means" if check.tightened or check.not_done else f": {TIGHTEN}"
    return replace(check, verdict="noise-limited", says=says, todo=todo)


def on_plateau(check: Check, verdict: Verdict) -> Check:
    reading, located, culprit = check.deciding, check.located, check.culprit
    assert reading is not None
    says = f"a plateau of {reading.off:.2g} {_relative_to(reading)} along {reading.sweep.line.name}, whatever the step"
    if verdict == "solver-limited":
        last = check.tightened[-1]
        says += f", falls to {last.reading.off:.1e} when the forward solve is tightened by {last.factor:g}"
        return replace(check, verdict=verdict, says=f"{says}: {_who_moved(check)}", todo=_tighten_for_good(check))
    if check.tightened:
        says += f", does not fall when the forward solve is tightened by {check.tightened[-1].factor:g}"
    if check.refined is not None:
        before, after, order = check.refined.before, check.refined.after, check.refined.order
        says += f"; the whole gradient is off by {before:.2g}, and by {after:.2g} on a mesh of half the size"
        if verdict == "inconsistent-discretization":
            says += f": it shrinks like h^{order:.1f}"
            todo = "differentiate what is computed: discretize first, then optimize"
            return replace(check, verdict=verdict, says=says, todo=todo, culprit="an adjoint discretized on its own")
        says += f": h^{order:.1f}, no matter of the mesh"
    if located is not None and located.worst:
        says += f"; {_components(located)}"
        culprit = culprit or _component_culprit(located)
    if verdict == "undetermined":
        if check.not_done:
            says += "; whether a tighter solve moves it was not seen"
            return replace(check, verdict=verdict, says=says, todo=f"mend this: {check.not_done[0]}", culprit=culprit)
        if check.tightened and check.tightened[-1].moved:
            says = says.replace("does not fall", "moves a little")
            return replace(check, verdict=verdict, says=says, todo="tighten the solver farther", culprit=culprit)
        says += "; so small a plateau may be a loosely solved J as well as a small wrong term"
        return replace(check, verdict=verdict, says=says, todo=TIGHTEN, culprit=culprit)
    todo = f"look at {culprit}" if culprit else "look for a missing or wrong term in every component"
    if located is not None and located.everywhere and not check.culprit and not check.findings_of_factors:
        todo += "; written as a Problem (CONTRIBUTING.md), its factors are tested one by one"
    if not check.tightened and not check.not_done and not (located is not None and located.right):
        todo += f"; to rule out the solver, {TIGHTEN}"
    return replace(check, verdict=verdict, says=says, todo=todo, culprit=culprit)


def remarks(check: Check, seen: Examination) -> tuple[str, ...]:
    """What was odd about the subject, and what more calls would settle."""
    J, said = seen.J, list(seen.asked.remarks)
    if J.mutates:
        said.append("the objective changes p in place: it was given copies")
    if seen.remembers:
        said.append(
            f"J(p) has changed by {seen.remembers:.1e} after calls at other points: does it start from the last?"
        )
    elif len(seen.repeated) > 2:
        said.append(f"J is not deterministic: {len(seen.repeated)} calls at p scatter by {np.std(seen.repeated):.1e}")
    if J.eps > np.finfo(np.float64).eps:
        said.append(f"J has the precision of float32: its noise is at least {J.eps * abs(seen.J_0):.1e}")
    bound = np.flatnonzero((seen.subject.p <= seen.subject.lower) | (seen.subject.p >= seen.subject.upper))
    if bound.size:
        names = ", ".join(seen.subject.label(int(i)) for i in bound[:SHOWN])
        said.append(f"on their bounds, differenced to one side: {names}" + (" ..." if bound.size > SHOWN else ""))
    if J.accidents:
        said.append(_accidents(J.accidents, seen))
    flat = [r for r in check.readings if r.looked_at and np.isfinite(r.sweep.forward).any()]
    if flat and all(not np.nan_to_num(r.sweep.forward).any() for r in flat):
        said.append("J has not changed at all: does it depend on p?")
    scaled = [
        r.sweep.line.name for r in check.readings if r.sweep.line.index is not None and r.level and not r.own_scale
    ]
    if scaled and check.verdict == "agrees" and len(seen.subject.p) > 1:
        said.append(f"relative to the whole gradient, being too small to stand alone: {', '.join(scaled[:SHOWN])}")
    if check.verdict == "agrees" and check.deciding is not None:
        said += _odd_slopes(check.deciding)
    unread = sum(r.says == "nothing" for r in check.readings)
    if J.left() < 2 and math.isfinite(seen.plan.budget):
        what = f"; {unread} lines were not looked at" if unread else ""
        said.append(
            f"the budget of {seen.plan.budget:g} calls is spent{what}: --budget {2 * seen.plan.budget:g} sees more"
        )
    return tuple(said)


def _odd_slopes(reading: Reading) -> list[str]:
    """Truncation slopes that are not 1 and 2."""
    expected = ((reading.one_sided.slope, 1), (reading.central.slope, 2))
    odd = [f"{slope:.2g} instead of {wanted}" for slope, wanted in expected if slope and abs(slope - wanted) > ODD]
    if not odd:
        return []
    why = "J is less smooth than twice differentiable, or its higher derivatives rule"
    return [f"truncation slopes along {reading.sweep.line.name}: {', '.join(odd)}: {why}"]


def _accidents(accidents: Sequence[Accident], seen: Examination) -> str:
    first = accidents[0]
    change = (first.p - seen.subject.p) / seen.subject.natural
    i = int(np.abs(change).argmax())
    where = f"{seen.subject.label(i)} = {first.p[i]:.6g}" if change[i] else "p itself"
    others = np.count_nonzero(change) - 1
    more = f" and {others} others moved along" if others > 0 else ""
    return f"{len(accidents)} points left out, the first at {where}{more}: {first.what}"


def _lines(check: Check) -> str:
    count = sum(r.says == "agrees" for r in check.readings)
    directions = sum(r.says == "agrees" and r.sweep.line.index is None for r in check.readings)
    parts = [(directions, "random direction"), (count - directions, "component")]
    return " and ".join(f"{n} {what}{'s' if n > 1 else ''}" for n, what in parts if n)


def _curve(reading: Reading) -> Curve:
    return reading.central if reading.sweep.two_sided else reading.one_sided


def _relative_to(reading: Reading) -> str:
    return "of the component" if reading.own_scale else "of the gradient"


def _who_moved(check: Check) -> str:
    """Tightening tells which side was the loose one."""
    last = check.tightened[-1]
    if last.reading.says != "agrees":
        return "it is still falling"
    if last.gradient_moved < 0.1 * last.quotient_moved:
        return f"J moved, the gradient did not ({last.gradient_moved:.0e}): the gradient is sound, J is loosely solved"
    if last.quotient_moved < 0.1 * last.gradient_moved:
        return f"the gradient moved by {last.gradient_moved:.1e}, J did not: the gradient's state is loosely solved"
    return f"both moved, J's slope by {last.quotient_moved:.1e}, the gradient by {last.gradient_moved:.1e}"


def _tighten_for_good(check: Check) -> str:
    todo = f"divide the solver's tolerance by {1.0 / check.tightened[-1].factor:g}"
    return f"{todo}; look at {check.culprit}" if check.culprit else todo


def _components(located: Located) -> str:
    w = located.worst[0]
    named = ", ".join(x.name for x in located.worst[:SHOWN])
    if located.everywhere and located.factor is not None:
        return f"all components looked at ({named}) are off by {_factor(located.factor)}, as is the whole"
    if located.everywhere:
        return f"many components are wrong, {named} among them: {_pair(w)}"
    if located.right:
        return f"{named}: {_pair(w)}, the other {located.right} are right"
    return f"at least {named} {'is' if len(located.worst) == 1 else 'are'} wrong: {_pair(w)}"


def _pair(w: Worst) -> str:
    factor = "" if w.factor is None else f", {_factor(w.factor)}"
    return f"the gradient says {w.given:.6g} where differences say {w.found:.6g}{factor}"


def _factor(factor: float) -> str:
    """A factor next to 1 is told by its distance, -1 by its name."""
    if abs(factor + 1.0) < NEXT_TO_ONE**2:
        return "its sign"
    return f"the factor {factor:.3g}" if abs(factor - 1.0) >= NEXT_TO_ONE else f"{abs(factor - 1.0):.1e} of it"


def _component_culprit(located: Located) -> str:
    w = located.worst[0]
    if located.everywhere and located.factor is not None:
        return f"the whole gradient, off by {_factor(located.factor)}"
    if located.everywhere:
        return "many components"
    factor = "" if w.factor is None else f", off by {_factor(w.factor)}"
    at_least = "" if located.right or len(located.worst) == 1 else "at least "
    more = f" and {at_least}{len(located.worst) - 1} more" if len(located.worst) > 1 else ""
    return f"component {w.name}{factor}{more}"


def number(value: float | None, digits: int) -> str:
    return "unknown" if value is None else f"{value:.{digits}g}"
