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
            if solid.springs is not None:
                f = f + self._of_springs(solid.displacements(u, s, case, solid.springs.facets.nodes), s.k, case)
            external = solid.external_forces(u, s, case)
            parts.append(f if external is None else f - solid.bc.assemble(external, solid.loaded.nodes, case)[0])
        return np.concatenate(parts)

    def R_u(self, u: Array, p: Array) -> ByProducts:
        """R_u by its products, of loads that do not follow u: it is symmetric."""
        s = self.solid.setup(p)

        def product(v: Array) -> Array:
            parts = []
            for case in range(len(self.solid.directions)):
                v_e = self.solid.bc.variations(v, case, self.nodes)

                def dP(cells: Cells, u_e: Array, q: Any, v_e: Array = v_e) -> Array:
                    return self.material.dP(cells.gradients(u_e), cells.gradients(v_e), q)

                part, springs = self._internal(u, s, case, dP), self.solid.springs
                if springs is not None:
                    part = part + self._of_springs(self.solid.bc.variations(v, case, springs.facets.nodes), s.k, case)
                parts.append(part)
            return np.concatenate(parts)

        return ByProducts(product, product)

    def _of_springs(self, u_f: Array, k: Any, case: int) -> Array:
        """Nodal forces (n_free,) of springs at the displacements u_f of their facets' cells."""
        springs = self.solid.springs
        assert springs is not None
        return self.solid.bc.assemble(springs.forces(u_f, k), springs.facets.nodes, case)[0]

    def _internal(self, u: Array, s: Setup, case: int, stress: Callable[[Cells, Array, Any], Array]) -> Array:
        """Nodal forces (n_free,) of a stress (3, 3, m) at the points of some cells."""
        return self.solid.bc.assemble(self._of_cells(u, s, case, stress), self.nodes, case)[0]

    def _of_cells(self, u: Array, s: Setup, case: int, stress: Callable[[Cells, Array, Any], Array]) -> Array:
        """Forces (n_e, n_a, 3) of the cells."""
        u_e = self.solid.displacements(u, s, case, self.nodes)
        with np.errstate(all="ignore"):  # NaN and infinity are results here, as in JAX
            parts = [
                cells.forces(stress(cells, u_e, cells.at_points(s.q))) for cells in in_chunks(*self.solid.metric(s, np))
            ]
        return np.concatenate(parts)

    def reaction(self, u: Array, p: Array, case: int, e: Array) -> Any:
        """Work of the stresses along displacements e (n_nodes, d)."""
        f = self._of_cells(u, self.solid.setup(p), case, lambda cells, u_e, q: self.material.P(cells.gradients(u_e), q))
        return (f * e[self.nodes]).sum()

    def reaction_by_u(self, u: Array, p: Array, case: int, e: Array) -> Array:
        """Its derivative (n_u,)."""

        def dP(cells: Cells, u_e: Array, q: Any) -> Array:
            return self.material.dP(cells.gradients(u_e), cells.gradients(e[self.nodes]), q)

        by_u, n = np.zeros(self.solid.bc.n_u), self.solid.bc.n_free
        by_u[case * n : (case + 1) * n] = self._internal(u, self.solid.setup(p), case, dP)
        return by_u

    def reaction_by_p(self, u: Array, p: Array, case: int, e: Array) -> Array:
        """Its derivative (n_p,)."""
        s, q_p, chain = self.solid.setup(p), self._q_p(p), self.solid.design.chain
        f_q = self._by_constants(self.solid.displacements(u, s, case, self.nodes), s, q_p)
        by_q = self._along(e[self.nodes], f_q, q_p, len(p))
        return by_q if chain is None else np.asarray(chain(p).T @ by_q)

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
        solid = self.solid
        s, q_p = solid.setup(p), self._q_p(p)
        by_p = None if solid.design.chain is None else solid.design.chain(p)
        f_q = [self._by_constants(solid.displacements(u, s, case, self.nodes), s, q_p) for case in self._cases]
        f_k = np.concatenate([self._by_springs(u, s, p, case) for case in self._cases])  # of p's last components
        n = len(p) - f_k.shape[1]

        def forward(v: Array) -> Array:
            v_k, v = v[n:], v if by_p is None else by_p @ v
            forces = (sum(f * v[of, None, None] for f, (_, of) in zip(f_case, q_p, strict=True)) for f_case in f_q)
            parts = [solid.bc.assemble(np.asarray(f), self.nodes, case)[0] for case, f in enumerate(forces)]
            return np.asarray(np.concatenate(parts) + f_k @ v_k)

        def reverse(lam: Array) -> Array:
            total = np.zeros(len(p))
            for case, f_case in enumerate(f_q):
                total = total + self._along(solid.bc.variations(lam, case, self.nodes), f_case, q_p, len(p))
            total = total if by_p is None else by_p.T @ total
            total[n:] += lam @ f_k
            return total

        return ByProducts(forward, reverse)

    def _by_springs(self, u: Array, s: Setup, p: Array, case: int) -> Array:
        """Nodal forces (n_free, k) of the springs per unit of each of the last k of p, none without springs."""
        springs, bc = self.solid.springs, self.solid.bc
        if springs is None:
            return np.zeros((bc.n_free, 0))
        nodes = springs.facets.nodes
        each = springs.each(self.solid.displacements(u, s, case, nodes))
        return np.asarray(np.stack([bc.assemble(f, nodes, case)[0] for f in each], axis=1) * springs.k_p(p))

    def _q_p(self, p: Array) -> list[tuple[Array, Array]]:
        derivative = self.solid.design.q_p
        assert derivative is not None, "Block refuses p that is not a material"
        return derivative(p)

    @staticmethod
    def _along(v_e: Array, f_q: list[Array], q_p: list[tuple[Array, Array]], n_p: int) -> Array:
        """Work (n_p,) of the forces f_q along displacements v_e (n_e, n_a, d)."""
        parts = zip(f_q, q_p, strict=True)
        return np.asarray(sum(accumulate(of, (f * v_e).sum(axis=(1, 2)), n_p) for f, (_, of) in parts))

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
