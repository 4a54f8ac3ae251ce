"""The rules: from a diagnosis to a verdict. Nothing is measured here."""

from __future__ import annotations

from gradient_routes.bench.verification.locate import Located
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check, Verdict

FALLEN = 1.0 / 3.0  # of a plateau: it has fallen
STANDS = 0.9  # of a plateau: it has not moved
SHRINKS = 0.6  # order in the mesh size from which on a plateau is one of the discretization
OTHERS = 3  # right components for every wrong one, so that the error is local
GROSS = 1e-2  # relative error above which no usual solver tolerance explains a plateau
GROSS_COMPONENT = 0.1  # the same of one component, relative to itself


def verdict(c: Check) -> Verdict:
    """What the deciding line says, and on a plateau what explains it."""
    if c.deciding is None:
        return "undetermined"
    if c.deciding.says == "kink":
        return "non-smooth"
    if c.deciding.says == "plateau":
        return _of_plateau(c)
    if agreed(c.deciding):
        return "agrees"
    return "solver-limited" if c.tightened and c.tightened[-1].reading.says == "agrees" else "noise-limited"


def _of_plateau(c: Check) -> Verdict:
    if solver_explains(c):
        return "solver-limited"
    if c.refined is not None and c.refined.order >= SHRINKS and not _local(c.located):
        return "inconsistent-discretization"
    if c.proof is not None or _local(c.located):
        return "wrong-gradient"
    tested = bool(c.tightened) and (c.factors_tested or any(t.moved for t in c.tightened))
    undecided = _moves(c) if tested else bool(c.not_done) or not _gross(c)
    return "undetermined" if undecided else "wrong-gradient"


def agreed(reading: Reading) -> bool:
    """Whether the whole gradient agrees along this line; components alone do not make a gradient right."""
    return reading.says == "agrees" and reading.quotients.line.whole


def solver_explains(c: Check) -> bool:
    """Whether the error disappears when the forward solve is tightened, or is still falling at the end."""
    if not c.tightened or c.deciding is None:
        return False
    before, last = _before_last(c), c.tightened[-1].reading
    if last.says == "agrees":
        return True
    plateaus = c.deciding.says == last.says == before.says == "plateau"
    return plateaus and last.off < FALLEN * c.deciding.off and last.off < STANDS * before.off


def _moves(c: Check) -> bool:
    """Whether tightening reduces the error, but by too little to tell whose it is."""
    before = _before_last(c)
    return before.says == "plateau" and c.tightened[-1].reading.off < STANDS * before.off


def _before_last(c: Check) -> Reading:
    assert c.deciding is not None
    return c.tightened[-2].reading if len(c.tightened) > 1 else c.deciding


def _gross(c: Check) -> bool:
    """Whether the gradient is off by more than a loosely solved J explains."""
    whole = max((r.off for r in c.readings if r.says == "plateau" and r.index is None), default=0.0)
    worst = max((w.off for w in c.located.worst), default=0.0) if c.located is not None else 0.0
    factor = None if c.located is None else c.located.factor
    return whole >= GROSS or worst >= GROSS_COMPONENT or (factor is not None and abs(factor - 1.0) >= GROSS)


def _local(located: Located | None) -> bool:
    """Whether few components are wrong and many are right: neither a mesh nor a loose solve does that."""
    return located is not None and bool(located.worst) and located.right >= OTHERS * len(located.worst)
