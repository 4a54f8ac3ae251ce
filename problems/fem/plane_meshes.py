"""Built-in meshes of plane bodies: a rectangle, and a rectangle with a circular hole, or a quarter of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.problems.fem.elements import BRICKS, PlaneElement
from gradient_routes.problems.fem.mesh import Mesh, make_mesh
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
    """
    from skfem import MeshQuad

    half = np.array(size) if quarter else np.array(size) / 2.0
    turn = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]])
    corners, counts = turn * half, [cells[1] // 2, cells[0] // 2, cells[0] // 2, cells[1] // 2] * 2
    legs = range(2 if quarter else 8)
    steps = [(leg, k / counts[leg]) for leg in legs for k in range(counts[leg])] + ([(1, 1.0)] if quarter else [])
    outer = np.array([(1.0 - s) * corners[leg] + s * corners[leg + 1] for leg, s in steps])
    angle = np.array([leg + s for leg, s in steps]) * np.pi / 4.0
    inner = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ratio = float(half.min() / radius)
    grading = (ratio ** np.linspace(0.0, 1.0, layers + 1) - 1.0) / (ratio - 1.0)
    centre = np.zeros(2) if quarter else half
    p = centre + inner + grading[:, None, None] * (outer - inner)  # (layers + 1, around, 2)
    number = np.arange(p[..., 0].size).reshape(p.shape[:2])
    here, following = (number[:, :-1], number[:, 1:]) if quarter else (number, np.roll(number, -1, axis=1))
    t = np.stack([here[:-1], here[1:], following[1:], following[:-1]]).reshape(4, -1)

    def on_hole(x: Array) -> Array:
        return np.asarray(np.hypot(*(x.T - centre).T) < (1.0 + 1e-9) * radius)

    skfem_mesh = _split(MeshQuad(np.ascontiguousarray(p.reshape(-1, 2).T), t), element)
    hole = skfem_mesh.facets_satisfying(on_hole, boundaries_only=True)
    mesh = make_mesh(who, element, skfem_mesh.with_boundaries({"hole": hole}))
    X, nodes = mesh.geometry.X.copy(), mesh.boundary("hole").node_set
    r = X[nodes] - centre
    X[nodes] = centre + r * (radius / np.linalg.norm(r, axis=1, keepdims=True))  # those between corners, too
    return replace(mesh, geometry=replace(mesh.geometry, X=X))


def _split(rectangles: Any, element: PlaneElement) -> Any:
    return rectangles if element in BRICKS else rectangles.to_meshtri()
