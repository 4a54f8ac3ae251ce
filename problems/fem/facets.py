"""Facets of the boundary: sides of cells, with quadrature points, normals and areas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.fem.elements import Geometry, cofactors
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class Facets:
    """Sides of cells, with quadrature points.

    cells, sides (n_f,)   the cell of each facet, and the number of the side
    N (n_f, n_q, n_a)     shape functions of that cell at the points, dN (n_f, n_q, n_a, d) by reference coordinates
    n_ref (n_f, n_q, d)   outward normal of the reference side times its weight
    """

    geometry: Geometry
    cells: Array
    sides: Array
    N: Array
    dN: Array
    n_ref: Array

    @classmethod
    def of(cls, geometry: Geometry, cells: Array, sides: Array) -> Facets:
        s, w = geometry.element.quadrature(facets=True)
        kinds, which = np.unique(sides, return_inverse=True)
        N, dN, n_ref = [], [], []
        for side in kinds:
            xi, normal = geometry.element.on_side(int(side), s)
            values, derivatives = geometry.element.shape_functions(xi)
            N.append(values)
            dN.append(derivatives)
            n_ref.append(normal * w[:, None])
        return cls(geometry, cells, sides, np.stack(N)[which], np.stack(dN)[which], np.stack(n_ref)[which])

    @property
    def nodes(self) -> Array:
        """(n_f, n_a), nodes of the facets' cells."""
        return np.asarray(self.geometry.nodes[self.cells])

    @cached_property
    def node_set(self) -> Array:
        """The nodes on the facets."""
        return np.unique(self.nodes[(np.abs(self.N) > 1e-9).any(axis=1)])

    def normals(self, x: Any, xp: Any) -> Any:
        """Outward n dA (n_f, n_q, d) [m^2] for nodes of the facets' cells at x (n_f, n_a, d), deformed or not."""
        cof, _ = cofactors(xp.einsum("fai,fqaj->fqij", x, self.dN), xp)
        measure = self.geometry.orientation[self.cells] * self.geometry.depth(x, self.N, xp)
        return xp.einsum("fqij,fqj->fqi", cof, self.n_ref) * measure[..., None]

    @cached_property
    def centres(self) -> Array:
        """(n_f, d) [m]."""
        return np.asarray(np.einsum("fqa,fai->fqi", self.N, self.geometry.X[self.nodes]).mean(axis=1))

    def areas(self, X: Any, xp: Any) -> Any:
        """dA (n_f, n_q) [m^2] for nodes at X (n_nodes, d); those of the mesh are computed once."""
        return self._areas if X is self.geometry.X else self._areas_at(X, xp)

    @cached_property
    def _areas(self) -> Array:
        return np.asarray(self._areas_at(self.geometry.X, np))

    def _areas_at(self, X: Any, xp: Any) -> Any:
        return xp.sqrt((self.normals(X[self.nodes], xp) ** 2).sum(-1))
