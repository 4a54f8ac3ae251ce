"""What the noise of measured boundary values does to what is read of a body.

    w . dy = g . db,    g = S_b^T w - R_b^T lam,    R_u^T lam = S_u^T w,    db = root of their covariance times a unit
                                                                               normal vector

y = S u are the readings, b the known displacements of nodes, R_b and S_b derivatives at fixed u.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gradient_routes.problems.data.boundary_values import BoundaryValues
from gradient_routes.problems.data.displacement_data import DisplacementData
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class BoundaryNoise:
    """At a solved state u (n_u,) for p (n_p,), of the boundary values of every load case.

    Element matrices are those of loads that do not follow u.
    """

    data: DisplacementData
    boundary: Sequence[BoundaryValues]
    u: Array
    p: Array

    def pulled(self, w: Array, lam: Array) -> Array:
        """Derivatives (k,) of w . y, w (m,), by independent unit normal variables; R_u^T lam = S_u^T w."""
        bc, found = self.data.solid.bc, []
        for case, (G, of) in enumerate(zip(self._read(w), self.boundary, strict=True)):
            g = np.where(bc.held, 0.0, G + self._held(w, lam, case))[bc.known]
            found += [g[:, i] @ root for i, root in enumerate(of.root)]
        return np.concatenate(found)

    def _read(self, w: Array) -> list[Array]:
        """S_b^T w, (n_nodes, d) of every load case: displacements and strains."""
        data, X = self.data, self.data.solid.mesh.geometry.X
        ends = np.cumsum([np.count_nonzero(at.measured) for at in data.probes])
        if data.motions is not None:
            w = w.copy()
            for motion, end in zip(data.motions, ends, strict=True):
                of = slice(end - len(motion.Q), end)
                w[of] = motion.projected(w[of])
        found = []
        for at, end in zip(data.probes, ends, strict=True):
            G = np.zeros_like(X)
            np.add.at(G, at.nodes, at.forces(w[end - np.count_nonzero(at.measured) : end]))
            found.append(G)
        if data.strains is not None:
            count = np.count_nonzero(data.strains.measured)
            np.add.at(found[0], data.strains.nodes, data.strains.forces(w[ends[-1] : ends[-1] + count]))
        return found

    def _held(self, w: Array, lam: Array, case: int) -> Array:
        """-R_b^T lam, and S_b^T w of a force, which is the work of the stresses along e: K (w_F e - lam)."""
        solid, force = self.data.solid, self.data.force
        every = np.arange(len(solid.mesh.geometry.X))
        v = -solid.bc.variations(lam, case, every)
        if force is not None:
            v = v + w[len(w) - len(force.F) + case] * force.weight * force.reaction.e
        G, nodes = np.zeros_like(v), self._cells
        v_e = v[nodes].reshape(len(nodes), -1)
        np.add.at(G, nodes, np.einsum("eij,ej->ei", self._matrices[case], v_e).reshape(*nodes.shape, -1))
        return G

    @property
    def _cells(self) -> Array:
        """Nodes (n_c, n_a) of the cells that have a node with a known displacement."""
        return np.asarray(self.data.solid.mesh.geometry.nodes[self._beside])

    @cached_property
    def _beside(self) -> Array:
        solid = self.data.solid
        return np.flatnonzero(np.isin(solid.mesh.geometry.nodes, solid.bc.known).any(axis=1))

    @cached_property
    def _matrices(self) -> list[Array]:
        """Those of these cells, (n_c, d n_a, d n_a), in every load case."""
        solid = self.data.solid
        s, nodes = solid.setup(self.p), solid.mesh.geometry.nodes
        each = (solid.displacements(self.u, s, case, nodes) for case in range(len(self.boundary)))
        return [solid.element_matrices(u_e, s)[self._beside] for u_e in each]


def boundary_noise(
    data: DisplacementData, boundary: Sequence[BoundaryValues], u: Array, p: Array
) -> BoundaryNoise | None:
    """None where no boundary value has noise that is known, and for a load that follows u."""
    if not any(of.sigma for of in boundary) or not data.solid.symmetric:
        return None
    return BoundaryNoise(data, boundary, u, p)
