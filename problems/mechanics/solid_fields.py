"""Fields of a solid for a picture: displacements, adjoints, and what p and dJ/dp are in its cells and at its nodes."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.problem import Array, Fields


def fields_of(solid: LoadedSolid, log: bool, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
    """u, lam (n_nodes, 3) per load case; E, dJ/dE per cell if p are moduli, t and dJ/dt if it is the thickness;
    dJ/dX per node if p is a shape.
    """
    design, geometry = solid.design, solid.mesh.geometry
    s, every, cases = solid.setup(p), np.arange(len(geometry.X)), len(solid.directions)
    point_data, cell_data = {}, {}
    for case in range(cases):
        number = f"_{case + 1}" if cases > 1 else ""
        point_data[f"u{number}"] = solid.displacements(u, s, case, every)
        if lam is not None:
            point_data[f"lambda{number}"] = solid.bc.variations(lam, case, every)
    if design.field is not None:
        name, cells = design.field, design.parameter_of_cell
        value = np.exp(p) if log else p
        by_value = gradient / value if log else gradient
        cell_data = {name: value[cells], f"dJ_d{name}": by_value[cells]}
    if design.moved_nodes is not None:
        point_data["dJ_dX"] = np.zeros_like(s.X)
        moved = design.moved_nodes
        point_data["dJ_dX"][moved] = gradient[: moved.size * geometry.dim].reshape(-1, geometry.dim)
    return Fields(in_space(s.X), *geometry.for_meshio(), {k: in_space(v) for k, v in point_data.items()}, cell_data)


def in_space(x: Array) -> Array:
    """Points or vectors (n, d) as (n, 3)."""
    return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))
