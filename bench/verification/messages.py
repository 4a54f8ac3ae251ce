"""Verdicts in words: one sentence with the numbers, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.guarded import DOUBLE, Accident, Guarded, Unusable
from gradient_routes.bench.verification.locate import Located, Worst
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check
from gradient_routes.bench.verification.verdict import STANDS, certain

SHOWN = 3  # components and lines named in a sentence
NEXT_TO_ONE = 0.01  # a factor that close to 1 is given by its distance
ODD = 0.25  # distance from the slopes 1 and 2 that is reported
TIGHTEN = "offer tighten(factor), which returns the same objective and gradient with a tighter solver tolerance"
FLOAT64 = "compute in float64 (JAX: jax.config.update('jax_enable_x64', True); PyTorch: dtype=torch.float64)"


def on_unusable(name: str, failure: Unusable) -> Check:
    if failure.wrong:
        return Check(name, "wrong-gradient", str(failure), "correct what the gradient returns")
    return Check(name, "undetermined", str(failure), "make the gradient computable at p")


def on_no_value(name: str, J: Guarded) -> Check:
    what = J.accidents[0].what if J.accidents else "J is not finite"
    return Check(name, "undetermined", f"J cannot be evaluated at p: {what}", "start where J is defined")


def explained(check: Check, seen: Examination) -> Check:
    """The check with its sentence, the next step and, on a plateau, the culprit."""
    reading = check.deciding
    if check.verdict == "unrepeatable":
        assert check.unrepeatable is not None
        todo = "start every call from the same state, with buffers of its own, whatever was asked for before"
        return replace(check, says=check.unrepeatable, todo=todo, culprit="a state kept between calls")
    if check.recorded is not None:
        says = f"the gradient may agree with the recorded J, which is another one: {check.recorded.says}"
        todo = "record J where the gradient is asked for, every branch and iteration of it anew"
        return replace(check, says=says, todo=todo, culprit=check.recorded.culprit)
    if reading is None:
        says = "no line has three steps at which J is finite"
        return replace(check, says=says, todo="make J computable near p, or correct its bounds")
    if reading.says == "plateau":
        return _on_plateau(check, reading)
    if check.verdict == "non-smooth":
        says, todo = _on_break(reading) if reading.broken is not None else _on_kink(check, reading)
    elif check.verdict == "agrees":
        says, todo = _on_agreement(check, reading)
    elif check.verdict == "undetermined":
        says, todo = _on_contradiction(check, reading)
    else:
        says, todo = _on_noise(check, reading, seen.J.eps > DOUBLE)
    return replace(check, says=says, todo=todo)


def _on_contradiction(check: Check, reading: Reading) -> tuple[str, str]:
    """The quotients agree, and something else does not allow to say so."""
    if not check.moves:
        return (
            "J did not change on any line, and the gradient is zero: this point cannot tell",
            "check that J depends on p, and that its solver took a step: an absolute tolerance may be met at once",
        )
    failed = next(f for f in check.findings if f.sound is False)
    says = f"quotients agree along {reading.name}, but {failed.name} does not hold: {failed.says}"
    return says, "look at J near p: it is no differentiable function there, or dominated by higher derivatives"


def _on_break(reading: Reading) -> tuple[str, str]:
    found = reading.broken
    assert found is not None
    sides = " and ".join(found.sides)
    if found.kind == "jump":
        says = f"a jump: J(p + h v) - J(p) tends to {found.size:.3g} {sides} of p along {reading.name}, not to 0"
        return says, "move p off the jump, or make J continuous: it has no gradient there"
    says = f"an infinite slope: J(p + h v) - J(p) falls like h^{found.size:.2g} {sides} of p along {reading.name}"
    return says, "move p away, or bound it: J has no gradient there"


def _on_agreement(check: Check, reading: Reading) -> tuple[str, str]:
    agreeing = [r for r in check.readings if r.says == "agrees"]
    directions = sum(r.index is None for r in agreeing)
    counts = ((directions, "random direction"), (len(agreeing) - directions, "component"))
    lines = " and ".join(f"{n} {what}{'s' if n > 1 else ''}" for n, what in counts if n)
    to = max(max(r.off, r.known_to) for r in agreeing if r.index is None or r is reading)
    says = (
        f"difference quotients agree with the gradient to {to:.1e} along {lines};"
        f" best step {number(reading.curve.best_step, 2)}, floor {number(reading.curve.floor, 2)}"
    )
    noisy = [r.name for r in check.readings if r.says == "noise"]
    if noisy:
        says += f"; too small to test above the noise of J: {', '.join(noisy[:SHOWN])}"
    failed = [f for f in check.findings if f.sound is False and not f.name.startswith("Taylor")]
    if not failed:
        return says, "use the gradient"
    says += f"; but {failed[0].name}: {failed[0].value:.1e}, limit {failed[0].limit:.1e}"
    if any(f.name.startswith("complex step") for f in failed):
        return says, "check that J and R are complex-differentiable: abs, norm and conj are not"
    return says, f"look at {failed[0].culprit or failed[0].name}"


def _on_kink(check: Check, reading: Reading) -> tuple[str, str]:
    where = f"along {reading.name}"
    at = "" if reading.level is None else f" of step {reading.level.h_min:.1e}"
    inside = f"{reading.changed} inside the stencil{at}" if reading.inside else ""
    if reading.kink is None:
        says = f"{inside} {where}: J has a kink there, and difference quotients mix its two slopes"
    else:
        says = f"one-sided quotients {where} converge to limits {reading.kink:.2g} apart, relative to them"
        says += f"; {inside}" if inside else ""
    todo = "move p off the kink, or use one-sided differences: the gradient lies between the slopes of the two sides"
    smooth = max((r for r in check.readings if r.says == "plateau"), key=lambda r: r.off, default=None)
    if smooth is not None:
        todo += f"; along {smooth.name}, where J is smooth, it is off by {smooth.off:.2g} {_relative(smooth)}"
    return says, todo


def _on_noise(check: Check, reading: Reading, single: bool) -> tuple[str, str]:
    noise = f"J scatters by {reading.noise:.1e}"
    if check.verdict == "solver-limited":
        last = check.tightened[-1]
        says = f"{noise} until its forward solve is tightened by {last.factor:g}"
        return f"{says}: then the quotients agree to {last.reading.known_to:.1e}", _tighten_by(check, None)
    says = f"{noise}: the best step leaves a relative uncertainty of {reading.known_to:.1e}, too much to judge"
    if single:
        return says, FLOAT64
    tried = check.tightened or check.not_done
    return says, "tighten the forward solve" + (", or use another test" if tried else f": {TIGHTEN}")


def _on_plateau(check: Check, reading: Reading) -> Check:
    proof, located = check.proof, check.located
    proven = None if proof is None else proof.culprit
    culprit = proven
    says = f"a plateau of {reading.off:.2g} {_relative(reading)} along {reading.name}, at every step size"
    if reading.quotients.line.whole and not reading.slope and not np.any(_slopes(check)):
        says += "; the gradient is exactly 0 while J moves: nothing is connected to p"
    if check.verdict == "solver-limited":
        return _on_solver(check, says, proven)
    if check.tightened:
        says += f", {_how_it_moved(check)} when the forward solve is tightened by {check.tightened[-1].factor:g}"
    if check.refined is not None:
        errors = ", ".join(f"{error:.2g}" for error in check.refined.errors)
        says += f"; on meshes of half the size each the whole gradient is off by {errors}"
        if check.verdict == "inconsistent-discretization":
            says += f": the error shrinks like h^{check.refined.order:.1f}"
            todo = "differentiate the discretized problem: discretize first, then optimize"
            return replace(check, says=says, todo=todo, culprit="an adjoint discretized on its own")
        if check.verdict == "undetermined":
            says += f": at last like h^{check.refined.order:.1f}, no rate yet"
            return replace(check, says=says, todo="check on finer meshes: no order shows on these", culprit=culprit)
        says += f": h^{check.refined.order:.1f}, not a discretization error"
    if located is not None and located.worst:
        says += f"; {_components(located, 'differ' if check.verdict == 'undetermined' else 'are wrong')}"
        culprit = culprit or _component_culprit(located)
    if check.compared is not None:
        says += f"; {check.compared}"
    if check.verdict == "undetermined":
        says, todo = _on_open_plateau(check, says)
        return replace(check, says=says, todo=todo, culprit=culprit)
    todo = f"look at {culprit}" if culprit else "look for a missing or wrong term in every component"
    if located is not None and located.everywhere and not proven and not check.factors_tested:
        todo += "; written as a Problem (docs: how to write a problem), its factors are tested one by one"
    if not check.tightened and not check.not_done and not certain(check):
        todo += f"; to rule out the solver, {TIGHTEN}"
    return replace(check, says=says, todo=todo, culprit=culprit)


def _slopes(check: Check) -> list[float]:
    """The slopes of the gradient on all lines."""
    return [r.slope for r in check.readings if np.isfinite(r.slope)]


def _on_solver(check: Check, says: str, proven: str | None) -> Check:
    if not check.tightened:
        assert check.segment is not None
        part = abs(check.segment.found) / (abs(check.segment.predicted) or 1.0)
        says += f"; over a segment of a tenth of the natural change {part:.1e} of it is left: J is solved loosely at p"
        return replace(check, says=says, todo=TIGHTEN, culprit=proven)
    last = check.tightened[-1]
    says += f", falls to {last.reading.off:.1e} when the forward solve is tightened by {last.factor:g}"
    says += f": {_what_moved(check)}"
    if check.by_solve is not None:
        says += f"; the state alone is estimated to leave an error of {check.by_solve:.1e}"
    return replace(check, says=says, todo=_tighten_by(check, proven), culprit=proven)


def _how_it_moved(check: Check) -> str:
    """In numbers, where it moved."""
    last = max(check.tightened[-1].plateaus, key=lambda r: r.off, default=check.tightened[-1].reading)
    before = next((r for r in check.readings if r.name == last.name and r.level is not None), None)
    if before is None or last.level is None or not last.error < STANDS * before.error:
        return "does not fall"
    return f"falls from {before.off:.2g} to {last.off:.2g} along {last.name} and no further"


def _on_open_plateau(check: Check, says: str) -> tuple[str, str]:
    if check.not_done:
        return f"{says}; a tighter solve was not tested", f"fix this first: {check.not_done[0]}"
    if check.tightened and check.tightened[-1].moved:
        return says, "tighten the solver further"
    if check.tightened:
        return f"{says}: neither J(p) nor the gradient changed in any digit", "let tighten(factor) change the solver"
    return f"{says}; a loosely solved J can cause so small a plateau as well as a small wrong term", TIGHTEN


def remarks(check: Check, seen: Examination) -> tuple[str, ...]:
    """What is unusual about the subject, and what more calls would show."""
    J, said = seen.J, [*seen.subject.notes, *seen.returned.remarks]
    if check.moved is not None:
        said.append(check.moved)
    if J.mutates:
        said.append("the objective changes p in place: it was given copies")
    if seen.remembers:
        said.append(f"J(p) changed by {seen.remembers:.1e} after calls at other points: does it start from the last?")
    elif seen.repeated.scatters:
        count, scatter = len(seen.repeated.values), np.std(seen.repeated.values)
        said.append(f"J is not deterministic: {count} calls at p scatter by {scatter:.1e}")
    if seen.treads:
        said.append(f"J goes in treads of {seen.treads:.1e}, as rounding inside makes: smaller steps were left out")
    if J.eps > DOUBLE:
        said.append(f"J has the precision of float32: its noise is at least {J.eps * abs(seen.J_0):.1e}")
    if max(J.eps, seen.returned.eps) > DOUBLE:
        said.append(f"for a sharper test, {FLOAT64}")
    bound = np.flatnonzero((seen.subject.p <= seen.subject.lower) | (seen.subject.p >= seen.subject.upper))
    if bound.size:
        names = ", ".join(seen.subject.label(int(i)) for i in bound[:SHOWN])
        said.append(f"on their bounds, differenced on one side: {names}" + (" ..." if bound.size > SHOWN else ""))
    if J.accidents:
        said.append(_accidents(J.accidents, seen))
    still = [r.name for r in check.readings if r.index is not None and _has_values(r) and not r.moves]
    if check.readings and not check.moves:
        said.append("J did not change at all: does it depend on p?")
    elif still:
        said.append(f"J does not change with {', '.join(still[:SHOWN])}" + (" ..." if len(still) > SHOWN else ""))
    if check.verdict == "agrees" and check.deciding is not None:
        small = [r for r in check.readings if r.index is not None and r.level and not r.own_scale]
        scaled = [r.name for r in small if r.moves]
        if scaled and len(seen.subject.p) > 1:
            said.append(f"tested relative to the whole gradient, too small on their own: {', '.join(scaled[:SHOWN])}")
        said += _odd_slopes(check.deciding)
    unread = sum(not r.sampled for r in check.readings)
    if math.isfinite(seen.plan.budget) and (J.left() < 2 or unread):
        what = f", {unread} lines were not sampled" if unread else ""
        more = f"--budget {2 * seen.plan.budget:g} tests more"
        said.append(f"the budget of {seen.plan.budget:g} calls allows no more{what}: {more}")
    return tuple(said)


def _has_values(reading: Reading) -> bool:
    return reading.sampled and bool(np.isfinite(reading.quotients.forward).any())


def _odd_slopes(reading: Reading) -> list[str]:
    """Truncation slopes that are not 1 and 2."""
    expected = ((reading.one_sided.slope, 1), (reading.central.slope, 2))
    odd = [f"{slope:.2g} instead of {wanted}" for slope, wanted in expected if slope and abs(slope - wanted) > ODD]
    why = "J is not twice differentiable, or higher derivatives dominate"
    return [f"truncation slopes along {reading.name}: {', '.join(odd)}: {why}"] if odd else []


def _accidents(accidents: Sequence[Accident], seen: Examination) -> str:
    first = accidents[0]
    change = (first.p - seen.subject.p) / seen.subject.natural
    i = int(np.abs(change).argmax())
    where = f"{seen.subject.label(i)} = {first.p[i]:.6g}" if change[i] else "p itself"
    others = np.count_nonzero(change) - 1
    more = f" and {others} others moved along" if others > 0 else ""
    return f"{len(accidents)} points left out, the first at {where}{more}: {first.what}"


def _relative(reading: Reading) -> str:
    return "of the component" if reading.own_scale else "of the gradient"


def _what_moved(check: Check) -> str:
    """Tightening shows which side was solved loosely."""
    last = check.tightened[-1]
    if last.reading.says != "agrees":
        return "it is still falling"
    if last.gradient_moved < 0.1 * last.quotient_moved:
        return f"J moved, the gradient did not ({last.gradient_moved:.0e}): the gradient is right, J is solved loosely"
    if last.quotient_moved < 0.1 * last.gradient_moved:
        return f"the gradient moved by {last.gradient_moved:.1e}, J did not: its state is solved loosely"
    return f"both moved, the slope of J by {last.quotient_moved:.1e}, the gradient by {last.gradient_moved:.1e}"


def _tighten_by(check: Check, culprit: str | None) -> str:
    todo = f"divide the solver tolerance by {1.0 / check.tightened[-1].factor:g}"
    return f"{todo}; look at {culprit}" if culprit else todo


def _components(located: Located, what: str) -> str:
    """`what`: they are wrong, or, where it is open whose the error is, differ."""
    w = located.worst[0]
    named = ", ".join(x.name for x in located.worst[:SHOWN])
    if located.everywhere and located.factor is not None:
        return f"all tested components ({named}) and the whole gradient are off by {_factor(located.factor)}"
    if located.everywhere:
        return f"many components {what}, {named} among them: {_pair(w)}"
    if located.right:
        return f"{named}: {_pair(w)}, the other {located.right} are right"
    one = {"are wrong": "is wrong", "differ": "differs"}[what]
    return f"at least {named} {one if len(located.worst) == 1 else what}: {_pair(w)}"


def _pair(w: Worst) -> str:
    factor = "" if w.factor is None else f", off by {_factor(w.factor)}"
    return f"gradient {w.given:.6g}, differences {w.found:.6g}{factor}"


def _factor(factor: float) -> str:
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
