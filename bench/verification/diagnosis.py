"""Everything that is measured before a verdict: the deciding line, and on a plateau whose error it is.

An error that falls with the tolerance of the forward solve is the solver's; one that shrinks with the mesh size is the
discretization's; one confined to few components, to one factor, or alike at a second point, is the gradient's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from gradient_routes.bench.verification import verdict
from gradient_routes.bench.verification.comparison import compared
from gradient_routes.bench.verification.evidence import evidence
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.locate import Located, Search, locate
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.refinement import refine
from gradient_routes.bench.verification.result import SHRINKS, Check, Refined
from gradient_routes.bench.verification.segment import segment
from gradient_routes.bench.verification.tightening import tighten
from gradient_routes.bench.verification.unrepeatable import unrepeatable

BY_FAR = 1e-2  # part of the largest error from which on a random direction decides rather than a component


def diagnose(seen: Examination) -> Check:
    """The readings, the deciding one, and what explains it; verdict and words are left open."""
    reading = deciding(seen.readings)
    name, readings, findings = seen.subject.name, tuple(seen.readings), tuple(evidence(seen))
    found = Check(name, readings=readings, deciding=reading, findings=findings, noise=readings[0].noise)
    found = replace(found, unrepeatable=unrepeatable(seen, reading))
    if reading is None or reading.says == "kink" or verdict.agreed(reading):
        return found
    judged = seen
    if seen.subject.tighten is not None:
        tightened, tight, ended = tighten(seen, reading)
        found = replace(found, tightened=tightened, not_done=() if ended is None else (ended,))
        judged = tight or seen
    if found.unrepeatable or reading.says != "plateau" or verdict.solver_explains(found):
        return found
    if seen.subject.refine is not None and (found.proof is None or found.proof.by_mesh):
        found = _refined(found, seen, reading)
    where = located(judged)
    found = replace(found, located=where)
    if seen.subject.tighten is None and found.proof is None:
        if not verdict.convicted(found):
            found = replace(found, compared=compared(seen, reading, where))
        if not verdict.certain(found):
            found = replace(found, segment=segment(seen, reading))
    return found


def _refined(found: Check, seen: Examination, reading: Reading) -> Check:
    refined = refine(seen, reading)
    if isinstance(refined, Refined):
        return replace(found, refined=refined)
    why = Finding("mesh refinement", math.nan, SHRINKS, refined)
    return replace(found, findings=(*found.findings, why))


def located(judged: Examination) -> Located:
    """The wrong components, by the tightest J there is."""
    shown = [r for r in judged.readings if r.index is None and r.says == "plateau"]
    return locate(judged, Search(judged, worst(shown)) if shown else None)


def deciding(readings: Sequence[Reading]) -> Reading | None:
    """The line that the verdict rests on: kinks before plateaus before agreement of the whole before noise.

    A kink seen along single components does not excuse a plateau along a direction.
    """
    by = {says: [r for r in readings if r.says == says] for says in ("kink", "plateau", "agrees", "noise")}
    wrong = [r for r in by["plateau"] if r.index is None]  # beyond both slopes of any kink
    if by["kink"] and not (wrong and all(r.index is not None for r in by["kink"])):
        return max(by["kink"], key=lambda r: (r.broken is not None, r.kink or 0.0))
    if by["plateau"]:
        return worst(by["plateau"])
    undecided = [r for r in by["agrees"] if verdict.agreed(r)] or by["noise"] or by["agrees"]
    return max(undecided, key=lambda r: (len(r.quotients.h), r.known_to), default=None)  # fullest, least certain


def worst(readings: Sequence[Reading]) -> Reading:
    """The most widely sampled and worst random direction, unless a component is worse by far.

    An error along a random direction is one of the whole gradient.
    """
    worst = max(readings, key=lambda r: r.off)
    whole = [r for r in readings if r.index is None and r.off > BY_FAR * worst.off]
    return max(whole, key=lambda r: (len(r.quotients.h), r.off)) if whole else worst
