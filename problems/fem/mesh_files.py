"""Meshes of files that meshio reads, of first or second order, with the names that they give."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.units import UNITS
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import MESHIO, Element, ElementName, Geometry
from gradient_routes.problems.fem.mesh import AXES, PLANE_TOLERANCE, Mesh, check_cells
from gradient_routes.problems.fem.mesh_groups import boundaries_of, regions_of
from gradient_routes.problems.fem.seams import check_seams

MESHIO_CELLS: dict[int, dict[str, ElementName]] = {  # by meshio's names, for each dimension
    3: {MESHIO[element][0]: element for element in ("hex8", "tet4", "tet10")},
    2: {MESHIO[element][0]: element for element in ("quad4", "quad8", "tri3", "tri6")},
}
LOWER_DIMENSIONAL = {3: ("vertex", "line", "triangle", "quad"), 2: ("vertex", "line")}  # beginnings of meshio's names
CORNERS = {"quad": 4, "triangle": 3, "hexahedron": 8, "tetra": 4}


def read_mesh(who: str, path: str | Path, unit: str = "m", dim: int = 3) -> Mesh:
    """The hexahedra or tetrahedra of a mesh file that meshio reads, with its named regions and boundaries; dim = 2: the
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
    kind = _kind_of_cells(who, path, found, dim)
    element, cells = MESHIO_CELLS[dim][kind], found.cells_dict[kind]
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
    nodes = cells[:, np.argsort(MESHIO[element][1])]
    nodes, regions = regions_of(found, dim, nodes, f"{who}: mesh={path}")
    own = from_meshio(_corners(found, kind))
    skfem_mesh = type(own)(own.p, np.ascontiguousarray(nodes[:, : own.t.shape[0]].T), sort_t=False)
    boundaries = (own.boundaries or {}) | boundaries_of(found, skfem_mesh, f"{who}: mesh={path}")
    skfem_mesh = skfem_mesh.with_boundaries(boundaries).with_subdomains((own.subdomains or {}) | regions)
    mesh = Mesh(who, skfem_mesh, Geometry(Element(element), nodes, np.ascontiguousarray(X[:, :dim])))
    check_cells(mesh, f"mesh={path}", "correct the mesh")
    check_seams(mesh, f"mesh={path}")
    return mesh


def _kind_of_cells(who: str, path: str | Path, found: Any, dim: int) -> str:
    """meshio's name of them. Raises InputError for another dimension, several kinds, and for what no element is for."""
    known = MESHIO_CELLS[dim]
    kinds = [kind for kind in found.cells_dict if not kind.startswith(LOWER_DIMENSIONAL[dim])]
    if len(kinds) != 1 or kinds[0] not in known:
        has, of = ", ".join(found.cells_dict) or "no cells", max((block.dim for block in found.cells), default=0)
        what = f"has {has}" if of in (0, dim) else f"is of dimension {of} ({has}), not {dim}"
        raise InputError(f"{who}: mesh={path} {what} - it needs cells of one kind out of {', '.join(known)}")
    return str(kinds[0])


def _corners(found: Any, kind: str) -> Any:
    """meshio's mesh of first order, with the names that scikit-fem has written."""
    import meshio

    first = next(name for name in CORNERS if kind.startswith(name))
    own = {name: [np.concatenate(data)] for name, data in found.cell_data.items() if name.startswith("skfem:")}
    return meshio.Mesh(found.points, [(first, found.cells_dict[kind][:, : CORNERS[first]])], cell_data=own)
