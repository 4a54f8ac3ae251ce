"""Meshes, of boxes among them, and parts of their boundary by name or by plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import BRICKS, Element, ElementName, Geometry
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.problem import Array

# coordinate and end of the bounding box, of a solid and of a plane body
SIDES = {
    3: {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (2, 0), "top": (2, 1)},
    2: {"left": (0, 0), "right": (0, 1), "bottom": (1, 0), "top": (1, 1)},
}
AXES = "xyz"
PLANE_TOLERANCE = 1e-6  # of the diameter: largest distance of a facet's nodes from the plane


@dataclass(frozen=True, eq=False)
class Mesh:
    """Cells and named boundaries.

    who         prefix of error messages
    skfem_mesh  scikit-fem's mesh of the vertices, with the boundaries that the mesh file names
    """

    who: str
    skfem_mesh: Any
    geometry: Geometry

    @cached_property
    def bounding_box(self) -> Array:
        """(2, d) [m], the least and greatest coordinates."""
        X = self.geometry.X[np.unique(self.geometry.nodes)]
        return np.stack([X.min(axis=0), X.max(axis=0)])

    @property
    def diameter(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(self.bounding_box[1] - self.bounding_box[0]))

    def normalized(self, x: Array) -> Array:
        """Points (..., d) scaled to the unit cube: 0 at the least coordinate, 1 at the greatest."""
        return np.asarray((x - self.bounding_box[0]) / np.maximum(self.bounding_box[1] - self.bounding_box[0], 1e-300))

    @cached_property
    def boundaries(self) -> dict[str, Array]:
        return {str(name): np.asarray(facets) for name, facets in (self.skfem_mesh.boundaries or {}).items()}

    @cached_property
    def regions(self) -> dict[str, Array]:
        """The numbers of the cells of each region that the mesh file names."""
        named = self.skfem_mesh.subdomains or {}
        return {str(name): np.asarray(cells) for name, cells in named.items() if not str(name).startswith("gmsh:")}

    def boundary(self, where: str, surface: bool = False) -> Facets:
        """Facets by name: top, z=0.5, or a name in the mesh file; with `surface` none inside. Raises InputError."""
        facets = self.boundaries.get(where)
        if facets is None:
            facets = self._on_plane(where)
        if not facets.size:
            raise InputError(f"{self.who}: no facet of the surface lies on {where} - {self._choices()}")
        cells, behind = self.skfem_mesh.f2t[:, facets]
        inside = int((behind != -1).sum())
        if surface and inside:
            raise InputError(
                f"{self.who}: {inside} of {len(facets)} facets of {where} lie inside the body, where a load has no side"
                " - name a part of its surface"
            )
        return Facets.of(self.geometry, cells, (self.skfem_mesh.t2f[:, cells] == facets).argmax(axis=0))

    def _on_plane(self, where: str) -> Array:
        dim, sides = self.geometry.dim, SIDES[self.geometry.dim]
        if where in sides:
            axis, end = sides[where]
            value = self.bounding_box[end, axis]
        else:
            name, _, text = where.partition("=")
            try:
                axis, value = AXES[:dim].index(name.strip() or "?"), float(text)
            except ValueError:
                raise InputError(f"{self.who}: no boundary '{where}' - {self._choices()}") from None
        boundary = self.skfem_mesh.boundary_facets()
        away = np.abs(self.skfem_mesh.p[axis][self.skfem_mesh.facets[:, boundary]] - value).max(axis=0)
        return np.asarray(boundary[away <= PLANE_TOLERANCE * self.diameter])

    def _choices(self) -> str:
        last, names = self.geometry.dim - 1, [*self.boundaries, *SIDES[self.geometry.dim]]
        return f"choose {', '.join(names)} or a plane such as {AXES[last]}={self.bounding_box[0, last]:g}"


def box_mesh(who: str, element: ElementName, cells: tuple[int, int, int], size: tuple[float, float, float]) -> Mesh:
    """A box of cells[0] x cells[1] x cells[2] bricks, each split into six if the element is a tetrahedron."""
    from skfem import MeshHex

    mesh: Any = MeshHex.init_tensor(*(np.linspace(0.0, L, n + 1) for L, n in zip(size, cells, strict=True)))
    return make_mesh(who, element, mesh if element in BRICKS else mesh.to_meshtet())


def check_cells(mesh: Mesh, what: str, do: str) -> None:
    """Raises InputError for flat, inverted or overlapping cells; either orientation of the numbering is valid."""
    geometry, skfem_mesh = mesh.geometry, mesh.skfem_mesh
    if not np.isfinite(geometry.X).all():
        raise InputError(f"{mesh.who}: {what} has points that are not finite - {do}")
    det = geometry.determinants()  # (n_e, n_a), at the nodes
    extent = np.ptp(geometry.X[geometry.nodes], axis=1).max(axis=1)[:, None]
    bad = (np.abs(det) <= 1e-12 * extent**geometry.dim).any(axis=1) | (np.sign(det) != np.sign(det[:, :1])).any(axis=1)
    inner = np.flatnonzero(skfem_mesh.f2t[1] != -1)
    corners = skfem_mesh.p[:, skfem_mesh.facets[:, inner]]  # (d, corners, n_f)
    a, b = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    normal = np.cross(a, b, axis=0) if geometry.dim == 3 else np.stack([-a[1], a[0]])
    centre = skfem_mesh.p[:, skfem_mesh.t].mean(axis=1)
    sides = [((centre[:, skfem_mesh.f2t[k, inner]] - corners.mean(axis=1)) * normal).sum(axis=0) for k in (0, 1)]
    bad[skfem_mesh.f2t[:, inner[sides[0] * sides[1] >= 0]]] = True
    if bad.any():
        raise InputError(
            f"{mesh.who}: {what}: {bad.sum()} of {len(bad)} cells are flat, inside out or folded over a neighbour,"
            f" first cell {np.flatnonzero(bad)[0] + 1} - {do}"
        )


def make_mesh(who: str, element: ElementName, mesh: Any) -> Mesh:
    """From scikit-fem's mesh of the corners; other nodes are in the middle of edges."""
    from skfem import MeshTet2

    if element in ("quad8", "tri6"):
        nodes = np.concatenate([mesh.t, mesh.nvertices + mesh.t2f])
        X = np.concatenate([mesh.p, mesh.p[:, mesh.facets].mean(axis=1)], axis=1)
        return Mesh(who, mesh, Geometry(Element(element), nodes.T, np.ascontiguousarray(X.T)))
    if element == "tet10":
        mesh = MeshTet2.from_mesh(mesh)
        return Mesh(who, mesh, Geometry(Element(element), mesh.dofs.element_dofs.T, mesh.doflocs.T))
    return Mesh(who, mesh, Geometry(Element(element), np.ascontiguousarray(mesh.t.T), np.ascontiguousarray(mesh.p.T)))
