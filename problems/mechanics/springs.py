"""A face on springs in place of a clamp: its traction is -k u, k [Pa/m] one unknown stiffness for all directions.

Energy 1/2 k int |u|^2 dA over the undeformed face. k is one parameter more, the last one.
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
    """On `facets`; log: whether p ends with log k or with k."""

    facets: Facets
    log: bool

    @classmethod
    def on(cls, mesh: Mesh, face: str, log: bool) -> Springs:
        """Raises InputError for a face that names none or has no area."""
        springs = cls(mesh.boundary(face), log)
        if not springs.area > 0.0:
            raise InputError(
                f"{mesh.who}: clamped={face} lies on the axis and has no area for springs - choose another"
            )
        return springs

    @property
    def area(self) -> float:
        """[m^2]."""
        return float(self._areas.sum())

    @property
    def _areas(self) -> Array:
        return np.asarray(self.facets.areas(self.facets.geometry.X, np))

    @cached_property
    def M(self) -> Array:
        """int N_a N_b dA, (n_f, n_a, n_a) [m^2]."""
        return np.asarray(np.einsum("fqa,fqb,fq->fab", self.facets.N, self.facets.N, self._areas))

    def forces(self, u_f: Any, k: Any, xp: Any = np) -> Any:
        """k M u_f, (n_f, n_a, d) [N], for displacements u_f (n_f, n_a, d) of the facets' cells."""
        return k * xp.einsum("fab,fbi->fai", self.M, u_f)

    def matrices(self, k: Any, selected: Array) -> Array:
        """Entries `selected` of the flat (d n_a, d n_a) stiffness of each facet, (n_f, n_selected)."""
        one = np.eye(self.facets.geometry.dim)
        whole = np.einsum("fab,ij->faibj", self.M, one).reshape(len(self.M), -1)
        return np.asarray(k * whole[:, selected])

    def k(self, p: Any, xp: Any = np) -> Any:
        """[Pa/m], from the last of p."""
        return xp.exp(p[-1]) if self.log else p[-1]

    def k_p(self, p: Array) -> Any:
        """dk/dp_last."""
        return self.k(p) if self.log else 1.0

    def beside(self, design: DesignVariables, k: float) -> DesignVariables:
        """p with k after the parameters of another design, k at the start."""
        of, n = design.parameters, len(design.parameters)

        def with_k(values: Any, last: float) -> Array:
            return np.append(np.broadcast_to(values, n), last)

        start, scale = (np.log(k), 1.0) if self.log else (k, k)
        centre = self.facets.centres.mean(axis=0)
        parameters = Parameters(
            start=with_k(of.start, start),
            scale=with_k(of.scale, scale),
            lower=with_k(of.lower, -THETA_MAX if self.log else 0.0),
            upper=with_k(of.upper, THETA_MAX if self.log else np.inf),
            unit=(*(of.unit_of(i) for i in range(n)), "log Pa/m" if self.log else "Pa/m"),
            label=lambda i: of.label(i) if i < n else "log k" if self.log else "k",
            position=None if of.position is None else np.append(of.position, centre[None], axis=0),
        )

        def apply(s: Setup, p: Any, xp: Any) -> Setup:
            return replace(design.apply(s, p[:-1], xp), k=self.k(p, xp))

        q_p, chain, by_stiffness = design.q_p, design.chain, design.by_stiffness
        return replace(
            design,
            parameters=parameters,
            apply=apply,
            truth=with_k(design.truth, start + np.log(2.0) if self.log else 2.0 * k),
            q_p=None if q_p is None else lambda p: q_p(p[:-1]),
            chain=None if chain is None else lambda p: np.pad(chain(p[:-1]), ((0, 1), (0, 1))),
            by_stiffness=None if by_stiffness is None else np.append(by_stiffness, 1.0),
        )
