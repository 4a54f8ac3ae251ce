"""Built-in meshes of plane bodies: a rectangle, and a rectangle with a circular hole, or a quarter of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.problems.fem.elements import BRICKS, PlaneElement
from gradient_routes.problems.fem.mesh import Mesh, check_cells, make_mesh
from gradient_routes.problems.problem import Array


def rectangle_mesh(
    who: str, element: PlaneElement, cells: tuple[int, int], size: tuple[float, float], left: float = 0.0
) -> Mesh:
    """cells[0] x cells[1] rectangles from (left, 0), each split in two if the element is a triangle."""
    from skfem import MeshQuad

    x, y = np.linspace(left, left + size[0], cells[0] + 1), np.linspace(0.0, size[1], cells[1] + 1)
    return make_mesh(who, element, _split(MeshQuad.init_tensor(x, y), element))


def hole_mesh(
    who: str,
    element: PlaneElement,
    cells: tuple[int, int],
    layers: int,
    size: tuple[float, float],
    radius: float,
    quarter: bool,
) -> Mesh:
    """A rectangle from (0, 0) with the hole of this radius [m] in its middle; its boundary is named `hole`.

    cells (even) along the edges, `layers` of them from the hole outwards, in geometric progression. quarter: the hole
    is about (0, 0), and the rectangle, with half the cells along its edges, a quarter of a plate.

    Raises InputError where the cells are too coarse for the hole.
    """
    from skfem import MeshQuad

    half = np.array(size) if quarter else np.array(size) / 2.0
    table = _table(np.array(cells) // 2, layers, half, radius, quarter) + (0.0 if quarter else half)
    p = table[::2, ::2]
    number = np.arange(p[..., 0].size).reshape(p.shape[:2])
    here, following = (number[:, :-1], number[:, 1:]) if quarter else (number, np.roll(number, -1, axis=1))
    t = np.stack([here[:-1], here[1:], following[1:], following[:-1]]).reshape(4, -1)
    skfem_mesh = _split(MeshQuad(np.ascontiguousarray(p.reshape(-1, 2).T), t), element)
    layer, ray = np.divmod(skfem_mesh.facets, p.shape[1])
    on_hole = np.intersect1d(np.flatnonzero((layer == 0).all(axis=0)), skfem_mesh.boundary_facets())
    mesh = make_mesh(who, element, skfem_mesh.with_boundaries({"hole": on_hole}))
    middle = np.where(np.ptp(ray, axis=0) > 1, -1, ray.sum(axis=0))  # between the last and the first
    X = np.concatenate([p.reshape(-1, 2), table[layer.sum(axis=0), middle]])[: len(mesh.geometry.X)]
    mesh = replace(mesh, geometry=replace(mesh.geometry, X=X))
    check_cells(mesh, f"radius={radius:g}", "take more cells or a smaller hole")
    return mesh


def _table(half_cells: Array, layers: int, half: Array, radius: float, quarter: bool) -> Array:
    """Positions (2 layers + 1, 2 m or 2 m + 1, 2) about the hole, those of corners of cells in even rows and columns.

    Rays go from equal angles on the hole to the corners and equal parts of the edges.
    """
    turn = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]])
    counts = 2 * half_cells[[1, 0, 0, 1] * 2]  # parts of the eight legs from the middle of an edge to a corner
    steps = [(leg, k / counts[leg]) for leg in range(2 if quarter else 8) for k in range(counts[leg])]
    steps += [(1, 1.0)] if quarter else []
    outer = half * np.array([(1.0 - s) * turn[leg] + s * turn[leg + 1] for leg, s in steps])
    angle = np.array([leg + s for leg, s in steps]) * np.pi / 4.0
    inner = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ratio = float(half.min() / radius)
    at_corners = (ratio ** np.linspace(0.0, 1.0, layers + 1) - 1.0) / (ratio - 1.0)
    grading = np.interp(np.arange(2 * layers + 1) / 2.0, np.arange(layers + 1), at_corners)
    return np.asarray(inner + grading[:, None, None] * (outer - inner))


def _split(rectangles: Any, element: PlaneElement) -> Any:
    return rectangles if element in BRICKS else rectangles.to_meshtri()
