"""A solid's residual, tangent and R_p from hand-derived P, A and dP/dq, in NumPy: JAX takes no part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.problem import Array

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.loaded_solid import Mechanics


class HandSolid:
    """What `derivatives=hand` computes with; f_int = sum over points of P dN dx."""

    def __init__(self, mechanics: Mechanics) -> None:
        assert mechanics.law.hand is not None, "the block refuses laws without"
        self.mechanics, self.hand = mechanics, mechanics.law.hand
        self.nodes = mechanics.body.geometry.nodes

    def residual(self, u: Array, p: Array) -> Array:
        """f_int - f_ext, (n_u,)."""
        m = self.mechanics
        s = m.setting(p)
        dN, dx = m.metric(s, np)
        parts = []
        for case in range(len(m.directions)):
            F = self._F(m.displacements(u, s, case, self.nodes), dN)
            f_e = _forces(self.hand.P(F, _per_point(s.q, F)), dN, dx)
            f, _ = m.supports.gather(f_e, self.nodes, case)
            external = m.external_forces(u, s, case)
            parts.append(f if external is None else f - m.supports.gather(external, m.loaded.nodes, case)[0])
        return np.concatenate(parts)

    def tangents(self, u_e: Array, q: Any, dN: Array, dx: Array, pick: Array) -> Array:
        """Entries `pick` of the element matrices: see Solid.tangents."""
        from gradient_routes.problems.fem.assembly_jax import contract

        F = self._F(u_e, dN)
        A = self.hand.A(F, _per_point(q, F)) * dx[..., None, None, None, None]
        return contract(A.swapaxes(2, 3), dN, pick)

    def by_p(self, u: Array, p: Array) -> Any:
        """R_p (n_u, n_p), a sparse matrix: every cell depends on one parameter through each constant."""
        from scipy.sparse import coo_array

        m, derivative = self.mechanics, self.mechanics.unknown.q_p
        assert derivative is not None, "the block refuses other unknowns"
        s = m.setting(p)
        dN, dx = m.metric(s, np)
        rows, columns, entries = [], [], []
        for case in range(len(m.directions)):
            F = self._F(m.displacements(u, s, case, self.nodes), dN)
            unknowns = m.supports.unknowns(self.nodes, case)
            free = unknowns >= 0
            for P_q, (q_p, column) in zip(self.hand.P_q(F, _per_point(s.q, F)), derivative(p), strict=True):
                f_e = _forces(P_q, dN, dx).reshape(unknowns.shape) * q_p[:, None]
                rows.append(case * m.supports.n_free + unknowns[free])
                columns.append(np.broadcast_to(column[:, None], unknowns.shape)[free])
                entries.append(f_e[free])
        ijv = (np.concatenate(part) for part in (entries, rows, columns))
        data, i, j = ijv
        return coo_array((data, (i, j)), shape=(m.supports.n_u, len(p))).tocsr()

    @staticmethod
    def _F(u_e: Array, dN: Array) -> Array:
        return np.asarray(np.swapaxes(u_e, 1, 2)[:, None] @ dN + np.eye(3))


def _forces(P: Array, dN: Array, dx: Array) -> Array:
    """Sum over points of P_iJ dN_a,J dx, (n_e, n_a, 3)."""
    _, n_q, n_a, _ = dN.shape
    P_dx = (P * dx[..., None, None]).transpose(0, 1, 3, 2).reshape(len(P), n_q * 3, 3)
    return np.asarray(dN.transpose(0, 2, 1, 3).reshape(-1, n_a, n_q * 3) @ P_dx)


def _per_point(q: Any, F: Array) -> tuple[Array, ...]:
    """Constants (n_e, 1): they broadcast over a cell's points."""
    return tuple(np.broadcast_to(c, len(F))[:, None] for c in q)
