"""Conduction in a rectangle of congruent cells that loses heat through its sides, per metre of depth:

(v, rho c T') + (grad v, k grad T) + <v, h (T - T_inf)> = (v, f),    the first term lumped
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.fem.numbering import Numbering
from gradient_routes.problems.fem.plane_meshes import rectangle_mesh
from gradient_routes.problems.heat.unknowns import Parts
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.sparse import SymmetricPattern, SymmetricSparse
from gradient_routes.problems.problem import Array, Fields

AROUND = ("bottom", "right", "top", "left")
EDGE = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0  # (v, u) on an edge of length 1


@dataclass(frozen=True, eq=False)
class Conducting:
    """The mesh, and which of its nodes are free (n_nodes,); T is given at the others.

    D (4, 4), m (4,)  of (grad v, grad u) and (v, 1) in a cell
    cells, edges      their degrees of freedom; the edges are those that lose heat, of lengths l (n_f,)
    cell_part (n_e,), edge_part (n_f,)  the part that each belongs to
    parts             of coefficients of cells
    sides             parts of film coefficients
    volume (n,)       of each free node, lumped [m2]
    """

    mesh: Mesh
    free: Array
    D: Array
    m: Array
    cells: Numbering
    edges: Numbering
    l: Array
    cell_part: Array
    edge_part: Array
    parts: Parts
    sides: Parts
    volume: Array
    pattern: SymmetricPattern

    @classmethod
    def of(
        cls, count: tuple[int, int], size: tuple[float, float], given: bool, exposed: Sequence[str], parts: int
    ) -> Conducting:
        """`given`: T is, at x = 0; `exposed`: sides that lose heat; `parts`: along every edge."""
        from skfem import Basis, BilinearForm, ElementQuad1, LinearForm
        from skfem.helpers import dot, grad

        mesh = rectangle_mesh("heat", "quad4", count, size)
        X, nodes, skfem_mesh = mesh.geometry.X, mesh.geometry.nodes, mesh.skfem_mesh
        cell = Basis(skfem_mesh, ElementQuad1(), elements=np.array([0]))
        D = BilinearForm(lambda u, v, _: dot(grad(v), grad(u))).elemental(cell).tolocal()[0]
        m = LinearForm(lambda v, _: 1.0 * v).elemental(cell).tolocal()[0]
        free = X[:, 0] > 0.0 if given else np.ones(len(X), dtype=bool)
        grid = (parts, parts if count[1] > 1 else 1)
        i, j = (mesh.normalized(X[nodes].mean(axis=1)) * grid).astype(int).T
        whole, cell_part = Parts.grid(grid), i * grid[1] + j
        ends = skfem_mesh.facets[:, skfem_mesh.boundary_facets()].T
        s = _around(mesh.normalized(X[ends].mean(axis=1)))
        loses = np.isin(s.astype(int), [AROUND.index(side) for side in exposed])
        ends, s = ends[loses], s[loses]
        sides, edge_part = _sides(s, exposed, grid)
        cells, edges, n = Numbering.of(nodes, free), Numbering.of(ends, free), int(free.sum())
        padded = (np.pad(dofs, ((0, 0), (0, 4 - k)), constant_values=-1)
                  for dofs, k in ((cells.dofs, 4), (edges.dofs, 2), (np.arange(n)[:, None], 1)))  # fmt: skip
        return cls(
            mesh, free, D, m, cells, edges, np.linalg.norm(X[ends[:, 1]] - X[ends[:, 0]], axis=1),
            cell_part, edge_part, whole, sides, cells.scatter(np.broadcast_to(m, nodes.shape)),
            SymmetricPattern.of_elements(np.concatenate([*padded]), n),
        )  # fmt: skip

    def balance(self, u: Any, given: float, k: Any, h: Any, f: Any, xp: Any = np) -> Any:
        """Heat that leaves each free node (n,) [W/m], of u = T - T_inf, and k, f (n_e,), h (n_f,)."""
        conducted = k[:, None] * (self.cells.gather(u, xp, given) @ self.D) - f[:, None] * self.m
        lost = (h * self.l)[:, None] * (self.edges.gather(u, xp, given) @ EDGE)
        return self.cells.scatter(conducted, xp) + self.edges.scatter(lost, xp)

    def matrix(self, k: Array, h: Array, stored: float) -> SymmetricSparse:
        """Of conduction and losses, and `stored` [J/m3/K/s] times the volumes on the diagonal."""
        i, j = np.triu_indices(4)
        edge = np.pad(EDGE, (0, 2))[i, j]
        single = (i + j == 0).astype(float)
        weights = k[:, None] * self.D[i, j], (h * self.l)[:, None] * edge, (stored * self.volume)[:, None] * single
        return self.pattern.assemble(np.concatenate(weights))

    def fields(self, T: Array, given: float, of_parts: dict[str, Array]) -> Fields:
        """T (n,) [K] of free nodes and `given` at the others; values of parts, by name, per cell."""
        X, (cell_type, cells) = self.mesh.geometry.X, self.mesh.geometry.for_meshio()
        nodal = np.full(len(X), given)
        nodal[self.free] = T
        by_cell = {name: values[self.cell_part] for name, values in of_parts.items()}
        return Fields(np.pad(X, ((0, 0), (0, 1))), cell_type, cells, {"T": nodal}, by_cell)

    def by(self, name: str, u: Array, given: float) -> ByProducts:
        """Derivatives of `balance` by k, f or h of the parts, (n, parts)."""
        if name == "film":
            by_e = self.l[:, None] * (self.edges.gather(u, given=given) @ EDGE)
            return self.edges.products(by_e, self.edge_part, len(self.sides.x))
        by_e = self.cells.gather(u, given=given) @ self.D
        if name == "source":
            by_e = np.broadcast_to(-self.m, by_e.shape)
        return self.cells.products(by_e, self.cell_part, len(self.parts.x))


def _around(x: Array) -> Array:
    """Where points of the boundary lie on the way round the unit square, from 0 to 4, one for each side."""
    X, Y = x.T
    ways = np.select([Y == 0.0, X == 1.0, Y == 1.0], [X, 1.0 + Y, 3.0 - X], 4.0 - Y)
    return np.asarray(ways)


def _sides(s: Array, exposed: Sequence[str], grid: tuple[int, int]) -> tuple[Parts, Array]:
    """The parts of these sides, one for all where the grid is one, and that of each edge at s (n_f,)."""
    if max(grid) == 1 or not len(s):
        return Parts.grid((1, 1)), np.zeros(len(s), dtype=int)
    count = np.array(grid)[[0, 1, 0, 1]]  # of every side
    side, i = np.array([(k, i) for k in range(4) if AROUND[k] in exposed for i in range(count[k])]).T
    of_edge = s.astype(int)
    at = (s % 1.0 * count[of_edge]).astype(int)
    edge_part = np.searchsorted(side * max(grid) + i, of_edge * max(grid) + at)
    t, zero, one = (i + 0.5) / count[side], np.zeros(len(i)), np.ones(len(i))
    following = np.roll(np.arange(len(i)), -1)
    touch = (side[following] - side) % 4 <= 1
    touch[-1] &= side[0] != side[-1]
    x = np.stack([np.choose(side, [t, one, 1.0 - t, zero]), np.choose(side, [zero, t, one, 1.0 - t])], axis=1)
    return Parts(x, np.stack([following, np.arange(len(i))], axis=1)[touch]), edge_part
