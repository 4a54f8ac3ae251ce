"""Probes: displacements read at nodes, at markers on the surface or at measured points, and the misfit to data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.data.csv import read_columns
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import BRICKS
from gradient_routes.problems.fem.mesh import AXES, Mesh
from gradient_routes.problems.problem import Array

OUTSIDE_TOLERANCE = 1e-3  # of the diameter: distance outside the mesh that is attributed to rounded coordinates


@dataclass(frozen=True, eq=False)
class Probes:
    """Points at which displacements are read.

    nodes (m, k), N (m, k)  a point's displacement is sum_k N_k u(node_k)
    x (m, d)                the points [m]
    measured (m, d)         which components are measured
    """

    nodes: Array
    N: Array
    x: Array
    measured: Array

    def read(self, U: Any) -> Any:
        """(m, d) [m], from the nodes' displacements U (m, k, d)."""
        return (self.N[..., None] * U).sum(1)

    def misfit(self, U: Any, d: Any) -> Any:
        """1/2 |S u - d|^2 over what is measured, holomorphic."""
        return 0.5 * ((self.read(U) - d)[self.measured] ** 2).sum()

    def misfit_gradient(self, U: Array, d: Array) -> Array:
        """Derivative of the misfit with respect to U, (m, k, d)."""
        r = np.where(self.measured, self.read(U) - d, 0.0)
        return np.asarray(self.N[..., None] * r[:, None])


def at_nodes(mesh: Mesh, nodes: Array) -> Probes:
    x = mesh.geometry.X[nodes]
    return Probes(nodes[:, None], np.ones((len(nodes), 1)), x, np.ones(x.shape, dtype=bool))


def markers(mesh: Mesh, face: str, count: int, in_plane: bool, seed: int) -> Probes:
    """Random points on a face, uniform by area; `in_plane` leaves out the component closest to the normal."""
    facets, geometry = mesh.boundary(face), mesh.geometry
    area = facets.areas(geometry.X, np).sum(axis=1)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(area), size=count, p=area / area.sum())
    s = rng.uniform(size=(geometry.dim - 1, count))
    if geometry.dim == 3 and geometry.element.name not in BRICKS:  # map the square to the triangle
        s = np.where(s.sum(axis=0) > 1.0, 1.0 - s, s)
    sides = facets.sides[chosen]
    xi = np.concatenate([geometry.element.on_side(int(side), s[:, [i]])[0] for i, side in enumerate(sides)], axis=1)
    N, _ = geometry.element.shape_functions(xi)
    nodes = geometry.nodes[facets.cells[chosen]]
    measured = np.ones((count, geometry.dim), dtype=bool)
    if in_plane:
        normal = facets.normals(geometry.X[facets.nodes], np).sum(axis=(0, 1))
        measured[:, int(np.abs(normal).argmax())] = False
    return Probes(nodes, N, np.einsum("ma,mai->mi", N, geometry.X[nodes]), measured)


def read_probes(mesh: Mesh, path: str) -> tuple[Probes, Array]:
    """Probes and data (m, d) [m] of a file with columns x,y,z,ux,uy,uz (x,y,ux,uy of a plane body).

    An empty cell was not measured.

    Raises InputError for points outside the body, naming the row.
    """
    axes = AXES[: mesh.geometry.dim]
    measures = tuple(f"u{axis}" for axis in axes)
    columns = read_columns(path, (*axes, *measures), optional=measures)
    x, d = (np.stack([columns[name] for name in names], axis=1) for names in (axes, measures))
    if not len(x) or np.isnan(d).all():
        raise InputError(f"{path}: measures nothing - give at least one row with a displacement")
    cells, xi, outside = mesh.geometry.locate(x)
    extent = np.ptp(mesh.geometry.X[mesh.geometry.nodes[cells]], axis=1).max(axis=1)
    bad = np.flatnonzero(outside * extent > OUTSIDE_TOLERANCE * mesh.diameter)
    if bad.size:
        i, (low, high) = int(bad[0]), mesh.bounding_box
        where, span = (", ".join(f"{value:g}" for value in values) for values in (x[i], high - low))
        raise InputError(
            f"{path}: data row {i + 1} at ({where}) lies outside {mesh.who}, whose box of {span} m begins at"
            f" ({', '.join(f'{v:g}' for v in low)}) ({bad.size} of {len(x)} rows do) - check coordinates and units"
        )
    N, _ = mesh.geometry.element.shape_functions(xi.T)
    measured = ~np.isnan(d)
    return Probes(mesh.geometry.nodes[cells], N, x, measured), np.where(measured, d, 0.0)
