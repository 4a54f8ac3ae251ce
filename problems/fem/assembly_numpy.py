"""Residual, tangent and R_p of a solid from hand-derived P, A and dP/dq in NumPy, without JAX."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.problem import Array

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid


class NumpyAssembly:
    """Assembly for derivatives=hand: f_int = sum over points of P dN dx."""

    def __init__(self, solid: LoadedSolid) -> None:
        assert solid.law.numpy is not None, "Block refuses laws without NumPy derivatives"
        self.solid, self.material = solid, solid.law.numpy
        self.nodes = solid.mesh.geometry.nodes

    def residual(self, u: Array, p: Array) -> Array:
        """f_int - f_ext, (n_u,)."""
        solid = self.solid
        s = solid.setup(p)
        dN, dx = solid.metric(s, np)
        parts = []
        for case in range(len(solid.directions)):
            H = self._H(solid.displacements(u, s, case, self.nodes), dN)
            f_e = _element_forces(self.material.P(H, _per_point(s.q, H)), dN, dx)
            f, _ = solid.bc.assemble(f_e, self.nodes, case)
            external = solid.external_forces(u, s, case)
            parts.append(f if external is None else f - solid.bc.assemble(external, solid.loaded.nodes, case)[0])
        return np.concatenate(parts)

    def element_tangents(self, u_e: Array, q: Any, dN: Array, dx: Array, selected: Array) -> Array:
        """Entries `pick` of the element matrices: see Solid.tangents."""
        from gradient_routes.problems.fem.assembly_jax import element_matrices

        H = self._H(u_e, dN)
        A = self.material.A(H, _per_point(q, H)) * dx[..., None, None, None, None]
        return element_matrices(A.swapaxes(2, 3), dN, selected)

    def R_p(self, u: Array, p: Array) -> Any:
        """R_p (n_u, n_p), sparse: each material constant of a cell depends on one parameter."""
        from scipy.sparse import coo_array

        solid, derivative = self.solid, self.solid.design.q_p
        assert derivative is not None, "Block refuses p that is not a material"
        s = solid.setup(p)
        dN, dx = solid.metric(s, np)
        rows, columns, entries = [], [], []
        for case in range(len(solid.directions)):
            H = self._H(solid.displacements(u, s, case, self.nodes), dN)
            dofs = solid.bc.dofs(self.nodes, case)
            free = dofs >= 0
            for P_q, (q_p, column) in zip(self.material.P_q(H, _per_point(s.q, H)), derivative(p), strict=True):
                f_e = _element_forces(P_q, dN, dx).reshape(dofs.shape) * q_p[:, None]
                rows.append(case * solid.bc.n_free + dofs[free])
                columns.append(np.broadcast_to(column[:, None], dofs.shape)[free])
                entries.append(f_e[free])
        ijv = (np.concatenate(part) for part in (entries, rows, columns))
        data, i, j = ijv
        return coo_array((data, (i, j)), shape=(solid.bc.n_u, len(p))).tocsr()

    @staticmethod
    def _H(u_e: Array, dN: Array) -> Array:
        return np.asarray(np.swapaxes(u_e, 1, 2)[:, None] @ dN)


def _element_forces(P: Array, dN: Array, dx: Array) -> Array:
    """Sum over points of P_iJ dN_a,J dx, (n_e, n_a, d)."""
    n, n_q, n_a, m = dN.shape
    P_dx = (P * dx[..., None, None]).transpose(0, 1, 3, 2).reshape(len(P), n_q * m, -1)
    return np.asarray(dN.transpose(0, 2, 1, 3).reshape(n, n_a, n_q * m) @ P_dx)


def _per_point(q: Any, H: Array) -> tuple[Array, ...]:
    """Constants (n_e, 1), to broadcast over the points of a cell."""
    return tuple(np.broadcast_to(c, len(H))[:, None] for c in q)
