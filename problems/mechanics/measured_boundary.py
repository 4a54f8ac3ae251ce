"""boundary=measured: faces whose nodes take the displacements that data tell, and the force on one as a datum."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from gradient_routes.problems.data.boundary_values import BoundaryValues
from gradient_routes.problems.data.force_data import DEFAULT_NOISE, ForceData
from gradient_routes.problems.data.load_cases import LoadCases
from gradient_routes.problems.data.units import quantity
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.boundary_conditions import nodes_of_faces
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.mechanics.reaction import Reaction
from gradient_routes.problems.problem import Array


def measured_nodes(mesh: Mesh, o: SimpleNamespace) -> Array:
    """The nodes (n_k,) of the faces that are clamped, and of the loaded one where it has a grip. Raises InputError."""
    if o.boundary != "measured":
        return np.zeros(0, dtype=int)
    nodes = nodes_of_faces(mesh, o.clamped)
    if o.load == "displacement":
        return np.union1d(nodes, mesh.boundary(o.loaded).node_set)
    if not nodes.size:
        raise InputError(f"{mesh.who}: boundary=measured with clamped=none and load={o.load} is of no face - clamp one")
    return nodes


def in_words(found: Sequence[BoundaryValues], dead: bool) -> str:
    """How the nodes' displacements were found, and their noise; dead: whether loads do not follow u."""
    points, nodes = sum(len(of.used) for of in found), sum(len(of.values) for of in found)
    gap, sigma = max(of.gap for of in found), max(of.sigma for of in found)
    noise = f"noise, up to {sigma:.3g} m, is in {'the' if dead else 'no'} error bars"
    noise = noise if sigma else "noise, which is not stated, is in no error bar"
    return (
        f"boundary: {nodes} nodes take the displacements of {points} points about them, the nearest up to {gap:.3g} m"
        f" from a node; their {noise}"
    )


def forces(o: SimpleNamespace, loads: LoadCases | None, who: str) -> Array | None:
    """The force [N] in every load case where grips are at known displacements, None where none is given."""
    if loads is None:
        return None if o.force is None else np.array([o.force])
    if loads.values.ndim == 2 and o.boundary == "measured":
        raise InputError(
            f"{who}: with boundary=measured, load=displacement columns load_x.. of {o.data} are no datum - give the"
            " force along direction= as a column load"
        )
    if o.boundary == "measured":
        if loads.kind == "force":
            if o.force is not None:
                raise InputError(f"{who}: force= and column load of {o.data} both state the force - keep one")
            return loads.values
        if loads.kind == "ratio" and o.force is not None:
            return np.asarray(o.force * loads.values)
        raise InputError(
            f"{who}: with boundary=measured, load=displacement a column load is the force on {o.loaded} - give it in N,"
            " or as factors of force="
        )
    if o.force is not None:
        raise InputError(f"{who}: force= is that of one load case, {o.data} has {len(loads.values)} - leave it out")
    return None


def force_data(
    solid: LoadedSolid, F: Array, direction: Array, apart: Array, noise: float | str | None, sigma: float, rms: float
) -> tuple[ForceData, str]:
    """F (cases,) as data beside displacements of the noise sigma and the size rms [m], and a note on it; `apart` are
    nodes that the loaded face must not have.

    Raises InputError.
    """
    who, face = solid.mesh.who, solid.loaded
    if np.intersect1d(face.node_set, apart).size:
        raise InputError(f"{who}: force= is that of a face apart from what else is held - load one that does not touch")
    sigma_F = quantity(noise, "force", f"{who}: force_noise={noise}") if noise is not None else 0.0
    if noise is not None and not sigma_F > 0.0:
        raise InputError(f"{who}: force_noise={noise} - give a standard deviation > 0")
    assumed = " (1 % of it; force_noise= states another)" if noise is None else ""
    sigma_F = sigma_F or DEFAULT_NOISE * float(np.abs(F).max())
    if not sigma_F > 0.0:
        raise InputError(f"{who}: force=0 tells no modulus - give the force that was measured, or leave it out")
    e = np.zeros_like(solid.mesh.geometry.X)
    e[face.node_set] = direction / np.linalg.norm(direction)
    given = ", ".join(f"{F_k:.4g}" for F_k in F[:8]) + (", ..." if len(F) > 8 else "")
    along = ", ".join(f"{v:.3g}" for v in np.round(e[face.node_set[0]], 9) + 0.0)
    beside = "" if sigma else f", beside displacements of {DEFAULT_NOISE * rms:.3g} m, 1 % of their rms"
    note = f"force: {given} N along ({along}) on the loaded face, +- {sigma_F:.3g} N{assumed}, is a datum{beside}"
    return ForceData(Reaction(solid, e), F, (sigma or DEFAULT_NOISE * rms) / sigma_F), note
