"""Equilibrium R(u, p) = 0 of a hyperelastic solid under dead tractions, prescribed displacements or follower loads.

    Pi(u, p) = sum over quadrature points of W(grad u, q) dx - work of dead tractions,     R = dPi/du - follower forces

p enters through a Setup: material constants, nodal positions and the load.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gradient_routes.problems.errors import DomainError
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.matrices.sparse import BlockDiagonal, GeneralPattern, SymmetricPattern
from gradient_routes.problems.mechanics.design_variables import DesignVariables, Setup
from gradient_routes.problems.mechanics.springs import Springs
from gradient_routes.problems.problem import Array, Operator

if TYPE_CHECKING:
    from gradient_routes.problems.fem.assembly_jax import JaxAssembly
    from gradient_routes.problems.fem.assembly_numpy import NumpyAssembly
    from gradient_routes.problems.mechanics.by_ad import ByAd
    from gradient_routes.problems.mechanics.materials import MaterialLaw

Load = Literal["traction", "displacement", "follower"]


@dataclass(frozen=True, eq=False)
class LoadedSolid:
    """The equilibrium equations in one or more load cases.

    directions (cases, d)  traction or grip displacement per unit amplitude; of a follower load, the last is its normal
                           part
    base                   the setup for everything that p does not set
    springs                that hold a face in place of a clamp
    use_numpy              take P, A and dP/dq from hand-derived NumPy code instead of JAX
    """

    mesh: Mesh
    law: MaterialLaw
    bc: BoundaryConditions
    loaded: Facets
    load: Load
    directions: Array
    design: DesignVariables
    base: Setup
    springs: Springs | None = None
    use_numpy: bool = False

    @property
    def symmetric(self) -> bool:
        """Whether R_u is symmetric: a follower load has no potential."""
        return self.load != "follower"

    @property
    def grip_is_parameter(self) -> bool:
        """Whether p is the grip displacement; gripped nodes then move with p at fixed u."""
        return self.load == "displacement" and self.design.is_load

    def single_case(self, case: int) -> LoadedSolid:
        """The same solid in load case `case` only."""
        return replace(self, bc=self.bc.single_case(case), directions=self.directions[case : case + 1])

    def setup(self, p: Any, xp: Any = np) -> Setup:
        """Material constants, nodal positions and load at p."""
        return self.design.apply(self.base, p, xp)

    def check(self, p: Array) -> None:
        """Raises DomainError if the nodal positions at p invert a cell."""
        if self.design.moved_nodes is None:
            return
        _, dx = self.mesh.geometry.at(self.setup(p).X, np)
        folded = np.flatnonzero(~(dx.real > 0.0).all(axis=1))
        if folded.size:
            raise DomainError(
                f"{self.mesh.who}: at this p {folded.size} of {len(dx)} cells are inside out, first cell"
                f" {folded[0] + 1} - move the nodes less"
            )

    def metric(self, s: Setup, xp: Any) -> tuple[Any, Any]:
        """dN, dx of the cells; recomputed only if p moves the nodes."""
        geometry = self.mesh.geometry
        return geometry.metric if s.X is geometry.X else geometry.at(s.X, xp)

    def displacements(self, u: Any, s: Setup, case: int, nodes: Array, xp: Any = np) -> Any:
        a = s.load if self.load == "displacement" else 0.0 * self.base.load
        return self.bc.displacements(u, a, case, nodes, xp)

    # --- the equations

    def potential(self, u: Any, p: Any) -> Any:
        """Pi(u, p) [N m], stored energy minus the work of dead tractions; traceable by JAX."""
        from gradient_routes.problems.jax64 import jnp

        s = self.setup(p, jnp)
        dN, dx = self.metric(s, jnp)
        Pi = 0.0
        for case in range(len(self.directions)):
            Pi += self._jax.energy(self.displacements(u, s, case, self.mesh.geometry.nodes, jnp), s.q, dN, dx)
            if self.springs is not None:
                u_f = self.displacements(u, s, case, self.springs.facets.nodes, jnp)
                Pi += 0.5 * (u_f * self.springs.forces(u_f, s.k, jnp)).sum()
            if self.load == "traction":
                f = self.dead_forces(s, case, jnp)
                Pi -= (f * self.displacements(u, s, case, self.loaded.nodes, jnp)).sum()
        return Pi

    def internal_work(self, u: Any, p: Any, case: int, e: Array) -> Any:
        """Of the stresses along displacements e (n_nodes, d) [N m per unit of e]; traceable by JAX."""
        from gradient_routes.problems.jax64 import jax, jnp

        s, nodes = self.setup(p, jnp), self.mesh.geometry.nodes
        dN, dx = self.metric(s, jnp)
        u_e = self.displacements(u, s, case, nodes, jnp)
        along = jnp.asarray(e[nodes], u_e.dtype)
        return jax.jvp(lambda u_e: self._jax.energy(u_e, s.q, dN, dx), (u_e,), (along,))[1]

    def dead_forces(self, s: Setup, case: int, xp: Any) -> Any:
        """Nodal forces (n_f, n_a, d) [N] of the traction on the loaded facets."""
        t = s.load if s.load.ndim == 2 else s.load * self.directions[case][None]  # (n_f or 1, d)
        return xp.einsum("fqa,fq->fa", self.loaded.N, self.loaded.areas(s.X, xp))[..., None] * t[:, None]

    def follower_forces(self, u_f: Any, s: Setup, case: int, xp: Any) -> Any:
        """The same for a traction along the deformed normal; u_f (n_f, n_a, d) displacements of the facets' cells."""
        normals = self.loaded.normals(s.X[self.loaded.nodes] + u_f, xp)
        return s.load * self.directions[case, -1] * xp.einsum("fqa,fqi->fai", self.loaded.N, normals)

    def external_forces(self, u: Array, s: Setup, case: int) -> Array | None:
        """Nodal forces (n_f, n_a, d) [N] on the loaded facets; None for a prescribed displacement."""
        if self.load == "traction":
            return np.asarray(self.dead_forces(s, case, np))
        if self.load == "follower":
            u_f = self.displacements(u, s, case, self.loaded.nodes)
            return np.asarray(self.follower_forces(u_f, s, case, np))
        return None

    def follower_residual(self, u: Any, p: Any) -> Any:
        """-f_ext (n_u,) of a follower load; traceable by JAX."""
        from gradient_routes.problems.jax64 import jnp

        s, n, facets = self.setup(p, jnp), self.bc.n_free, self.loaded
        parts = []
        for case, index in enumerate(self.bc.index):
            f = self.follower_forces(self.displacements(u, s, case, facets.nodes, jnp), s, case, jnp)
            parts.append(-jnp.zeros(self.bc.size, f.dtype).at[index[facets.nodes]].add(f)[:n])
        return jnp.concatenate(parts)

    @cached_property
    def _jax(self) -> JaxAssembly:
        from gradient_routes.problems.fem.assembly_jax import assembly

        return assembly(self.law.W)

    # --- evaluated in NumPy

    def initial(self, p: Array) -> Array:
        """u = 0; with a grip, its displacement interpolated to the clamp by distance; where others are known and the
        law is not linear, the affine function that fits these best.
        """
        u = np.zeros(self.bc.n_u, dtype=p.dtype)
        for case, moved in enumerate(self._start(p)):
            index = self.bc.index[case]
            free = index < self.bc.n_free
            u[case * self.bc.n_free + index[free]] = moved[free]
        return u

    def _start(self, p: Array) -> list[Array]:
        """(n_nodes, d) of every load case; [] where it is 0."""
        if self.bc.values.size:
            return [] if self.law.name == "linear" else self._affine
        if self.load != "displacement":
            return []
        a = self.setup(p).load
        return [r[:, None] * direction * a for direction, r in zip(self.directions, self._ramps, strict=True)]

    @cached_property
    def _affine(self) -> list[Array]:
        bc, X = self.bc, self.mesh.geometry.X
        A = np.concatenate([np.ones((len(X), 1)), X - X[bc.known].mean(axis=0)], axis=1)
        known = bc.values.reshape(len(bc.values), len(bc.known), -1)
        return [A @ np.linalg.lstsq(A[bc.known], values, rcond=None)[0] for values in known]

    @cached_property
    def _ramps(self) -> list[Array]:
        """For each load case (n_nodes,), from 0 where its direction is held to 1 at the grip."""
        from scipy.spatial import cKDTree

        X, ramps = self.mesh.geometry.X, []
        to_grip = cKDTree(X[self.bc.gripped]).query(X)[0]
        for direction in self.directions:
            held = X[self.bc.held[:, direction != 0.0].any(axis=1)]
            to_held = cKDTree(held).query(X)[0] if len(held) else np.ones(len(X))
            ramps.append(np.asarray(to_held / np.maximum(to_held + to_grip, 1e-300)))
        return ramps

    def residual(self, u: Array, p: Array) -> Array:
        self.check(p)
        return self._derived.residual(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        s = self.setup(p)
        metric, nodes = self.metric(s, np), self.mesh.geometry.nodes
        blocks = []
        for case in range(len(self.directions)):
            u_e = self.displacements(u, s, case, nodes)
            K = (self.by_hand if self.use_numpy else self._jax).element_tangents(u_e, s.q, *metric, self._selected)
            if self.load == "follower":
                u_f = self.displacements(u, s, case, self.loaded.nodes)
                np.subtract.at(K, self.loaded.cells, self._follower_tangents(u_f, s, case))
            if self.springs is not None:
                more = self.springs.matrices(s.k, self._selected)
                K = K.astype(np.result_type(K, more), copy=False)
                np.add.at(K, self.springs.facets.cells, more)
            blocks.append(self.pattern.assemble(K))
        return blocks[0] if len(blocks) == 1 else BlockDiagonal(tuple(blocks))

    def element_matrices(self, u_e: Array, s: Setup) -> Array:
        """Those of the stresses, (n_e, d n_a, d n_a), for displacements u_e (n_e, n_a, d) of the cells' nodes."""
        m = u_e.shape[1] * u_e.shape[2]
        by = self.by_hand if self.use_numpy else self._jax
        return np.asarray(by.element_tangents(u_e, s.q, *self.metric(s, np), np.arange(m * m))).reshape(-1, m, m)

    @cached_property
    def pattern(self) -> SymmetricPattern | GeneralPattern:
        geometry, n = self.mesh.geometry, self.bc.n_free
        dofs = self.bc.dofs(geometry.nodes)
        if not self.symmetric:
            return GeneralPattern.of_elements(dofs, n)
        return SymmetricPattern.of_elements(dofs, n, self.bc.near_nullspace(geometry))

    @cached_property
    def _selected(self) -> Array:
        """Flat indices of the element matrix entries that the pattern stores."""
        m = self.mesh.geometry.dim * self.mesh.geometry.nodes.shape[1]
        i, j = np.triu_indices(m)
        return i * m + j if self.symmetric else np.arange(m * m)

    def _follower_tangents(self, u_f: Array, s: Setup, case: int) -> Array:
        """df_ext/du_f, (n_f, (d n_a)^2)."""
        return np.asarray(self._follower_derivative(u_f, s.load, s.X, case)).reshape(len(u_f), -1)

    @cached_property
    def _follower_derivative(self) -> Callable[..., Any]:
        from gradient_routes.problems.jax64 import jax, jnp

        def forces(u_f: Any, load: Any, X: Any, case: int) -> Any:
            return self.follower_forces(u_f, Setup((), X, load), case, jnp)

        def columns(u_f: Any, load: Any, X: Any, case: int) -> Any:
            """Facets are decoupled: one product gives one column of every facet matrix."""
            m = u_f.shape[1] * u_f.shape[2]
            units = jnp.broadcast_to(jnp.eye(m, dtype=u_f.dtype).reshape(m, 1, *u_f.shape[1:]), (m, *u_f.shape))
            along = jax.vmap(lambda v: jax.jvp(lambda u_f: forces(u_f, load, X, case), (u_f,), (v,))[1])(units)
            return jnp.moveaxis(along, 0, -1)  # (n_f, n_a, 3, m)

        return jax.jit(columns, static_argnums=3)

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        return self._derived.R_u(u, p)

    def R_p(self, u: Array, p: Array) -> Operator:
        """R_p (n_u, n_p)."""
        return self._derived.R_p(u, p)

    @property
    def traced_residual(self) -> Callable[[Any, Any], Any]:
        """R(u, p) in jax.numpy."""
        return self._by_ad.of_real.R

    @property
    def _derived(self) -> NumpyAssembly | ByAd:
        return self.by_hand if self.use_numpy else self._by_ad

    @cached_property
    def by_hand(self) -> NumpyAssembly:
        """Assembly of hand-derived P, A and dP/dq."""
        from gradient_routes.problems.fem.assembly_numpy import NumpyAssembly

        return NumpyAssembly(self)

    @cached_property
    def _by_ad(self) -> ByAd:
        from gradient_routes.problems.mechanics.by_ad import ByAd

        return ByAd(self)
