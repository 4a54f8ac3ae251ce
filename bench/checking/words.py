"""Verdicts in words: one sentence with the numbers, and the next thing to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.checking.asked import Unusable
from bench.checking.examine import Examination
from bench.checking.guarded import Accident
from bench.checking.locate import Located, Worst
from bench.checking.reading import Reading
from bench.checking.result import Check, Verdict

SHOWN = 3  # accidents and components named in a sentence
NEXT_TO_ONE = 0.01
TIGHTEN = "offer tighten(factor), which returns the same thing with its solver tightened"


def on_unusable(check: Check, failure: Unusable) -> Check:
    verdict: Verdict = "wrong-gradient" if failure.wrong else "undetermined"
    return replace(check, verdict=verdict, says=str(failure), todo="mend what the gradient returns")


def undetermined(check: Check, why: str, todo: str) -> Check:
    return replace(check, verdict="undetermined", says=why, todo=todo)


def on_agreement(check: Check, noisy: Sequence[Reading]) -> Check:
    line = check.deciding
    assert line is not None
    says = (
        f"differences agree with the gradient to {max(line.off, line.known_to):.1e} along {_lines(check)};"
        f" best step {_best(line)}, floor {_floor(line)}"
    )
    unsound = [f.name for f in check.findings if f.sound is False and not f.name.startswith("Taylor")]
    if noisy:
        names = ", ".join(r.sweep.probe.name for r in noisy[:SHOWN])
        says += f"; too small for the noise of J to tell: {names}"
    todo = "nothing: use it"
    if unsound:
        todo = f"look at {unsound[0]}, which differences do not resolve"
    return replace(check, verdict="agrees", says=says, todo=todo)


def on_kink(check: Check) -> Check:
    line = check.deciding
    assert line is not None
    where = f"along {line.sweep.probe.name}"
    inside = "" if line.inside is None else f"{line.inside} active-set changes inside the stencil at h = {_h(line)}"
    if line.kink is None:
        says = f"{inside} {where}: J has a kink there, and quotients mix its two slopes"
    else:
        says = f"one-sided quotients {where} converge to numbers {line.kink:.2g} apart, relative"
        says += f"; {inside}" if inside else ""
    todo = "move p off the kink, or difference to one side of it only: the gradient is one of the two slopes"
    return replace(check, verdict="non-smooth", says=says, todo=todo)


def on_noise(check: Check) -> Check:
    line = check.deciding
    assert line is not None
    noise = f"J scatters by {line.noise:.1e}"
    if check.tightened and check.tightened[-1].reading.says == "agrees":
        last = check.tightened[-1]
        says = (
            f"{noise} until its forward solve is tightened by {last.factor:g}: then differences agree to"
            f" {last.reading.known_to:.1e}"
        )
        return replace(check, verdict="solver-limited", says=says, todo=_tighten_for_good(check))
    says = f"{noise}: the best step leaves a relative uncertainty of {line.known_to:.1e}, and nothing can be told"
    todo = "tighten the forward solve" + (f": {TIGHTEN}" if not check.tightened else ", or check by other means")
    return replace(check, verdict="noise-limited", says=says, todo=todo)


def on_plateau(check: Check, verdict: Verdict) -> Check:
    line, located = check.deciding, check.located
    assert line is not None
    says = f"a plateau of {line.off:.2g} {_relative_to(line)} along {line.sweep.probe.name}, whatever the step"
    culprit = check.culprit
    if verdict == "solver-limited":
        last = check.tightened[-1]
        says += f", falls to {last.reading.off:.1e} when the forward solve is tightened by {last.factor:g}"
        says += f": {_who_moved(check)}"
        return replace(check, verdict=verdict, says=says, todo=_tighten_for_good(check))
    if verdict == "inconsistent-discretization":
        assert check.refined is not None
        says += f"; along smooth fields {check.refined.before:.2g}, and {check.refined.after:.2g} on a mesh of half the"
        says += f" size: it shrinks like h^{check.refined.order:.1f}"
        todo = "differentiate what is computed: discretize first, then optimize"
        return replace(check, verdict=verdict, says=says, todo=todo, culprit="an adjoint discretized on its own")
    if check.tightened:
        says += f", does not fall when the forward solve is tightened by {check.tightened[-1].factor:g}"
    if check.refined is not None:
        says += f", nor with the mesh (h^{check.refined.order:.1f})"
    if located is not None and located.worst:
        says += f"; {_components(located)}"
        culprit = culprit or _component_culprit(located)
    if verdict == "undetermined":
        says += "; so small a plateau may be a loosely solved J as well as a small wrong term"
        return replace(check, verdict=verdict, says=says, todo=TIGHTEN, culprit=culprit)
    todo = f"look at {culprit}" if culprit else "look for a missing or wrong term in every component"
    if not check.tightened and not (located is not None and located.right):
        todo += f"; to rule out the solver, {TIGHTEN}"
    return replace(check, verdict=verdict, says=says, todo=todo, culprit=culprit)


def remarks(check: Check, seen: Examination) -> tuple[str, ...]:
    """What was odd about the subject, and what more calls would settle."""
    J, said = seen.J, list(seen.asked.remarks)
    if J.mutates:
        said.append("the objective changes p in place: it was given copies")
    if len(seen.repeated) > 2:
        said.append(f"J is not deterministic: {len(seen.repeated)} calls at p scatter by {np.std(seen.repeated):.1e}")
    if J.eps > np.finfo(np.float64).eps:
        said.append(f"J has the precision of float32: its noise is at least {J.eps * abs(seen.J_0):.1e}")
    bound = np.flatnonzero((seen.subject.p <= seen.subject.lower) | (seen.subject.p >= seen.subject.upper))
    if bound.size:
        names = ", ".join(seen.subject.label(int(i)) for i in bound[:SHOWN])
        said.append(f"on their bounds, differenced to one side: {names}" + (" ..." if bound.size > SHOWN else ""))
    if J.accidents:
        said.append(_accidents(J.accidents, seen))
    scaled = [r.sweep.probe.name for r in check.readings if r.sweep.probe.index is not None and not r.own_scale]
    if scaled and check.verdict == "agrees":
        said.append(f"relative to the whole gradient, being too small to stand alone: {', '.join(scaled[:SHOWN])}")
    if J.left() < 4:
        said.append(
            f"the budget of {seen.plan.budget:g} calls is spent: {int(2 * seen.plan.budget)} would look at every line"
        )
    return tuple(said)


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
    directions = sum(r.says == "agrees" and r.sweep.probe.index is None for r in check.readings)
    parts = [(directions, "random direction"), (count - directions, "component")]
    return " and ".join(f"{n} {what}{'s' if n > 1 else ''}" for n, what in parts if n)


def _best(line: Reading) -> str:
    curve = line.central if line.sweep.two_sided else line.one_sided
    return "unknown" if curve.best_step is None else f"{curve.best_step:.1e}"


def _floor(line: Reading) -> str:
    curve = line.central if line.sweep.two_sided else line.one_sided
    return "unknown" if curve.floor is None else f"{curve.floor:.1e}"


def _h(line: Reading) -> str:
    return "unknown" if line.level is None else f"{line.level.h_min:.1e}"


def _relative_to(line: Reading) -> str:
    return "of the component" if line.own_scale else "of the gradient"


def _who_moved(check: Check) -> str:
    """Tightening tells which side was the loose one."""
    last = check.tightened[-1]
    if last.gradient_moved < 0.1 * last.quotient_moved:
        return f"J moved, the gradient did not ({last.gradient_moved:.0e}): the gradient is sound, J is loosely solved"
    if last.quotient_moved < 0.1 * last.gradient_moved:
        return f"the gradient moved by {last.gradient_moved:.1e}, J did not: the gradient's state is loosely solved"
    return f"both moved, J's slope by {last.quotient_moved:.1e}, the gradient by {last.gradient_moved:.1e}"


def _tighten_for_good(check: Check) -> str:
    todo = f"solve to a tolerance {check.tightened[-1].factor:g} times as large for good"
    return f"{todo}; look at {check.culprit}" if check.culprit else todo


def _components(located: Located) -> str:
    w = located.worst[0]
    named = ", ".join(x.name for x in located.worst[:SHOWN])
    if located.everywhere and located.factor is not None:
        return f"all components looked at ({named}) are off by {_factor(located.factor)}"
    if located.everywhere:
        return f"many components are wrong, {named} among them: {_pair(w)}"
    rest = f", the other {located.right} are right" if located.right else ""
    return f"{named}: {_pair(w)}{rest}"


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
    more = f" and {len(located.worst) - 1} more" if len(located.worst) > 1 else ""
    return f"component {w.name}{factor}{more}"
