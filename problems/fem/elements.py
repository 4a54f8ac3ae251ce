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

SolidElement = Literal["hex8", "tet4", "tet10"]
PlaneElement = Literal["quad4", "quad8", "tri3", "tri6"]
ElementName = SolidElement | PlaneElement
# scikit-fem's shape functions, those that map the reference facet to the sides, polynomial orders inside and on facets
ELEMENTS: dict[ElementName, tuple[str, str, tuple[int, int]]] = {
    "hex8": ("ElementHex1", "ElementQuad1", (2, 2)),
    "tet4": ("ElementTetP1", "ElementTriP1", (1, 2)),
    "tet10": ("ElementTetP2", "ElementTriP1", (2, 4)),
    "quad4": ("ElementQuad1", "ElementLineP1", (2, 2)),
    "quad8": ("ElementQuadS2", "ElementLineP1", (4, 4)),
    "tri3": ("ElementTriP1", "ElementLineP1", (1, 2)),
    "tri6": ("ElementTriP2", "ElementLineP1", (2, 4)),
}
BRICKS = ("hex8", "quad4", "quad8")  # their reference element is the unit cube or square, else a simplex
CONGRUENCE_TOLERANCE = 1e-13  # relative difference of shape function gradients that is attributed to rounding
# meshio's name and node order, for cells with det J > 0 and det J < 0 in scikit-fem's order
MESHIO: dict[ElementName, tuple[str, list[int], list[int]]] = {
    "hex8": ("hexahedron", [0, 2, 6, 3, 1, 4, 7, 5], [0, 3, 6, 2, 1, 5, 7, 4]),
    "tet4": ("tetra", [0, 1, 2, 3], [1, 0, 2, 3]),
    "tet10": ("tetra10", [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]),
    "quad4": ("quad", [0, 1, 2, 3], [0, 3, 2, 1]),
    "quad8": ("quad8", [0, 1, 2, 3, 4, 5, 6, 7], [0, 3, 2, 1, 7, 6, 5, 4]),
    "tri3": ("triangle", [0, 1, 2], [1, 0, 2]),
    "tri6": ("triangle6", [0, 1, 2, 3, 4, 5], [1, 0, 2, 3, 5, 4]),
}


def cofactors(J: Any, xp: Any) -> tuple[Any, Any]:
    """cof(J) = det(J) J^-T and det(J) of matrices (..., d, d), d = 2 or 3."""
    if J.shape[-1] == 2:
        cof = xp.stack([J[..., 1, ::-1], J[..., 0, ::-1]], axis=-2) * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return cof, (J[..., 0, :] * cof[..., 0, :]).sum(-1)
    j, k = np.array([1, 2, 0]), np.array([2, 0, 1])  # the two that follow 0, 1, 2
    rows_j, rows_k = j[:, None], k[:, None]
    cof = J[..., rows_j, j] * J[..., rows_k, k] - J[..., rows_j, k] * J[..., rows_k, j]
    return cof, (J[..., 0, :] * cof[..., 0, :]).sum(-1)


@dataclass(frozen=True)
class Element:
    """A reference element by name."""

    name: ElementName

    @cached_property
    def basis(self) -> Any:
        import skfem

        return getattr(skfem, ELEMENTS[self.name][0])()

    @cached_property
    def facet_basis(self) -> Any:
        """First-order shape functions on the reference facet, which map it to the sides of the element."""
        import skfem

        return getattr(skfem, ELEMENTS[self.name][1])()

    def shape_functions(self, xi: Array) -> tuple[Array, Array]:
        """N (..., n_a) and dN/dxi (..., n_a, d) at reference points xi (d, ...)."""
        pairs = [self.basis.lbasis(xi, a) for a in range(self.basis.doflocs.shape[0])]
        N = np.stack([np.broadcast_to(N, xi.shape[1:]) for N, _ in pairs], axis=-1)
        dN = np.stack([np.stack([np.broadcast_to(d, xi.shape[1:]) for d in dN], axis=-1) for _, dN in pairs], axis=-2)
        return N, dN

    def quadrature(self, facets: bool = False) -> tuple[Array, Array]:
        """Reference points (d, n_q) and weights (n_q,) inside the element or on its facets."""
        from skfem.quadrature import get_quadrature

        domain = self.basis.refdom.brefdom if facets else self.basis.refdom
        xi, w = get_quadrature(domain, ELEMENTS[self.name][2][facets])
        return np.asarray(xi), np.asarray(w)

    def outside(self, xi: Array) -> Array:
        """Distance (...,) of xi (..., d) outside the reference element, in reference coordinates; negative inside."""
        below = -xi.min(axis=-1)
        return np.asarray(np.maximum(below, xi.max(axis=-1) - 1.0 if self.name in BRICKS else xi.sum(axis=-1) - 1.0))

    def nearest(self, xi: Array) -> Array:
        """Points (..., d) of the reference element near xi (..., d); xi itself inside."""
        above = np.maximum(xi, 0.0)
        if self.name in BRICKS:
            return np.minimum(above, 1.0)
        return np.asarray(above / np.maximum(above.sum(axis=-1, keepdims=True), 1.0))

    def on_side(self, side: int, s: Array) -> tuple[Array, Array]:
        """Points s (d - 1, n_q) of the reference facet on a side: xi (d, n_q), and outward normals (n_q, d)
        d xi_1 x d xi_2, in a plane d xi turned by 90 degrees.
        """
        domain = self.basis.refdom
        corners = np.asarray(domain.p)[:, domain.facets[side]]  # (d, corners)
        pairs = [self.facet_basis.lbasis(s, k) for k in range(corners.shape[1])]
        xi = sum(
            np.multiply.outer(v, np.broadcast_to(N, s.shape[1:])) for v, (N, _) in zip(corners.T, pairs, strict=True)
        )
        along = [
            sum(
                np.multiply.outer(np.broadcast_to(dN[i], s.shape[1:]), v)
                for v, (_, dN) in zip(corners.T, pairs, strict=True)
            )
            for i in range(len(s))
        ]
        normal = np.cross(*along) if len(s) == 2 else along[0][:, ::-1] * [1.0, -1.0]
        outward = normal @ (corners.mean(axis=1) - np.asarray(domain.p).mean(axis=1))
        return np.asarray(xi), normal * np.sign(outward)[:, None]


@dataclass(frozen=True, eq=False)
class Geometry:
    """Cells of one element type: nodes (n_e, n_a) of every cell, nodal positions X (n_nodes, d) [m].

    d = 3, or 2 for a body of constant `thickness` [m], 1 for a solid, or an `axisymmetric` one that turns about x = 0.
    """

    element: Element
    nodes: Array
    X: Array
    thickness: float = 1.0
    axisymmetric: bool = False

    @property
    def dim(self) -> int:
        return int(self.X.shape[1])

    @cached_property
    def _reference(self) -> tuple[Array, Array, Array]:
        xi, w = self.element.quadrature()
        return *self.element.shape_functions(xi), w  # (n_q, n_a), (n_q, n_a, d), (n_q,)

    @cached_property
    def orientation(self) -> Array:
        """(n_e, 1), the sign of det J, which depends on the numbering of the nodes."""
        return np.asarray(np.sign(self._volumes(self.X, np)[2][:, :1]))

    def _volumes(self, X: Any, xp: Any) -> tuple[Any, Any, Any]:
        _, dN_ref, w = self._reference
        cof, det = cofactors(xp.einsum("eai,qaj->eqij", X[self.nodes], dN_ref), xp)
        return cof, det, w * det

    def determinants(self) -> Array:
        """det J (n_e, n_a) at the nodes of the cells."""
        _, dN = self.element.shape_functions(self.element.basis.doflocs.T)
        return np.asarray(cofactors(np.einsum("eai,qaj->eqij", self.X[self.nodes], dN), np)[1])

    def at(self, X: Any, xp: Any) -> tuple[Any, Any]:
        """dN (n_e, n_q, n_a, m) [1/m] and dx (n_e, n_q) [m^3] for nodes at X.

        m = d; with a third column N_a/r for an axisymmetric body, so that sum_a u_a dN_a has the hoop strain u_r/r.
        """
        (N, dN_ref, _), (cof, det, w_det) = self._reference, self._volumes(X, xp)
        dN = xp.einsum("qaj,eqij->eqai", dN_ref, cof) / det[..., None, None]
        if self.axisymmetric:
            dN = xp.concatenate([dN, (N / self._radius(X[self.nodes], N, xp)[..., None])[..., None]], axis=-1)
        return dN, w_det * self.orientation * self.depth(X[self.nodes], N, xp)

    def depth(self, x: Any, N: Array, xp: Any) -> Any:
        """Thickness or circumference [m] at points with the shape functions N (..., n_q, n_a), for nodes at x."""
        return 2.0 * np.pi * self._radius(x, N, xp) if self.axisymmetric else self.thickness

    @staticmethod
    def _radius(x: Any, N: Array, xp: Any) -> Any:
        return xp.einsum("...qa,...a->...q", N, x[..., 0])

    @cached_property
    def cell_size(self) -> float:
        """The root of the cells' mean volume, or area [m]."""
        volume = float(np.abs(self._volumes(self.X, np)[2]).sum())
        return float((volume / len(self.nodes)) ** (1.0 / self.dim))

    @cached_property
    def metric(self) -> tuple[Array, Array]:
        """dN, dx at X; dN (1, n_q, n_a, m) if all cells are congruent up to rounding."""
        dN, dx = self.at(self.X, np)
        congruent = np.abs(dN - dN[:1]).max() <= CONGRUENCE_TOLERANCE * np.abs(dN).max()
        return (dN[:1] if congruent else dN), dx

    @cached_property
    def centres(self) -> Array:
        """(n_e, d) [m], the means of the cells' nodes."""
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
