"""Bodies: cells, their nodes, and the parts of their surface by name or by plane; boxes and mesh files."""

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
ON_PLANE = 1e-6  # of the body's size: how near a facet must be
READABLE: dict[str, ElementName] = {"hexahedron": "hex8", "tetra": "tet4", "tetra10": "tet10"}  # meshio's names
FLAT = ("vertex", "line", "triangle", "quad")  # cells without volume: faces and what bounds them


@dataclass(frozen=True, eq=False)
class Body:
    """Cells and named parts of the surface.

    mesh  scikit-fem's, of the cells' vertices; names  facet numbers of the parts a mesh file names
    """

    who: str
    mesh: Any
    geometry: Geometry

    @cached_property
    def box(self) -> Array:
        """(2, 3) [m], its least and greatest coordinates."""
        X = self.geometry.X[np.unique(self.geometry.nodes)]
        return np.stack([X.min(axis=0), X.max(axis=0)])

    @property
    def size(self) -> float:
        """Its diagonal [m]."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    def relative(self, x: Array) -> Array:
        """Points (..., 3) in units of its box: 0 at the least coordinate, 1 at the greatest."""
        return np.asarray((x - self.box[0]) / np.maximum(self.box[1] - self.box[0], 1e-300))

    @cached_property
    def names(self) -> dict[str, Array]:
        return {str(name): np.asarray(facets) for name, facets in (self.mesh.boundaries or {}).items()}

    def surface(self, where: str) -> Facets:
        """The part of the surface that `where` names: top, z=0.5, or a name in the mesh file. Raises InputError."""
        facets = self.names.get(where)
        if facets is None:
            facets = self._on_plane(where)
        if not facets.size:
            raise InputError(f"{self.who}: no facet of the surface lies on {where} - {self._choices()}")
        cells = self.mesh.f2t[0, facets]
        return Facets.of(self.geometry, cells, (self.mesh.t2f[:, cells] == facets).argmax(axis=0))

    def _on_plane(self, where: str) -> Array:
        if where in SIDES:
            axis, end = SIDES[where]
            value = self.box[end, axis]
        else:
            name, _, text = where.partition("=")
            try:
                axis, value = AXES[name.strip()], float(text)
            except (KeyError, ValueError):
                raise InputError(f"{self.who}: no boundary '{where}' - {self._choices()}") from None
        boundary = self.mesh.boundary_facets()
        away = np.abs(self.mesh.p[axis][self.mesh.facets[:, boundary]] - value).max(axis=0)
        return np.asarray(boundary[away <= ON_PLANE * self.size])

    def _choices(self) -> str:
        return f"choose {', '.join([*self.names, *SIDES])} or a plane such as z={self.box[0, 2]:g}"


def box(who: str, element: ElementName, cells: tuple[int, int, int], size: tuple[float, float, float]) -> Body:
    """A box of cells[0] x cells[1] x cells[2] bricks, each split into six where the element is a tetrahedron."""
    from skfem import MeshHex

    mesh: Any = MeshHex.init_tensor(*(np.linspace(0.0, L, n + 1) for L, n in zip(size, cells, strict=True)))
    return _body(who, element, mesh if element == "hex8" else mesh.to_meshtet())


def read(who: str, path: str | Path) -> Body:
    """The hexahedra or tetrahedra of a mesh file meshio reads, with the parts of the surface it names.

    Raises InputError for a file that cannot be read, without cells of volume, or with cells inside out.
    """
    import meshio
    from skfem.io.meshio import from_meshio

    if not Path(path).is_file():
        raise InputError(f"{who}: mesh={path}: no such file - check the path")
    said_aside = io.StringIO()
    try:
        with redirect_stdout(said_aside), redirect_stderr(said_aside):
            found = meshio.read(path)
    except (Exception, SystemExit) as error:  # readers of many formats, each with errors of its own
        said = " ".join(f"{said_aside.getvalue()} {error}".split()) or f"{type(error).__name__}, a broken file?"
        raise InputError(f"{who}: mesh={path} cannot be read ({said}) - give a format meshio knows") from None
    kinds = [kind for kind in found.cells_dict if not kind.startswith(FLAT)]
    if len(kinds) != 1 or kinds[0] not in READABLE:
        has = ", ".join(found.cells_dict) or "no cells"
        raise InputError(f"{who}: mesh={path} has {has} - it needs cells of one kind out of {', '.join(READABLE)}")
    cells = found.cells_dict[kinds[0]]
    if cells.min() < 0 or cells.max() >= len(found.points):
        raise InputError(f"{who}: mesh={path} has cells of points beyond its {len(found.points)} - mend the file")
    if np.shape(found.points)[1:] != (3,):
        raise InputError(
            f"{who}: mesh={path} has points of {np.shape(found.points)[-1]} coordinates - it needs x, y, z"
        )
    # scikit-fem matches facets by their corners only
    corners = {"triangle6": ("triangle", 3), "quad8": ("quad", 4), "quad9": ("quad", 4)}
    for block in found.cells:
        if block.type in corners:
            block.type, n = corners[block.type]
            block.data = block.data[:, :n]
    body = _body(who, READABLE[kinds[0]], from_meshio(found, force_meshio_type=kinds[0], ignore_orientation=True))
    _check_cells(body, path)
    return body


def _check_cells(body: Body, path: str | Path) -> None:
    """Cells must have volume and lie side by side; which way round they are numbered is free."""
    geometry, mesh = body.geometry, body.mesh
    if not np.isfinite(geometry.X).all():
        raise InputError(f"{body.who}: mesh={path} has points that are not finite - mend the file")
    det = geometry.determinants()  # (n_e, n_a), at the nodes
    extent = np.ptp(geometry.X[geometry.nodes], axis=1).max(axis=1)[:, None]
    bad = (np.abs(det) <= 1e-12 * extent**3).any(axis=1) | (np.sign(det) != np.sign(det[:, :1])).any(axis=1)
    inner = np.flatnonzero(mesh.f2t[1] >= 0)
    corners = mesh.p[:, mesh.facets[:, inner]]  # (3, 3 or 4, n_f)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], axis=0)
    centre = mesh.p[:, mesh.t].mean(axis=1)
    sides = [((centre[:, mesh.f2t[k, inner]] - corners.mean(axis=1)) * normal).sum(axis=0) for k in (0, 1)]
    bad[mesh.f2t[:, inner[sides[0] * sides[1] >= 0]]] = True
    if bad.any():
        raise InputError(
            f"{body.who}: mesh={path}: {bad.sum()} of {len(bad)} cells are flat, inside out or folded over a neighbour,"
            f" first cell {np.flatnonzero(bad)[0] + 1} - mend the mesh"
        )


def _body(who: str, element: ElementName, mesh: Any) -> Body:
    if element == "tet10":
        from skfem import MeshTet2

        quadratic = mesh if isinstance(mesh, MeshTet2) else MeshTet2.from_mesh(mesh)
        return Body(who, quadratic, Geometry(Element(element), quadratic.dofs.element_dofs.T, quadratic.doflocs.T))
    return Body(who, mesh, Geometry(Element(element), np.ascontiguousarray(mesh.t.T), np.ascontiguousarray(mesh.p.T)))
