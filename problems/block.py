"""The block: a hyperelastic cube on a clamped base, pulled at its top, one Young's modulus per cell."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from problems.errors import InputError
from problems.problem import Array, Fields, Linearization, Offers, Operator, Parameters, Problem, Traced

if TYPE_CHECKING:
    from problems.elements import CompiledResidual

THETA_MAX = 300.0


def default_modulus(x: Array) -> Array:
    """E(x) = 1 + 0.4 sin(2 pi x) cos(2 pi y) + 0.3 z [Pa] at points x (3, ...)."""
    return np.asarray(1.0 + 0.4 * np.sin(2.0 * np.pi * x[0]) * np.cos(2.0 * np.pi * x[1]) + 0.3 * x[2])


class Block(Problem):
    """A unit cube of compressible rubber, moduli sought from the displacements of its top.

    State u (n_u,) [m], free displacement components, node by node; parameters theta = log E or E (n_cells,) in the
    order of the mesh's cells. Dead traction on the top face z = 1, base z = 0 clamped.
    """

    name = "block"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    structure = "spd"
    offset = 1.0  # positions, of the unit cube
    matrix_free = True

    def __init__(
        self,
        *,
        n: Annotated[int, "cells along every edge"] = 4,
        law: Annotated[Literal["neo-hookean", "linear"], "stored energy"] = "neo-hookean",
        nu: Annotated[float, "Poisson's ratio"] = 0.3,
        traction: Annotated[float, "dead traction on the top, in z [Pa]"] = 0.2,
        parametrization: Annotated[Literal["log", "raw"], "p = log E or p = E"] = "log",
    ) -> None:
        if n < 1:
            raise InputError(f"block: n={n} cells along an edge - choose n >= 1")
        if not -1.0 < nu < 0.5:
            raise InputError(f"block: nu={nu:g} - the laws are compressible, choose -1 < nu < 0.5")
        if not math.isfinite(traction):
            raise InputError(f"block: traction={traction:g} - choose a finite one")
        self.n, self.law, self.nu, self.traction = n, law, nu, traction
        self.linear = law == "linear"
        self.log = parametrization == "log"
        self.n_state = 3 * (n + 1) ** 2 * n
        E = default_modulus(self.centres)
        self.parameters = Parameters(
            start=np.log(E) if self.log else E,
            scale=np.ones(len(E)),
            lower=-THETA_MAX if self.log else 0.0,
            upper=THETA_MAX if self.log else np.inf,
            unit="log Pa" if self.log else "Pa",
            label=(lambda e: f"log E_{e + 1}") if self.log else (lambda e: f"E_{e + 1}"),
            position=self.centres.T,
        )

    @cached_property
    def mesh(self) -> Any:
        from skfem import MeshHex

        return MeshHex.init_tensor(*3 * [np.linspace(0.0, 1.0, self.n + 1)])

    @cached_property
    def centres(self) -> Array:
        """(3, n_cells) [m]."""
        return np.asarray(self.mesh.p[:, self.mesh.t].mean(axis=1))

    @cached_property
    def free(self) -> Array:
        """(n_nodes, 3), numbers of the unknowns, -1 on the clamped base."""
        clamped = self.mesh.p[2] == 0.0
        free: Array = np.full((self.mesh.p.shape[1], 3), -1)
        free[~clamped] = np.arange(3 * np.count_nonzero(~clamped)).reshape(-1, 3)
        return free

    @cached_property
    def solid(self) -> Any:
        from skfem import ElementHex1

        from problems import materials
        from problems.elements import Geometry, Solid

        W = {"neo-hookean": materials.neo_hookean, "linear": materials.linear}[self.law]
        return Solid(Geometry.of_mesh(self.mesh, ElementHex1(), 2, self.free), W)

    @cached_property
    def f(self) -> Array:
        """Nodal forces (n_u,) of the traction on the top face [N]."""
        from skfem import ElementHex1, FacetBasis

        top = FacetBasis(self.mesh, ElementHex1(), facets=self.mesh.facets_satisfying(lambda x: x[2] == 1.0))
        area = np.zeros(self.mesh.p.shape[1])  # [m^2] that every node carries
        for a in range(top.Nbfun):
            np.add.at(area, top.element_dofs[a], (np.asarray(top.basis[a][0]) * top.dx).sum(axis=1))
        f = np.zeros(self.n_state)
        loaded = area > 0
        f[self.free[loaded, 2]] = self.traction * area[loaded]
        return f

    @cached_property
    def top(self) -> Array:
        """(3 m,), unknowns of the nodes on the top face, which the sensors read."""
        return np.ravel(self.free[self.mesh.p[2] == 1.0])

    @cached_property
    def d(self) -> Array:
        """(3 m,), what the sensors should read [m]: the traction's direction, as far as its number."""
        return np.tile([0.0, 0.0, 0.2], len(self.top) // 3)

    def constants(self, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """mu, lam (n_cells,) [Pa]."""
        from problems.materials import lame

        return lame(xp.exp(p) if self.log else p, self.nu)

    def load(self, p: Array) -> Array:
        return np.asarray(self.f)

    @cached_property
    def _compiled(self) -> CompiledResidual:
        from problems.elements import CompiledResidual

        return CompiledResidual(self.traced().residual, self._internal_energy)

    @cached_property
    def _internal_energy(self) -> Any:
        """Pi(u, p) [N m], traceable."""
        from problems.jax64 import jnp

        solid = self.solid  # made now, not while JAX traces
        return lambda u, p: solid.energy(u, self.constants(p, jnp))

    def residual(self, u: Array, p: Array) -> Array:
        return self._compiled(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        return self.solid.tangent(u, self.constants(p))

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        return self._compiled.by_u(u, p)

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 sum over the top nodes of |u - (0, 0, 0.2)|^2 [m^2]."""
        return 0.5 * xp.sum((u[self.top] - self.d) ** 2)

    def linearize(self, u: Array, p: Array) -> Linearization:
        J_u = np.zeros_like(u)
        J_u[self.top] = u[self.top] - self.d
        return Linearization(self._compiled.by_p(u, p), J_u, np.zeros_like(p))

    def traced(self) -> Traced:
        from problems.elements import gradient
        from problems.jax64 import jnp

        internal, f = gradient(self._internal_energy, 0), jnp.asarray(self.f)
        return Traced(
            residual=lambda u, p: internal(u, p) - f,
            objective=lambda u, p: self.objective(u, p, jnp),
        )

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u, lam (n_nodes, 3), zero on the clamped base; E and dJ/dE of every cell."""
        E = np.exp(p) if self.log else p
        vectors = {"u": u} if lam is None else {"u": u, "lambda": lam}
        on_nodes = {name: np.append(v, 0.0)[self.free] for name, v in vectors.items()}
        order = np.array([0, 3, 6, 2, 1, 5, 7, 4])  # of scikit-fem's corners, that VTK's come in
        cells = {"E": E, "dJ_dE": gradient / E if self.log else gradient}
        return Fields(self.mesh.p.T, "hexahedron", self.mesh.t[order].T, on_nodes, cells)
