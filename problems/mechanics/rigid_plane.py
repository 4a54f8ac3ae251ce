"""Contact with a rigid plane below a body: every node that may touch it is an element of its own.

    Pi_a = w_a W(g_a),    g_a = -(gap + u_a . e_z),    dW/dg = q(g)

w_a [m^2] is the area that belongs to node a, so that q [Pa] is a pressure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.contact import CompliantStop
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class RigidPlane:
    """The bottom of a body against it: at (m,), the numbers of its displacements along z among n, and areas (m,)."""

    stop: CompliantStop
    n: int
    at: Array
    area: Array

    @classmethod
    def below(cls, mesh: Mesh, bc: BoundaryConditions, stop: CompliantStop) -> RigidPlane:
        facets, X = mesh.boundary("bottom", surface=True), mesh.geometry.X
        area = np.zeros(len(X))
        np.add.at(area, facets.nodes, np.einsum("fqa,fq->fa", facets.N, facets.areas(X, np)))
        nodes = np.flatnonzero(area > 1e-9 * area.max())  # pressure does no work on the corners of tet10
        return cls(stop, bc.n_free, bc.index[0, nodes, 2], area[nodes])

    def penetration(self, u: Any) -> Any:
        """g (.., m) [m] of displacements u (.., n)."""
        return -u[..., self.at] - self.stop.gap

    def forces(self, u: Any, xp: Any = np) -> Any:
        """dPi/du (n,) [N]."""
        return self._spread(-self.area * self.stop.law.force(self.penetration(u), xp), xp)

    def stiffness(self, u: Array) -> Array:
        """The diagonal d^2 Pi/du^2, (n,) [N/m]."""
        return np.asarray(self._spread(self.area * self.stop.law.stiffness(self.penetration(u)), np))

    def active_set(self, u: Array) -> str | None:
        """The nodes of the bottom, counted from 1, that touch; None where the law is smooth."""
        if self.stop.law.active_set(0.0) is None:
            return None
        return ",".join(str(node) for node in np.flatnonzero(self.penetration(u).real > 0.0) + 1) or "open"

    def _spread(self, q: Any, xp: Any) -> Any:
        f = xp.zeros(self.n, dtype=q.dtype)
        if xp is not np:
            return f.at[self.at].set(q)
        f[self.at] = q
        return f
