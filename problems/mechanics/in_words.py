"""How a body is held and loaded, in words, for a user who has measured or meshed it."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid


def load_in_words(solid: LoadedSolid, face: str) -> str:
    """What is applied: where, its resultant, or what a grip or a follower load does; of cases that of the largest."""
    area = _area_in_words(solid.mesh, face)
    if solid.load == "displacement":
        return f"load: {area} is gripped and moved by {solid.base.load:.4g} m"
    if solid.load == "follower":
        return f"load: {solid.base.load:.4g} Pa on {area}, following its normal"
    k = int(np.linalg.norm(solid.directions, axis=1).argmax())
    F = solid.dead_forces(solid.base, k, np).sum(axis=(0, 1))
    resultant = ", ".join(f"{f:.4g}" for f in np.where(np.abs(F) > 1e-12 * np.abs(F).max(), F, 0.0))
    what = f"load of case {k + 1}" if len(solid.directions) > 1 else "load"
    t = float(solid.base.load * np.linalg.norm(solid.directions[k]))
    return f"{what}: {t:.4g} Pa on {area}, in all ({resultant}) N"


def support_in_words(mesh: Mesh, clamped: str, fixed: str | None, how: str = "held") -> str:
    """Which faces are held, in which components; `how` the clamped ones are."""
    held = [] if clamped == "none" else [_area_in_words(mesh, face.strip()) for face in clamped.split(",")]
    said = [f"{how}: {', '.join(held)}"] if held else []
    rollers = [tuple(part.strip() for part in item.split("@")) for item in fixed.split(",")] if fixed else []
    words = [f"{axis} of {_area_in_words(mesh, face)}" for axis, face in rollers]
    return ", ".join([*said, *([f"held: {', '.join(words)}"] if words else [])])


def _area_in_words(mesh: Mesh, face: str) -> str:
    return f"{face}, {mesh.boundary(face).areas(mesh.geometry.X, np).sum():.4g} m^2"
