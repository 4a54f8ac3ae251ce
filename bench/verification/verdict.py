"""The rules: from a diagnosis to a verdict. Nothing is measured here."""

from __future__ import annotations

from gradient_routes.bench.verification.locate import Located
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check, Verdict

FALLEN = 1.0 / 3.0  # of a plateau: it has fallen
STANDS = 0.9  # of a plateau: it has not moved
OTHERS = 3  # right components for every wrong one, so that the error is local
CONTRAST = 100.0  # errors of the right components that those of the wrong ones exceed, where J cannot be tightened
GROSS = 1e-2  # relative error above which no usual solver tolerance explains a plateau
GROSS_COMPONENT = 0.1  # the same of one component, relative to itself, whose error is gross beside the gradient's size
UNSOUND = "Taylor"  # evidence on J and the gradient alone, which agreement must not contradict


def verdict(c: Check) -> Verdict:
    """What the deciding line says, and on a plateau what explains it."""
    if c.unrepeatable and not solver_explains(c):
        return "unrepeatable"
    if c.recorded is not None:
        return "wrong-gradient"
    if c.deciding is None:
        return "undetermined"
    if c.deciding.says == "kink":
        return "non-smooth"
    if c.deciding.says == "plateau":
        return _of_plateau(c)
    if agreed(c.deciding):
        contradicted = any(f.sound is False and f.name.startswith(UNSOUND) for f in c.findings)
        return "undetermined" if contradicted or not c.moves else "agrees"
    return "solver-limited" if c.tightened and c.tightened[-1].sound else "noise-limited"


def _of_plateau(c: Check) -> Verdict:
    if solver_explains(c):
        return "solver-limited"
    if c.refined is not None and not certain(c):
        if c.refined.shrinks:
            return "inconsistent-discretization"
        if not c.refined.stays:
            return "undetermined"
    if convicted(c):
        solver = c.segment is not None and c.segment.by_solver and not certain(c)
        return "solver-limited" if solver else "wrong-gradient"
    return "solver-limited" if c.segment is not None and c.segment.by_solver else "undetermined"


def convicted(c: Check) -> bool:
    """Whether a plateau is the gradient's mistake, for what is known so far."""
    if certain(c) or c.proof is not None:
        return True
    if not c.tightened:
        return not c.not_done and _gross(c)
    tested = c.factors_tested or any(t.moved for t in c.tightened)
    return not _moves(c) if tested else not c.not_done and _gross(c)


def certain(c: Check) -> bool:
    """Whether no solver and no mesh makes such an error: it is confined to few components, or alike elsewhere."""
    if c.compared is not None:
        return True
    if c.located is None or not c.located.worst:
        return False
    apart = c.located.contrast >= CONTRAST
    if apart and all(w.given == 0.0 for w in c.located.worst):
        return True  # no solver drops a component entirely
    tested = c.factors_tested or any(t.moved for t in c.tightened)
    return _local(c.located) and (tested or (apart and min(w.off for w in c.located.worst) >= GROSS))


def agreed(reading: Reading) -> bool:
    """Whether the whole gradient agrees along this line; components alone do not make a gradient right."""
    return reading.says == "agrees" and reading.quotients.line.whole


def solver_explains(c: Check) -> bool:
    """Whether the error disappears when the forward solve is tightened, or is still falling at the end."""
    if not c.tightened or c.deciding is None:
        return False
    if c.tightened[-1].sound:
        return True
    before = c.tightened[-2].readings if len(c.tightened) > 1 else c.readings
    falls = [_falls(r, before) and _falls(r, c.readings) for r in c.tightened[-1].plateaus]
    return c.deciding.says == "plateau" and bool(falls) and all(falls)


def _falls(reading: Reading, before: tuple[Reading, ...]) -> bool:
    """Whether the plateau of a line has fallen below a third."""
    return any(_same(b, reading) and b.says == "plateau" and reading.error < FALLEN * b.error for b in before)


def _same(a: Reading, b: Reading) -> bool:
    return a.quotients.line is b.quotients.line


def _moves(c: Check) -> bool:
    """Whether tightening reduces the error of every line, but by too little to tell whose it is."""
    before = c.tightened[-2].readings if len(c.tightened) > 1 else c.readings
    plateaus = c.tightened[-1].plateaus
    if not plateaus:
        return True
    return all(any(_same(b, r) and r.error < STANDS * b.error for b in before) for r in plateaus)


def _gross(c: Check) -> bool:
    """Whether the gradient is off by more than a loosely solved J explains."""
    whole = max((r.off for r in c.readings if r.says == "plateau" and r.quotients.line.whole), default=0.0)
    parts = () if c.located is None else c.located.worst
    worst = max((w.off for w in parts if w.share >= GROSS), default=0.0)
    factor = None if c.located is None else c.located.factor
    return whole >= GROSS or worst >= GROSS_COMPONENT or (factor is not None and abs(factor - 1.0) >= GROSS)


def _local(located: Located | None) -> bool:
    """Whether few components are wrong and many are right: neither a mesh nor a loose solve does that."""
    return located is not None and bool(located.worst) and located.right >= OTHERS * len(located.worst)
