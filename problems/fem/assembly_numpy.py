"""Residual, tangent and R_p of a solid from hand-derived P, A and dP/dq in NumPy, without JAX."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.fem.cells import Cells, in_chunks
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.sparse import accumulate
from gradient_routes.problems.problem import Array

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.design_variables import Setup
    from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid


class NumpyAssembly:
    """Assembly for derivatives=hand: f_int = sum over points of P dN dx."""

    def __init__(self, solid: LoadedSolid) -> None:
        assert solid.law.numpy is not None, "Block refuses laws without NumPy derivatives"
        self.solid, self.material = solid, solid.law.numpy.first
        self.nodes = solid.mesh.geometry.nodes

    def residual(self, u: Array, p: Array) -> Array:
        """f_int - f_ext, (n_u,)."""
        solid = self.solid
        s = solid.setup(p)
        parts = []
        for case in range(len(solid.directions)):
            f = self._internal(u, s, case, lambda cells, u_e, q: self.material.P(cells.gradients(u_e), q))
            external = solid.external_forces(u, s, case)
            parts.append(f if external is None else f - solid.bc.assemble(external, solid.loaded.nodes, case)[0])
        return np.concatenate(parts)

    def R_u(self, u: Array, p: Array) -> ByProducts:
        """R_u by its products, of loads that do not follow u: it is symmetric."""
        s = self.solid.setup(p)

        def product(v: Array) -> Array:
            parts = []
            for case in range(len(self.solid.directions)):
                v_e = self.solid.bc.displacements(v, 0.0, case, self.nodes, np)

                def dP(cells: Cells, u_e: Array, q: Any, v_e: Array = v_e) -> Array:
                    return self.material.dP(cells.gradients(u_e), cells.gradients(v_e), q)

                parts.append(self._internal(u, s, case, dP))
            return np.concatenate(parts)

        return ByProducts(product, product)

    def _internal(self, u: Array, s: Setup, case: int, stress: Callable[[Cells, Array, Any], Array]) -> Array:
        """Nodal forces (n_free,) of a stress (3, 3, m) at the points of some cells."""
        u_e = self.solid.displacements(u, s, case, self.nodes)
        with np.errstate(all="ignore"):  # NaN and infinity are results here, as in JAX
            parts = [
                cells.forces(stress(cells, u_e, cells.at_points(s.q))) for cells in in_chunks(*self.solid.metric(s, np))
            ]
        return self.solid.bc.assemble(np.concatenate(parts), self.nodes, case)[0]

    def element_tangents(self, u_e: Array, q: Any, dN: Array, dx: Array, selected: Array) -> Array:
        """Entries `pick` of the element matrices: see Solid.tangents."""
        K = np.empty((len(u_e), len(selected)), np.result_type(u_e, *q, dN))
        with np.errstate(all="ignore"):
            for cells in in_chunks(dN, dx):
                A = self.material.A(cells.gradients(u_e), cells.at_points(q))
                K[cells.which] = cells.matrices(A, selected)
        return K

    def R_p(self, u: Array, p: Array) -> ByProducts:
        """R_p (n_u, n_p): each material constant of a cell depends on one parameter, or p on all of them by dq/dp."""
        solid, derivative = self.solid, self.solid.design.q_p
        assert derivative is not None, "Block refuses p that is not a material"
        s, q_p = solid.setup(p), derivative(p)
        by_p = None if solid.design.chain is None else solid.design.chain(p)
        f_q = [self._by_constants(solid.displacements(u, s, case, self.nodes), s, q_p) for case in self._cases]

        def forward(v: Array) -> Array:
            v = v if by_p is None else by_p @ v
            forces = (sum(f * v[of, None, None] for f, (_, of) in zip(f_case, q_p, strict=True)) for f_case in f_q)
            return np.concatenate(
                [solid.bc.assemble(np.asarray(f), self.nodes, case)[0] for case, f in enumerate(forces)]
            )

        def reverse(lam: Array) -> Array:
            total = np.zeros(len(p))
            for case, f_case in enumerate(f_q):
                lam_e = solid.bc.displacements(lam, 0.0, case, self.nodes, np)
                for f, (_, of) in zip(f_case, q_p, strict=True):
                    total = total + accumulate(of, (f * lam_e).sum(axis=(1, 2)), len(p))
            return total if by_p is None else np.asarray(by_p.T @ total)

        return ByProducts(forward, reverse)

    @property
    def _cases(self) -> range:
        return range(len(self.solid.directions))

    def _by_constants(self, u_e: Array, s: Setup, q_p: list[tuple[Array, Array]]) -> list[Array]:
        """Forces (n_e, n_a, 3) of a cell per unit of the parameter on which each of its constants depends."""
        parts = []
        with np.errstate(all="ignore"):
            for cells in in_chunks(*self.solid.metric(s, np)):
                P_q = self.material.P_q(cells.gradients(u_e), cells.at_points(s.q))
                parts.append(
                    [cells.forces(P) * by_p[cells.which, None, None] for P, (by_p, _) in zip(P_q, q_p, strict=True)]
                )
        return [np.concatenate(f) for f in zip(*parts, strict=True)]
