"""--vtu FILE.vtu: u, lambda and dJ/dp on the mesh, for ParaView."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gradient_routes.bench.store.output_files import Output
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Fields


def write(output: Output, fields: Fields, cloud: tuple[Array, Mapping[str, Array]] | None = None) -> None:
    """Write a VTK unstructured grid; of a cloud, points (k, 3) and fields (k,) are vertices of it. There fields of the
    mesh are nan, and those of the cloud are nan on the mesh.

    Raises RoutesError, and InputError for fields that do not fit the mesh.
    """
    from meshio import Mesh, WriteError

    cell_data = {name: [values] for name, values in fields.cell_data.items()}
    try:
        mesh = Mesh(fields.points, [(fields.cell_type, fields.cells)], dict(fields.point_data), cell_data)
        if cloud is not None:
            mesh = _with(mesh, *cloud)
        with output.open() as file, TemporaryDirectory() as folder:  # meshio writes to names only
            written = Path(folder) / "fields.vtu"
            mesh.write(written)
            file.write(written.read_bytes())
    except (WriteError, ValueError, KeyError) as error:
        raise InputError(f"{output}: fields do not fit the mesh: {error} - correct `Problem.fields`") from error


def _with(mesh: Any, points: Array, data: Mapping[str, Array]) -> Any:
    from meshio import Mesh

    n, k = len(mesh.points), len(points)

    def nothing(values: Array, count: int) -> Array:
        return np.full((count, *np.shape(values)[1:]), np.nan)

    point_data = {name: np.concatenate([values, nothing(values, k)]) for name, values in mesh.point_data.items()}
    point_data |= {name: np.concatenate([nothing(values, n), values]) for name, values in data.items()}
    cell_data = {name: [*blocks, nothing(blocks[0], k)] for name, blocks in mesh.cell_data.items()}
    vertices = ("vertex", np.arange(n, n + k)[:, None])
    return Mesh(np.concatenate([mesh.points, points]), [*mesh.cells, vertices], point_data, cell_data)
