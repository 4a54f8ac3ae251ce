"""Meshes of boxes and of mesh files, and parts of their boundary by name or by plane."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import Element, ElementName, Facets, Geometry
from gradient_routes.problems.problem import Array

SIDES = {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (2, 0), "top": (2, 1)}
AXES = {"x": 0, "y": 1, "z": 2}
PLANE_TOLERANCE = 1e-6  # of the diameter: largest distance of a facet's nodes from the plane
MESHIO_CELLS: dict[str, ElementName] = {"hexahedron": "hex8", "tetra": "tet4", "tetra10": "tet10"}  # by meshio's names
LOWER_DIMENSIONAL = ("vertex", "line", "triangle", "quad")  # meshio's cell types without volume


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
        """(2, 3) [m], the least and greatest coordinates."""
        X = self.geometry.X[np.unique(self.geometry.nodes)]
        return np.stack([X.min(axis=0), X.max(axis=0)])

    @property
    def diameter(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(self.bounding_box[1] - self.bounding_box[0]))

    def normalized(self, x: Array) -> Array:
        """Points (..., 3) scaled to the unit cube: 0 at the least coordinate, 1 at the greatest."""
        return np.asarray((x - self.bounding_box[0]) / np.maximum(self.bounding_box[1] - self.bounding_box[0], 1e-300))

    @cached_property
    def boundaries(self) -> dict[str, Array]:
        return {str(name): np.asarray(facets) for name, facets in (self.skfem_mesh.boundaries or {}).items()}

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
        if where in SIDES:
            axis, end = SIDES[where]
            value = self.bounding_box[end, axis]
        else:
            name, _, text = where.partition("=")
            try:
                axis, value = AXES[name.strip()], float(text)
            except (KeyError, ValueError):
                raise InputError(f"{self.who}: no boundary '{where}' - {self._choices()}") from None
        boundary = self.skfem_mesh.boundary_facets()
        away = np.abs(self.skfem_mesh.p[axis][self.skfem_mesh.facets[:, boundary]] - value).max(axis=0)
        return np.asarray(boundary[away <= PLANE_TOLERANCE * self.diameter])

    def _choices(self) -> str:
        return f"choose {', '.join([*self.boundaries, *SIDES])} or a plane such as z={self.bounding_box[0, 2]:g}"


def box_mesh(who: str, element: ElementName, cells: tuple[int, int, int], size: tuple[float, float, float]) -> Mesh:
    """A box of cells[0] x cells[1] x cells[2] bricks, each split into six if the element is a tetrahedron."""
    from skfem import MeshHex

    mesh: Any = MeshHex.init_tensor(*(np.linspace(0.0, L, n + 1) for L, n in zip(size, cells, strict=True)))
    return _make_mesh(who, element, mesh if element == "hex8" else mesh.to_meshtet())


def read_mesh(who: str, path: str | Path) -> Mesh:
    """The hexahedra or tetrahedra of a mesh file that meshio reads, with its named boundaries.

    Raises InputError for a file that cannot be read, that has no volume cells of one kind, or inverted cells.
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
    kinds = [kind for kind in found.cells_dict if not kind.startswith(LOWER_DIMENSIONAL)]
    if len(kinds) != 1 or kinds[0] not in MESHIO_CELLS:
        has = ", ".join(found.cells_dict) or "no cells"
        raise InputError(f"{who}: mesh={path} has {has} - it needs cells of one kind out of {', '.join(MESHIO_CELLS)}")
    cells = found.cells_dict[kinds[0]]
    if cells.min() < 0 or cells.max() >= len(found.points):
        raise InputError(f"{who}: mesh={path} has cells of points beyond its {len(found.points)} - correct the file")
    if np.shape(found.points)[1:] != (3,):
        raise InputError(
            f"{who}: mesh={path} has points of {np.shape(found.points)[-1]} coordinates - it needs x, y, z"
        )
    for block in found.cells:
        if block.type == "triangle6":  # scikit-fem matches facets by their corners only
            block.type, block.data = "triangle", block.data[:, :3]
    skfem_mesh = from_meshio(found, force_meshio_type=kinds[0], ignore_orientation=True)
    mesh = _make_mesh(who, MESHIO_CELLS[kinds[0]], skfem_mesh)
    _check_cells(mesh, path)
    return mesh


def _check_cells(mesh: Mesh, path: str | Path) -> None:
    """Raises InputError for flat, inverted or overlapping cells; either orientation of the numbering is valid."""
    geometry, skfem_mesh = mesh.geometry, mesh.skfem_mesh
    if not np.isfinite(geometry.X).all():
        raise InputError(f"{mesh.who}: mesh={path} has points that are not finite - correct the file")
    det = geometry.determinants()  # (n_e, n_a), at the nodes
    extent = np.ptp(geometry.X[geometry.nodes], axis=1).max(axis=1)[:, None]
    bad = (np.abs(det) <= 1e-12 * extent**3).any(axis=1) | (np.sign(det) != np.sign(det[:, :1])).any(axis=1)
    inner = np.flatnonzero(skfem_mesh.f2t[1] != -1)
    corners = skfem_mesh.p[:, skfem_mesh.facets[:, inner]]  # (3, 3 or 4, n_f)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], axis=0)
    centre = skfem_mesh.p[:, skfem_mesh.t].mean(axis=1)
    sides = [((centre[:, skfem_mesh.f2t[k, inner]] - corners.mean(axis=1)) * normal).sum(axis=0) for k in (0, 1)]
    bad[skfem_mesh.f2t[:, inner[sides[0] * sides[1] >= 0]]] = True
    if bad.any():
        raise InputError(
            f"{mesh.who}: mesh={path}: {bad.sum()} of {len(bad)} cells are flat, inside out or folded over a neighbour,"
            f" first cell {np.flatnonzero(bad)[0] + 1} - correct the mesh"
        )


def _make_mesh(who: str, element: ElementName, mesh: Any) -> Mesh:
    if element == "tet10":
        from skfem import MeshTet2

        quadratic = mesh if isinstance(mesh, MeshTet2) else MeshTet2.from_mesh(mesh)
        return Mesh(who, quadratic, Geometry(Element(element), quadratic.dofs.element_dofs.T, quadratic.doflocs.T))
    return Mesh(who, mesh, Geometry(Element(element), np.ascontiguousarray(mesh.t.T), np.ascontiguousarray(mesh.p.T)))
