"""A loaded solid: what stands in R(u, p) = 0 for bodies, laws, supports and loads of any kind.

    Pi(u, p) = sum over points of W(F, q) dx - work of dead tractions,     R = dPi/du - follower forces

p acts through a Setting: constants of the law, positions of the nodes, the load.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gradient_routes.problems.errors import DomainError
from gradient_routes.problems.fem.boundary_conditions import Supports
from gradient_routes.problems.fem.elements import Facets
from gradient_routes.problems.fem.mesh import Body
from gradient_routes.problems.matrices.sparse import BlockDiagonal, GeneralPattern, SymmetricPattern
from gradient_routes.problems.mechanics.design_variables import Setting, Unknown
from gradient_routes.problems.problem import Array, Operator

if TYPE_CHECKING:
    from gradient_routes.problems.fem.assembly_jax import CompiledResidual, Solid
    from gradient_routes.problems.fem.assembly_numpy import HandSolid
    from gradient_routes.problems.mechanics.materials import Law

Load = Literal["traction", "displacement", "follower"]


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The equilibrium of a body in one or more load cases.

    directions (cases, 3)  of the traction or of the grip's motion, times the amplitude
    at_rest                the setting where p says nothing
    by_hand                derivatives of the law in NumPy instead of by JAX
    """

    body: Body
    law: Law
    supports: Supports
    loaded: Facets
    load: Load
    directions: Array
    unknown: Unknown
    at_rest: Setting
    by_hand: bool = False

    @property
    def symmetric(self) -> bool:
        """Whether R_u is: a follower load has no potential."""
        return self.load != "follower"

    @property
    def moves_grip(self) -> bool:
        """Whether p is how far the grip goes, and what a grip moves is moved by p with u held."""
        return self.load == "displacement" and self.unknown.is_load

    def alone(self, case: int) -> Mechanics:
        """In one load case."""
        of = slice(case, case + 1)
        supports = replace(self.supports, index=self.supports.index[of])
        return replace(self, supports=supports, directions=self.directions[of])

    def setting(self, p: Any, xp: Any = np) -> Setting:
        """Constants of the law, positions of the nodes and load at p."""
        return self.unknown.apply(self.at_rest, p, xp)

    def check(self, p: Array) -> None:
        """Raises DomainError where p turns a cell inside out."""
        if self.unknown.nodes is None:
            return
        _, dx = self.body.geometry.at(self.setting(p).X, np)
        folded = np.flatnonzero(~(dx.real > 0.0).all(axis=1))
        if folded.size:
            raise DomainError(
                f"{self.body.who}: at this p {folded.size} of {len(dx)} cells are inside out, first cell"
                f" {folded[0] + 1} - move the nodes less"
            )

    def metric(self, s: Setting, xp: Any) -> tuple[Any, Any]:
        """dN, dx of the cells; worked out anew only where p moves the nodes."""
        geometry = self.body.geometry
        return geometry.metric if s.X is geometry.X else geometry.at(s.X, xp)

    def displacements(self, u: Any, s: Setting, case: int, nodes: Array, xp: Any = np) -> Any:
        a = s.load if self.load == "displacement" else 0.0 * self.at_rest.load
        return self.supports.displacements(u, a, case, nodes, xp)

    # --- the physics, once

    def potential(self, u: Any, p: Any) -> Any:
        """Pi(u, p) [N m], stored energy less the work of dead tractions; traceable."""
        from gradient_routes.problems.jax64 import jnp

        s = self.setting(p, jnp)
        dN, dx = self.metric(s, jnp)
        Pi = 0.0
        for case in range(len(self.directions)):
            Pi += self.solid.energy(self.displacements(u, s, case, self.body.geometry.nodes, jnp), s.q, dN, dx)
            if self.load == "traction":
                f = self.dead_forces(s, case, jnp)
                Pi -= (f * self.displacements(u, s, case, self.loaded.nodes, jnp)).sum()
        return Pi

    def dead_forces(self, s: Setting, case: int, xp: Any) -> Any:
        """Of the traction on the loaded facets, node by node: (n_f, n_a, 3) [N]."""
        t = s.load if s.load.ndim == 2 else s.load * self.directions[case][None]  # (n_f or 1, 3)
        return xp.einsum("fqa,fq->fa", self.loaded.N, self.loaded.areas(s.X, xp))[..., None] * t[:, None]

    def follower_forces(self, u_f: Any, s: Setting, case: int, xp: Any) -> Any:
        """The same of a traction along the deformed normal, u_f (n_f, n_a, 3) the facets' displacements."""
        normals = self.loaded.normals(s.X[self.loaded.nodes] + u_f, xp)
        return s.load / (1.0 + case) * xp.einsum("fqa,fqi->fai", self.loaded.N, normals)

    def external_forces(self, u: Array, s: Setting, case: int) -> Array | None:
        """On the loaded facets, node by node (n_f, n_a, 3) [N]; None where a grip moves them."""
        if self.load == "traction":
            return np.asarray(self.dead_forces(s, case, np))
        if self.load == "follower":
            u_f = self.displacements(u, s, case, self.loaded.nodes)
            return np.asarray(self.follower_forces(u_f, s, case, np))
        return None

    def follower(self, u: Any, p: Any) -> Any:
        """-f_ext (n_u,) of a load that has no potential; traceable."""
        from gradient_routes.problems.jax64 import jnp

        s, n, facets = self.setting(p, jnp), self.supports.n_free, self.loaded
        parts = []
        for case, index in enumerate(self.supports.index):
            f = self.follower_forces(self.displacements(u, s, case, facets.nodes, jnp), s, case, jnp)
            parts.append(-jnp.zeros(n + 2, f.dtype).at[index[facets.nodes]].add(f)[:n])
        return jnp.concatenate(parts)

    @cached_property
    def solid(self) -> Solid:
        from gradient_routes.problems.fem.assembly_jax import Solid

        return Solid(self.law.W)

    @cached_property
    def _compiled(self) -> CompiledResidual:
        from gradient_routes.problems.fem.assembly_jax import CompiledResidual

        return CompiledResidual(self.potential, self.follower if self.load == "follower" else None)

    # --- as numbers

    def initial(self, p: Array) -> Array:
        """Zero; where a grip moves, every node goes along as far as it is near to it."""
        u = np.zeros(self.supports.n_u, dtype=p.dtype)
        if self.load != "displacement":
            return u
        a = self.setting(p).load
        for case, direction in enumerate(self.directions):
            moved = self._nearness[:, None] * direction * a
            index = self.supports.index[case]
            free = index < self.supports.n_free
            u[case * self.supports.n_free + index[free]] = moved[free]
        return u

    @cached_property
    def _nearness(self) -> Array:
        """(n_nodes,), 0 at the clamp, 1 at the grip."""
        from scipy.spatial import cKDTree

        X = self.body.geometry.X
        to_clamp, to_grip = (cKDTree(X[nodes]).query(X)[0] for nodes in (self.supports.clamped, self.supports.gripped))
        return np.asarray(to_clamp / (to_clamp + to_grip))

    def residual(self, u: Array, p: Array) -> Array:
        self.check(p)
        return self._hand.residual(u, p) if self.by_hand else self._compiled(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        s = self.setting(p)
        metric, nodes = self.metric(s, np), self.body.geometry.nodes
        blocks = []
        for case in range(len(self.directions)):
            u_e = self.displacements(u, s, case, nodes)
            K = (self._hand if self.by_hand else self.solid).tangents(u_e, s.q, *metric, self._pick)
            if self.load == "follower":
                u_f = self.displacements(u, s, case, self.loaded.nodes)
                np.subtract.at(K, self.loaded.cells, self._follower_tangents(u_f, s, case))
            blocks.append(self.pattern.assemble(K))
        return blocks[0] if len(blocks) == 1 else BlockDiagonal(tuple(blocks))

    @cached_property
    def pattern(self) -> SymmetricPattern | GeneralPattern:
        geometry, n = self.body.geometry, self.supports.n_free
        unknowns = self.supports.unknowns(geometry.nodes)
        if not self.symmetric:
            return GeneralPattern.of_elements(unknowns, n)
        return SymmetricPattern.of_elements(unknowns, n, self.supports.rigid_motions(geometry.X))

    @cached_property
    def _pick(self) -> Array:
        """The entries of an element matrix that the pattern takes."""
        m = 3 * self.body.geometry.nodes.shape[1]
        i, j = np.triu_indices(m)
        return i * m + j if self.symmetric else np.arange(m * m)

    def _follower_tangents(self, u_f: Array, s: Setting, case: int) -> Array:
        """df_ext/du_f, (n_f, (3 n_a)^2)."""
        return np.asarray(self._follower_derivative(u_f, s.load, s.X, case)).reshape(len(u_f), -1)

    @cached_property
    def _follower_derivative(self) -> Callable[..., Any]:
        from gradient_routes.problems.jax64 import jax, jnp

        def forces(u_f: Any, load: Any, X: Any, case: int) -> Any:
            return self.follower_forces(u_f, Setting((), X, load), case, jnp)

        def columns(u_f: Any, load: Any, X: Any, case: int) -> Any:
            """Facets do not know each other: one product gives a column of every facet's matrix."""
            m = 3 * u_f.shape[1]
            units = jnp.broadcast_to(jnp.eye(m, dtype=u_f.dtype).reshape(m, 1, *u_f.shape[1:]), (m, *u_f.shape))
            along = jax.vmap(lambda v: jax.jvp(lambda u_f: forces(u_f, load, X, case), (u_f,), (v,))[1])(units)
            return jnp.moveaxis(along, 0, -1)  # (n_f, n_a, 3, m)

        return jax.jit(columns, static_argnums=3)

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        return self._compiled.by_u(u, p)

    def by_p(self, u: Array, p: Array) -> Operator:
        """R_p (n_u, n_p)."""
        return self._hand.by_p(u, p) if self.by_hand else self._compiled.by_p(u, p)

    @property
    def traced_residual(self) -> Callable[[Any, Any], Any]:
        """R(u, p) in jax.numpy."""
        return self._compiled.R

    @cached_property
    def _hand(self) -> HandSolid:
        from gradient_routes.problems.fem.assembly_numpy import HandSolid

        return HandSolid(self)
