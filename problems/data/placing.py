"""Measured points in the cells of a mesh; those outside are refused, dropped or moved onto it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.locating import PAIRS, locate
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.problem import Array

Outside = Literal["refuse", "drop", "snap"]
OUTSIDE_TOLERANCE = 1e-3  # of the diameter: distance outside the mesh that is attributed to rounded coordinates
FACTORS = {
    1e3: "in mm beside a mesh in m",
    1e6: "in um beside a mesh in m",
    1e-3: "in m beside a mesh in mm (mesh_unit=mm)",
}


@dataclass(frozen=True)
class Placed:
    """rows (m,) that are kept, points x (m, d) [m], nodes (m, k) of their cells, coordinates xi (m, d) in these, shape
    functions N (m, k), notes.
    """

    rows: Array
    x: Array
    nodes: Array
    xi: Array
    N: Array
    said: tuple[str, ...]


def place(mesh: Mesh, x: Array, path: str | Path, outside: Outside = "refuse") -> Placed:
    """Place points x (m, d). Raises InputError for points outside the body, with counts and the largest distance."""
    geometry, found = mesh.geometry, locate(mesh.geometry, x)
    out = found.distance > OUTSIDE_TOLERANCE * mesh.diameter
    unit = _likely_unit(mesh, x)
    rows, xi, said = np.arange(len(x)), found.xi, [f"the points are {unit}?"] if unit and len(x) > 1 else []
    if out.any():
        lie = f"{out.sum()} of {len(x)}"
        if outside == "refuse" or out.all():
            raise InputError(_refusal(mesh, x, np.flatnonzero(out), found.distance, path, unit))
        how = "left out" if outside == "drop" else "moved to the nearest one inside"
        said += [f"{lie} points lie outside {mesh.who}, by up to {found.distance.max():.3g} m, and are {how}"]
        if outside == "drop":
            rows = rows[~out]
        xi[out] = geometry.element.nearest(xi[out])
    cells, xi, x, moved = found.cells[rows], xi[rows], x[rows], out[rows]
    N = np.empty((len(rows), geometry.nodes.shape[1]))
    for k in range(0, len(rows), PAIRS):  # with their derivatives shape functions take four times the memory
        N[k : k + PAIRS] = geometry.element.shape_functions(xi[k : k + PAIRS].T)[0]
    nodes = geometry.nodes[cells]
    if moved.any():
        x[moved] = np.einsum("ka,kai->ki", N[moved], geometry.X[nodes[moved]])
    return Placed(rows, x, nodes, xi, N, tuple(said))


def _likely_unit(mesh: Mesh, x: Array) -> str | None:
    """What explains points that span a thousand times the body, or a thousandth."""
    ratio = float(np.linalg.norm(np.ptp(x, axis=0) if len(x) > 1 else x[0])) / mesh.diameter
    return next((what for factor, what in FACTORS.items() if 0.3 < ratio / factor < 3.0), None)


def _refusal(mesh: Mesh, x: Array, out: Array, distance: Array, path: str | Path, unit: str | None) -> str:
    i, (low, high) = int(out[0]), mesh.bounding_box
    where, span = (", ".join(f"{value:g}" for value in values) for values in (x[i], high - low))
    todo = "check coordinates and units" + (f" ({unit}?)" if unit else "")
    todo += ", or take outside=drop or outside=snap" if len(out) < len(x) else ""
    do = f"{len(out)} of {len(x)} rows do, by up to {distance.max():.3g} m"
    return (
        f"{path}: data row {i + 1} at ({where}) lies outside {mesh.who}, whose box of {span} m begins at"
        f" ({', '.join(f'{v:g}' for v in low)}) ({do}) - {todo}"
    )
