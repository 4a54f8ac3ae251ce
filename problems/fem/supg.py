"""Streamline-upwind Petrov-Galerkin on a mesh of squares (Brooks & Hughes 1982): test functions v + tau b . grad v.

    b . grad u - div(kappa grad u) = f        u = 0 where b . n < 0,  kappa du/dn = 0 elsewhere
    (grad v, kappa grad u) + (v, b . grad u - f) + sum over cells of tau (b . grad v, b . grad u - f) = 0

The stabilization is consistent: in a square cell div(kappa grad u) of a bilinear u is 0 for constant kappa.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.problems.fem.numbering import Numbering
from gradient_routes.problems.matrices.sparse import GeneralPattern, GeneralSparse
from gradient_routes.problems.problem import Array

TANGENTIAL = 1e-12  # |b . n| / |b| below which the flow is along a side: sin(pi) is not 0 in float64


@dataclass(frozen=True, eq=False)
class Supg:
    """The discretization on n x n cells of the unit square; the cells are congruent and share their element matrices.

    mesh, free (n_u,)  scikit-fem's mesh, and its nodes that carry degrees of freedom
    b (2,)             the flow, |b| = 1 m/s
    h                  length of a cell along b [m]
    D, C, S, M (4, 4)  of (grad v, grad u), (v, b . grad u), (b . grad v, b . grad u), (v, u)
    m, s (4,)          of (v, 1), (b . grad v, 1)
    cells              degrees of freedom at their corners, -1 at the inflow
    """

    mesh: Any
    free: Array
    b: Array
    h: float
    D: Array
    C: Array
    S: Array
    M: Array
    m: Array
    s: Array
    cells: Numbering
    pattern: GeneralPattern

    @classmethod
    def of(cls, n: int, b: Array, nodal: bool = False) -> Supg:
        """`nodal`: integrate by the values at the corners of a cell, in place of a rule that is exact."""
        from skfem import Basis, BilinearForm, ElementQuad1, LinearForm, MeshQuad
        from skfem.helpers import dot, grad

        mesh = MeshQuad.init_tensor(*[np.linspace(0.0, 1.0, n + 1)] * 2)
        corners = (np.array([[0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0]]), np.full(4, 0.25)) if nodal else None
        cell = Basis(mesh, ElementQuad1(), elements=np.array([0]), quadrature=corners)

        def along(v: Any) -> Any:
            return b[0] * grad(v)[0] + b[1] * grad(v)[1]

        bilinear = (
            lambda u, v, _: dot(grad(v), grad(u)),
            lambda u, v, _: v * along(u),
            lambda u, v, _: along(v) * along(u),
            lambda u, v, _: v * u,
        )
        linear = (lambda v, _: 1.0 * v, lambda v, _: along(v))
        D, C, S, M = (
            BilinearForm(form).elemental(cell).tolocal()[0].T for form in bilinear
        )  # scikit-fem stores columns first
        m, s = (LinearForm(form).elemental(cell).tolocal()[0] for form in linear)
        free = ~on_inflow(mesh.p.T, b)
        cells = Numbering.of(mesh.t.T, free)
        return cls(
            mesh=mesh,
            free=np.flatnonzero(free),
            b=b,
            h=1.0 / (n * float(np.abs(b).max())),
            D=D, C=C, S=S, M=M, m=m, s=s,
            cells=cells,
            pattern=GeneralPattern.of_elements(cells.dofs, int(free.sum())),
        )  # fmt: skip

    @property
    def x(self) -> Array:
        """Positions (n_u, 2) [m] of the degrees of freedom."""
        return np.asarray(self.mesh.p.T[self.free])

    @property
    def centres(self) -> Array:
        """Cell centres (n_e, 2) [m]."""
        return np.asarray(self.mesh.p.T[self.mesh.t.T].mean(axis=1))

    def tau(self, kappa: Any) -> Any:
        """tau [s], with the limits h/2 and h^2 / (12 kappa) (Shakib, Hughes & Johan 1991)."""
        h = self.h
        return ((2.0 / h) ** 2 + 9.0 * (4.0 * kappa / h**2) ** 2) ** -0.5

    def tau_kappa(self, kappa: Any) -> Any:
        """dtau/dkappa."""
        return -144.0 * kappa / self.h**4 * self.tau(kappa) ** 3

    def residual(self, u: Any, kappa: Any, f: Any, xp: Any = np) -> Any:
        """R (n_u,), for kappa (n_e,) [m^2/s] and f (n_e,) [K/s] constant in every cell."""
        U, kappa, f = self.cells.gather(u, xp), kappa[:, None], f[:, None]
        tau = self.tau(kappa)
        R_e = kappa * (U @ self.D.T) + U @ self.C.T + tau * (U @ self.S.T) - f * (self.m + tau * self.s)
        return self.cells.scatter(R_e, xp)

    def cell_matrices(self, kappa: Any) -> Any:
        """kappa D + C + tau S, (n_e, 4, 4)."""
        kappa = kappa[:, None, None]
        return kappa * self.D + self.C + self.tau(kappa) * self.S

    def tangent(self, kappa: Array) -> GeneralSparse:
        return self.pattern.assemble(self.cell_matrices(kappa))

    def dR_dkappa(self, u: Array, kappa: Array, f: Array) -> Array:
        """dR_e/dkappa_e (n_e, 4), including dtau/dkappa."""
        U = self.cells.gather(u)
        return np.asarray(U @ self.D.T + self.tau_kappa(kappa)[:, None] * (U @ self.S.T - f[:, None] * self.s))

    def dR_df(self, kappa: Array) -> Array:
        """dR_e/df_e (n_e, 4)."""
        return np.asarray(-self.m - self.tau(kappa)[:, None] * self.s)

    def mass(self, of_outflow: bool) -> Any:
        """The consistent mass matrix (n_u, n_u) of the square or of the outflow boundary."""
        from skfem import Basis, BilinearForm, ElementQuad1, FacetBasis

        if of_outflow:
            facets = self.mesh.facets_satisfying(lambda x: on_inflow(x.T, -self.b), boundaries_only=True)
            basis = FacetBasis(self.mesh, ElementQuad1(), facets=facets)
        else:
            basis = Basis(self.mesh, ElementQuad1())
        return BilinearForm(lambda u, v, _: u * v).assemble(basis)[self.free][:, self.free]

    @property
    def unstabilized(self) -> Supg:
        """The Galerkin method on the same mesh."""
        return replace(self, S=np.zeros_like(self.S), s=np.zeros_like(self.s))

    def interpolation(self, x: Array) -> Any:
        """Values at the points x (m, 2) of a u with the degrees of freedom of this mesh, a sparse (m, n_u)."""
        from skfem import Basis, ElementQuad1

        return Basis(self.mesh, ElementQuad1()).probes(x.T).tocsc()[:, self.free]

    @property
    def neighbours(self) -> Array:
        """Pairs of cells that share a side, (n_s, 2)."""
        return np.asarray(self.mesh.f2t.T[self.mesh.f2t[1] != -1])


def on_inflow(x: Array, b: Array) -> Array:
    """Whether points x (..., 2) of the closed unit square lie on the inflow boundary of b."""
    low, high = x == 0.0, x == 1.0
    return np.asarray(((low & (b > TANGENTIAL)) | (high & (b < -TANGENTIAL))).any(axis=-1))


def unit_vector(angle: float) -> Array:
    """The unit vector at an angle [degrees] to the x axis."""
    return np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
