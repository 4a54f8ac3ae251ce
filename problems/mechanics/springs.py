"""A face on springs in place of a clamp: its traction is -k u, k [Pa/m] one unknown stiffness for all directions, or
-(k_n n n^T + k_t (I - n n^T)) u, one along its normal n and one across.

Energy 1/2 int u^T (..) u dA over the undeformed face. The stiffnesses are parameters more, the last ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.design_variables import THETA_MAX, DesignVariables, Setup
from gradient_routes.problems.problem import Array, Parameters


@dataclass(frozen=True, eq=False)
class Springs:
    """On `facets`; log: whether p ends with log k or with k; names of the stiffnesses, (k,) or (k_n, k_t)."""

    facets: Facets
    log: bool
    names: tuple[str, ...]

    @classmethod
    def on(cls, mesh: Mesh, face: str, log: bool, apart: bool) -> Springs:
        """apart: whether k_n differs from k_t. Raises InputError for a face that names none or has no area."""
        springs = cls(mesh.boundary(face), log, ("k_n", "k_t") if apart else ("k",))
        if not springs.area > 0.0:
            raise InputError(
                f"{mesh.who}: clamped={face} lies on the axis and has no area for springs - choose another"
            )
        return springs

    @property
    def count(self) -> int:
        return len(self.names)

    @property
    def area(self) -> float:
        """[m^2]."""
        return float(np.linalg.norm(self._normals, axis=-1).sum())

    @cached_property
    def _normals(self) -> Array:
        """n dA, (n_f, n_q, d) [m^2]."""
        return np.asarray(self.facets.normals(self.facets.geometry.X[self.facets.nodes], np))

    @cached_property
    def M(self) -> Array:
        """int N_a N_b (n n^T, I - n n^T) dA, or I in their place, (count, n_f, n_a, d, n_a, d) [m^2]."""
        dA = np.linalg.norm(self._normals, axis=-1)
        n = self._normals / np.where(dA > 0.0, dA, 1.0)[..., None]  # 0 on the axis of a body of revolution
        one, along = np.eye(n.shape[-1]), n[..., :, None] * n[..., None, :]
        D = np.stack([along, one - along] if self.count == 2 else [np.broadcast_to(one, along.shape)])
        return np.asarray(np.einsum("fqa,fqb,fq,kfqij->kfaibj", self.facets.N, self.facets.N, dA, D))

    def each(self, u_f: Any, xp: Any = np) -> Any:
        """Nodal forces (count, n_f, n_a, d) [N] per unit of each stiffness, for displacements u_f (n_f, n_a, d) of the
        facets' cells.
        """
        return xp.einsum("kfaibj,fbj->kfai", self.M, u_f)

    def forces(self, u_f: Any, k: Any, xp: Any = np) -> Any:
        """(n_f, n_a, d) [N], for stiffnesses k (count,)."""
        return xp.einsum("k,kfai->fai", k, self.each(u_f, xp))

    def matrices(self, k: Any, selected: Array) -> Array:
        """Entries `selected` of the flat (d n_a, d n_a) stiffness of each facet, (n_f, n_selected)."""
        whole = self.M.reshape(self.count, self.M.shape[1], -1)
        return np.asarray(np.einsum("k,kfs->fs", k, whole[:, :, selected]))

    def k(self, p: Any, xp: Any = np) -> Any:
        """(count,) [Pa/m], from the last of p."""
        last = p[-self.count :]
        return xp.exp(last) if self.log else last

    def k_p(self, p: Array) -> Any:
        """dk_i/dp_i, (count,)."""
        return self.k(p) if self.log else np.ones(self.count)

    def stated(self, p: Array) -> dict[str, Any]:
        """By name with the unit."""
        return {f"{name} [Pa/m]": k for name, k in zip(self.names, self.k(p), strict=True)}

    def beside(self, design: DesignVariables, k: float) -> DesignVariables:
        """p with k after the parameters of another design, all of them k at the start."""
        of, n, count = design.parameters, len(design.parameters), self.count

        def with_k(values: Any, last: Any) -> Array:
            return np.append(np.broadcast_to(values, n), np.broadcast_to(last, count))

        start, scale = (np.log(k), 1.0) if self.log else (k, k)
        factors = np.array([2.0, 0.5][:count])
        centre = np.broadcast_to(self.facets.centres.mean(axis=0), (count, self.facets.geometry.dim))
        parameters = Parameters(
            start=with_k(of.start, start),
            scale=with_k(of.scale, scale),
            lower=with_k(of.lower, -THETA_MAX if self.log else 0.0),
            upper=with_k(of.upper, THETA_MAX if self.log else np.inf),
            unit=(*(of.unit_of(i) for i in range(n)), *["log Pa/m" if self.log else "Pa/m"] * count),
            label=lambda i: of.label(i) if i < n else f"{'log ' * self.log}{self.names[i - n]}",
            position=None if of.position is None else np.append(of.position, centre, axis=0),
        )

        def apply(s: Setup, p: Any, xp: Any) -> Setup:
            return replace(design.apply(s, p[:-count], xp), k=self.k(p, xp))

        q_p, chain, by_stiffness = design.q_p, design.chain, design.by_stiffness
        return replace(
            design,
            parameters=parameters,
            apply=apply,
            truth=with_k(design.truth, start + np.log(factors) if self.log else factors * k),
            q_p=None if q_p is None else lambda p: q_p(p[:-count]),
            chain=None if chain is None else lambda p: np.pad(chain(p[:-count]), ((0, count), (0, count))),
            by_stiffness=None if by_stiffness is None else np.append(by_stiffness, np.ones(count)),
        )
