"""Nodes where cells touch and are not joined: seams that were never merged, and hanging nodes."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.fem.locating import holders
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.problem import Array

TOUCHING = 1e-4  # in reference coordinates of a cell: distance of a node that files with few digits leave
NAMED = 3  # nodes that a message names


def check_seams(mesh: Mesh, what: str) -> None:
    """Raises InputError for a node of the surface that lies in a cell it is no node of, naming both.

    There the body is cut, whatever it looks like: displacements of the two sides differ.
    """
    geometry, surface = mesh.geometry, _surface(mesh)
    points, cells = holders(geometry, geometry.X[surface], TOUCHING)
    at = surface[points]
    foreign = (geometry.nodes[cells] != at[:, None]).all(axis=1)
    at, cells = at[foreign], cells[foreign]
    if not at.size:
        return
    X, others = geometry.X, geometry.nodes[cells]
    away = np.linalg.norm(X[others] - X[at][:, None], axis=2)
    twin, same = others[np.arange(len(at)), away.argmin(axis=1)], away.min(axis=1) <= TOUCHING * _extent(X[others])
    if same.any():
        pairs = np.unique(np.sort(np.stack([at, twin], axis=1)[same], axis=1), axis=0)
        said = ", ".join(f"{a + 1} and {b + 1} at {_point(mesh, a)}" for a, b in pairs[:NAMED])
        raise InputError(
            f"{mesh.who}: {what}: nodes of cells that touch are not joined, pairs at one place: {len(pairs)}, {said}"
            " - merge them, or open the gap if it is meant"
        )
    nodes, first = np.unique(at, return_index=True)
    said = ", ".join(f"{at[i] + 1} at {_point(mesh, at[i])} in cell {cells[i] + 1}" for i in first[:NAMED])
    raise InputError(
        f"{mesh.who}: {what}: nodes that lie in or on cells without being joined to them: {len(nodes)}, {said}"
        " - refine these cells, so that sides match"
    )


def _extent(X: Array) -> Array:
    """(n,) [m], the size of cells with the nodes X (n, n_a, d)."""
    return np.asarray(np.ptp(X, axis=1).max(axis=1))


def _surface(mesh: Mesh) -> Array:
    """The nodes of the surface."""
    facets = mesh.skfem_mesh.boundary_facets()
    cells = mesh.skfem_mesh.f2t[0, facets]
    return Facets.of(mesh.geometry, cells, (mesh.skfem_mesh.t2f[:, cells] == facets).argmax(axis=0)).node_set


def _point(mesh: Mesh, node: int) -> str:
    return f"({', '.join(f'{x:.4g}' for x in mesh.geometry.X[node])})"
