"""What a user should read beside a result for a solid: what is doubtful, and how the body is held and loaded."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from gradient_routes.problems.data.probes import Measured
from gradient_routes.problems.mechanics.design_variables import MATERIAL
from gradient_routes.problems.mechanics.in_words import load_in_words, support_in_words
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.mechanics.supports import Supports

NEARLY_INCOMPRESSIBLE = 0.495


def doubts(o: SimpleNamespace, solid: LoadedSolid, locks: bool, found: Measured | None) -> tuple[str, ...]:
    """Of elements that lock, of a load that is zero, and of data `found` in a file that are larger than the body."""
    said: list[str] = []
    if locks and o.nu > NEARLY_INCOMPRESSIBLE:
        said.append(f"nu={o.nu:.6g} is nearly incompressible: these elements lock, and digits are lost")
    if solid.base.load == 0.0 and o.unknown in MATERIAL and not solid.bc.known.size:
        said.append("zero load: u = 0, and no gradient tells anything about the material")
    if found is not None:
        greatest, size = max(float(np.abs(d).max()) for d in found.d), solid.mesh.diameter
        if greatest > size:
            said.append(f"data up to {greatest:.3g} m for a body of {size:.3g} m: are the units right?")
    return tuple(said)


def setting(o: SimpleNamespace, solid: LoadedSolid, supports: Supports) -> tuple[str, ...]:
    """How the body is held, and what is applied to it unless that is measured."""
    how = "on springs" if supports.springs else "at measured displacements" if supports.known.size else "held"
    held = support_in_words(solid.mesh, o.clamped, o.fixed, how)
    return (held,) if supports.grip_is_measured else (held, load_in_words(solid, o.loaded))
