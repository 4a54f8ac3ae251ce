"""Isoparametric finite elements with the shape functions of scikit-fem.

    x = sum_a N_a(xi) X_a,     J = dx/dxi,     dN_a/dx = J^-T dN_a/dxi,     n dA = cof(J) n_ref dA_ref  (Nanson)

All metric quantities are functions of the nodal positions X and can be differentiated. xp: numpy or jax.numpy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from gradient_routes.problems.problem import Array

ElementName = Literal["hex8", "tet4", "tet10"]
QUADRATURE = {"hex8": (2, 2), "tet4": (1, 2), "tet10": (2, 4)}  # polynomial orders inside and on facets
NEWTON_TOLERANCE = 1e-12  # of a Newton step in reference coordinates
CONGRUENCE_TOLERANCE = 1e-13  # relative difference of shape function gradients that is attributed to rounding
# meshio's name and node order, for cells with det J > 0 and det J < 0 in scikit-fem's order
MESHIO = {
    "hex8": ("hexahedron", [0, 2, 6, 3, 1, 4, 7, 5], [0, 3, 6, 2, 1, 5, 7, 4]),
    "tet4": ("tetra", [0, 1, 2, 3], [1, 0, 2, 3]),
    "tet10": ("tetra10", [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]),
}


def cofactors(J: Any, xp: Any) -> tuple[Any, Any]:
    """cof(J) = det(J) J^-T and det(J) of matrices (..., 3, 3)."""
    a, b, c = J[..., 0, :], J[..., 1, :], J[..., 2, :]
    cof = xp.stack([xp.cross(b, c), xp.cross(c, a), xp.cross(a, b)], axis=-2)
    return cof, (a * cof[..., 0, :]).sum(-1)


@dataclass(frozen=True)
class Element:
    """A reference element by name."""

    name: ElementName

    @cached_property
    def basis(self) -> Any:
        import skfem

        return {"hex8": skfem.ElementHex1, "tet4": skfem.ElementTetP1, "tet10": skfem.ElementTetP2}[self.name]()

    @cached_property
    def facet_basis(self) -> Any:
        """First-order shape functions on the reference facet, which map it to the sides of the element."""
        import skfem

        return skfem.ElementQuad1() if self.name == "hex8" else skfem.ElementTriP1()

    def shape_functions(self, xi: Array) -> tuple[Array, Array]:
        """N (..., n_a) and dN/dxi (..., n_a, 3) at reference points xi (3, ...)."""
        pairs = [self.basis.lbasis(xi, a) for a in range(self.basis.doflocs.shape[0])]
        N = np.stack([np.broadcast_to(N, xi.shape[1:]) for N, _ in pairs], axis=-1)
        dN = np.stack([np.stack([np.broadcast_to(d, xi.shape[1:]) for d in dN], axis=-1) for _, dN in pairs], axis=-2)
        return N, dN

    def quadrature(self, facets: bool = False) -> tuple[Array, Array]:
        """Reference points (d, n_q) and weights (n_q,) inside the element or on its facets."""
        from skfem.quadrature import get_quadrature

        domain = self.basis.refdom.brefdom if facets else self.basis.refdom
        xi, w = get_quadrature(domain, QUADRATURE[self.name][facets])
        return np.asarray(xi), np.asarray(w)

    def outside(self, xi: Array) -> Array:
        """Distance (...,) of xi (..., 3) outside the reference element, in reference coordinates; negative inside."""
        below = -xi.min(axis=-1)
        return np.asarray(np.maximum(below, xi.max(axis=-1) - 1.0 if self.name == "hex8" else xi.sum(axis=-1) - 1.0))

    def on_side(self, side: int, s: Array) -> tuple[Array, Array]:
        """Points s (2, n_q) of the reference facet on a side: xi (3, n_q), outward d xi_1 x d xi_2 (n_q, 3)."""
        domain = self.basis.refdom
        corners = np.asarray(domain.p)[:, domain.facets[side]]  # (3, corners)
        pairs = [self.facet_basis.lbasis(s, k) for k in range(corners.shape[1])]
        xi = sum(
            np.multiply.outer(v, np.broadcast_to(N, s.shape[1:])) for v, (N, _) in zip(corners.T, pairs, strict=True)
        )
        along = [
            sum(
                np.multiply.outer(np.broadcast_to(dN[i], s.shape[1:]), v)
                for v, (_, dN) in zip(corners.T, pairs, strict=True)
            )
            for i in (0, 1)
        ]
        normal = np.cross(*along)
        outward = normal @ (corners.mean(axis=1) - np.asarray(domain.p).mean(axis=1))
        return np.asarray(xi), normal * np.sign(outward)[:, None]


@dataclass(frozen=True, eq=False)
class Geometry:
    """Cells of one element type: nodes (n_e, n_a) of every cell, nodal positions X (n_nodes, 3) [m]."""

    element: Element
    nodes: Array
    X: Array

    @cached_property
    def _reference(self) -> tuple[Array, Array]:
        xi, w = self.element.quadrature()
        return self.element.shape_functions(xi)[1], w  # (n_q, n_a, 3), (n_q,)

    @cached_property
    def orientation(self) -> Array:
        """(n_e, 1), the sign of det J, which depends on the numbering of the nodes."""
        return np.asarray(np.sign(self._volumes(self.X, np)[2][:, :1]))

    def _volumes(self, X: Any, xp: Any) -> tuple[Any, Any, Any]:
        dN_ref, w = self._reference
        cof, det = cofactors(xp.einsum("eai,qaj->eqij", X[self.nodes], dN_ref), xp)
        return cof, det, w * det

    def determinants(self) -> Array:
        """det J (n_e, n_a) at the nodes of the cells."""
        _, dN = self.element.shape_functions(self.element.basis.doflocs.T)
        return np.asarray(cofactors(np.einsum("eai,qaj->eqij", self.X[self.nodes], dN), np)[1])

    def at(self, X: Any, xp: Any) -> tuple[Any, Any]:
        """dN (n_e, n_q, n_a, 3) [1/m] and dx (n_e, n_q) [m^3] for nodes at X."""
        cof, det, w_det = self._volumes(X, xp)
        dN = xp.einsum("qaj,eqij->eqai", self._reference[0], cof) / det[..., None, None]
        return dN, w_det * self.orientation

    @cached_property
    def metric(self) -> tuple[Array, Array]:
        """dN, dx at X; dN (1, n_q, n_a, 3) if all cells are congruent up to rounding."""
        dN, dx = self.at(self.X, np)
        congruent = np.abs(dN - dN[:1]).max() <= CONGRUENCE_TOLERANCE * np.abs(dN).max()
        return (dN[:1] if congruent else dN), dx

    @cached_property
    def centres(self) -> Array:
        """(n_e, 3) [m], the means of the cells' nodes."""
        return np.asarray(self.X[self.nodes].mean(axis=1))

    @cached_property
    def parts(self) -> Array:
        """(n_nodes,), the connected component of each node; -1 for nodes of no cell."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        n = len(self.X)
        a, b = np.repeat(self.nodes[:, 0], self.nodes.shape[1] - 1), self.nodes[:, 1:].ravel()
        used = np.unique(self.nodes)
        labels = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)[1]
        parts = np.full(n, -1)
        parts[used] = np.unique(labels[used], return_inverse=True)[1]
        return parts

    def for_meshio(self) -> tuple[str, Array]:
        """meshio's name of the cell type and the nodes (n_e, n_a) in its order, with positive orientation."""
        name, positive, negative = MESHIO[self.element.name]
        return name, np.where(self.orientation > 0, self.nodes[:, positive], self.nodes[:, negative])

    def locate(self, x: Array) -> tuple[Array, Array, Array]:
        """Cell (m,) and reference coordinates (m, 3) of points x (m, 3), and their distance outside the cell (m,)."""
        X = self.X[self.nodes]
        low, high = X.min(axis=1), X.max(axis=1)
        margin = 0.1 * (high - low).max(axis=1, keepdims=True)  # sides may be curved
        found = [
            self._locate(x_i, X, np.flatnonzero(((low - margin <= x_i) & (x_i <= high + margin)).all(axis=1)))
            for x_i in x
        ]
        cells, xi, outside = zip(*found, strict=True)
        return np.array(cells), np.array(xi), np.array(outside)

    def _locate(self, x: Array, X: Array, cells: Array) -> tuple[int, Array, float]:
        """The same for one point among candidate cells, by Newton's method for x = sum_a N_a(xi) X_a."""
        if not cells.size:  # outside the mesh: measure the distance to the nearest cell
            cells = np.array([np.linalg.norm(self.centres - x, axis=1).argmin()])
        X, xi = X[cells], np.full((len(cells), 3), 0.25)
        for _ in range(20):
            N, dN = self.element.shape_functions(xi.T)
            r = np.einsum("ka,kai->ki", N, X) - x
            cof, det = cofactors(np.einsum("kai,kaj->kij", X, dN), np)
            before = xi
            # clipped, as the map may fold far outside the cell
            xi = np.clip(xi - np.einsum("kij,ki->kj", cof, r) / det[:, None], -4.0, 5.0)
            if np.abs(xi - before).max() <= NEWTON_TOLERANCE:  # after two steps if all maps are affine
                break
        reached = np.abs(r).max(axis=1) <= 1e-9 * np.ptp(X, axis=1).max(axis=1)
        outside = np.where(reached, self.element.outside(xi), np.inf)
        best = int(outside.argmin())
        return int(cells[best]), xi[best], float(outside[best])


@dataclass(frozen=True, eq=False)
class Facets:
    """Sides of cells, with quadrature points.

    cells, sides (n_f,)   the cell of each facet, and the number of the side
    N (n_f, n_q, n_a)     shape functions of that cell at the points, dN (n_f, n_q, n_a, 3) by reference coordinates
    n_ref (n_f, n_q, 3)   outward normal of the reference side times its weight
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
        """Outward n dA (n_f, n_q, 3) [m^2] for nodes of the facets' cells at x (n_f, n_a, 3), deformed or not."""
        cof, _ = cofactors(xp.einsum("fai,fqaj->fqij", x, self.dN), xp)
        orientation = self.geometry.orientation[self.cells][..., None]
        return xp.einsum("fqij,fqj->fqi", cof, self.n_ref) * orientation

    @cached_property
    def centres(self) -> Array:
        """(n_f, 3) [m]."""
        return np.asarray(np.einsum("fqa,fai->fqi", self.N, self.geometry.X[self.nodes]).mean(axis=1))

    def areas(self, X: Any, xp: Any) -> Any:
        """dA (n_f, n_q) [m^2] for nodes at X (n_nodes, 3)."""
        return xp.sqrt((self.normals(X[self.nodes], xp) ** 2).sum(-1))
