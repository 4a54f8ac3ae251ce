"""--vtu FILE.vtu: u, lambda and dJ/dp on the mesh, for ParaView."""

from __future__ import annotations

from pathlib import Path

from gradient_routes.bench.cases.folder import located
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Fields


def write(path: Path, fields: Fields) -> None:
    """Write a VTK unstructured grid. Raises OSError, and InputError for fields that do not fit the mesh."""
    from meshio import Mesh, WriteError

    cell_data = {name: [values] for name, values in fields.cell_data.items()}
    try:
        mesh = Mesh(fields.points, [(fields.cell_type, fields.cells)], dict(fields.point_data), cell_data)
        mesh.write(located(path), file_format="vtu")
    except (WriteError, ValueError, KeyError) as error:
        raise InputError(f"--vtu {path}: fields do not fit the mesh: {error} - correct `Problem.fields`") from error
