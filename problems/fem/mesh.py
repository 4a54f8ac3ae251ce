"""Meshes of boxes and of mesh files, and parts of their boundary by name or by plane."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.units import UNITS
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import BRICKS, MESHIO, Element, ElementName, Geometry
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.problem import Array

# coordinate and end of the bounding box, of a solid and of a plane body
SIDES = {
    3: {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (2, 0), "top": (2, 1)},
    2: {"left": (0, 0), "right": (0, 1), "bottom": (1, 0), "top": (1, 1)},
}
AXES = "xyz"
PLANE_TOLERANCE = 1e-6  # of the diameter: largest distance of a facet's nodes from the plane
MESHIO_CELLS: dict[int, dict[str, ElementName]] = {  # by meshio's names, for each dimension
    3: {MESHIO[element][0]: element for element in ("hex8", "tet4", "tet10")},
    2: {MESHIO[element][0]: element for element in ("quad4", "quad8", "tri3", "tri6")},
}
LOWER_DIMENSIONAL = {3: ("vertex", "line", "triangle", "quad"), 2: ("vertex", "line")}  # beginnings of meshio's names
CORNERS = {"line3": ("line", 2), "triangle6": ("triangle", 3), "quad8": ("quad", 4)}


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

    def boundary(self, where: str) -> Facets:
        """Boundary facets by name: top, z=0.5, or a name in the mesh file. Raises InputError."""
        facets = self.boundaries.get(where)
        if facets is None:
            facets = self._on_plane(where)
        if not facets.size:
            raise InputError(f"{self.who}: no facet of the surface lies on {where} - {self._choices()}")
        cells = self.skfem_mesh.f2t[0, facets]
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


def read_mesh(who: str, path: str | Path, unit: str = "m", dim: int = 3) -> Mesh:
    """The hexahedra or tetrahedra of a mesh file that meshio reads, with its named boundaries; dim = 2: the
    quadrilaterals or triangles, in a plane z = constant. `unit` is the file's.

    Raises InputError for a file that cannot be read, without cells of one kind and this dimension, or inverted ones.
    """
    import meshio
    from skfem.io.meshio import from_meshio

    if not Path(path).is_file():
        raise InputError(f"{who}: mesh={path}: no such file - check the path")
    said_aside = io.StringIO()
    try:
        with redirect_stdout(said_aside), redirect_stderr(said_aside):
            found = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio's readers raise errors of many types
        said = " ".join(f"{said_aside.getvalue()} {error}".split()) or f"{type(error).__name__}, a broken file?"
        raise InputError(f"{who}: mesh={path} cannot be read ({said}) - give a format meshio knows") from None
    known = MESHIO_CELLS[dim]
    kinds = [kind for kind in found.cells_dict if not kind.startswith(LOWER_DIMENSIONAL[dim])]
    if len(kinds) != 1 or kinds[0] not in known:
        has = ", ".join(found.cells_dict) or "no cells"
        raise InputError(f"{who}: mesh={path} has {has} - it needs cells of one kind out of {', '.join(known)}")
    element, cells = known[kinds[0]], found.cells_dict[kinds[0]]
    if cells.min() < 0 or cells.max() >= len(found.points):
        raise InputError(f"{who}: mesh={path} has cells of points beyond its {len(found.points)} - correct the file")
    X = found.points
    if not dim <= X.shape[1] <= 3:
        raise InputError(
            f"{who}: mesh={path} has points of {X.shape[1]} coordinates - it needs {', '.join(AXES[:dim])}"
        )
    X = found.points = X * UNITS["length"][unit]
    if dim == 2 and X.shape[1] == 3 and np.ptp(X[cells], axis=(0, 1))[2] > PLANE_TOLERANCE * np.ptp(X[cells]):
        low, high = X[cells][..., 2].min(), X[cells][..., 2].max()
        raise InputError(f"{who}: mesh={path} is not plane: z from {low:g} to {high:g} - give one in the plane z = 0")
    for block in found.cells:  # scikit-fem matches facets by their corners only, and has no quad8
        if block.type in CORNERS and (dim, block.type) != (2, "triangle6"):
            block.type, block.data = CORNERS[block.type][0], block.data[:, : CORNERS[block.type][1]]
    kind = "quad" if element == "quad8" else kinds[0]
    mesh = make_mesh(who, element, from_meshio(found, force_meshio_type=kind, ignore_orientation=True))
    if element == "quad8":
        geometry = replace(mesh.geometry, nodes=cells, X=np.ascontiguousarray(X[:, :2]))
        mesh = replace(mesh, geometry=geometry)
    check_cells(mesh, f"mesh={path}", "correct the mesh")
    return mesh


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
    """From scikit-fem's mesh of the corners, or of all nodes of a tet10 or tri6."""
    from skfem import MeshTet2, MeshTri2

    if element in ("quad8", "tri6") and not isinstance(mesh, MeshTri2):
        nodes = np.concatenate([mesh.t, mesh.nvertices + mesh.t2f])
        X = np.concatenate([mesh.p, mesh.p[:, mesh.facets].mean(axis=1)], axis=1)
        return Mesh(who, mesh, Geometry(Element(element), nodes.T, np.ascontiguousarray(X.T)))
    if element in ("tet10", "tri6"):
        quadratic = mesh if isinstance(mesh, MeshTet2 | MeshTri2) else MeshTet2.from_mesh(mesh)
        return Mesh(who, quadratic, Geometry(Element(element), quadratic.dofs.element_dofs.T, quadratic.doflocs.T))
    return Mesh(who, mesh, Geometry(Element(element), np.ascontiguousarray(mesh.t.T), np.ascontiguousarray(mesh.p.T)))
