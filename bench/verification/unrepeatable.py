"""When another answer to the same question matters."""

from __future__ import annotations

from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.plateau import DIFFERENT
from gradient_routes.bench.verification.reading import ZERO, Reading

GRADIENT = 1e-6  # relative difference of two gradients at p
OBJECTIVE = 1e-3  # change of J(p) relative to |J(p)| and to its natural change; a smaller one counts as noise


def unrepeatable(seen: Examination, reading: Reading | None) -> str | None:
    """What differs, and by how much; None where J and the gradient are the same again, or nearly.

    A small change of J(p) matters where larger steps agree with the gradient: the quotients of small steps are then
    of a J that starts from its last state, and stops there.
    """
    said, J, found = [], abs(seen.J_0), seen.repeated
    size = max(seen.size, ZERO * max((r.change for r in seen.readings), default=0.0))
    moved = found.moved(seen.subject.natural)
    if moved > max(GRADIENT, seen.accepted) * size:
        said.append(f"the gradient at p differs by {moved / (size or 1.0):.2g}, relative, when it is asked for again")
    least = OBJECTIVE * max(J, seen.size)
    if found.by_gradient > least:
        said.append(f"J(p) = {seen.J_0:.6g} changes by {found.by_gradient:.2g} when the gradient has been asked for")
    if seen.remembers > least or (seen.remembers and reading is not None and _agrees_far(reading)):
        said.append(f"J(p) = {seen.J_0:.6g} changes by {seen.remembers:.2g} when J has been asked for elsewhere")
    return "; ".join(said) or None


def _agrees_far(reading: Reading) -> bool:
    ranges = reading.contradicted if reading.says == "plateau" else []
    return any(abs(a.value) <= DIFFERENT * a.uncertainty and a.h > reading.level.h for a in ranges if reading.level)
