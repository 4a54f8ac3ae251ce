"""--vtu FILE.vtu: u, lambda and dJ/dp on the mesh, for ParaView."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from gradient_routes.bench.store.output_files import Output
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Fields


def write(output: Output, fields: Fields) -> None:
    """Write a VTK unstructured grid. Raises RoutesError, and InputError for fields that do not fit the mesh."""
    from meshio import Mesh, WriteError

    cell_data = {name: [values] for name, values in fields.cell_data.items()}
    try:
        mesh = Mesh(fields.points, [(fields.cell_type, fields.cells)], dict(fields.point_data), cell_data)
        with output.open() as file, TemporaryDirectory() as folder:  # meshio writes to names only
            written = Path(folder) / "fields.vtu"
            mesh.write(written)
            file.write(written.read_bytes())
    except (WriteError, ValueError, KeyError) as error:
        raise InputError(f"{output}: fields do not fit the mesh: {error} - correct `Problem.fields`") from error
