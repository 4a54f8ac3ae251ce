"""The block's residual, tangent and R_p from hand-derived P, A and dP/dq, in NumPy: JAX takes no part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from problems.problem import Array

if TYPE_CHECKING:
    from problems.block import Block


class HandSolid:
    """What `derivatives=hand` computes with; f_int = sum over points of P dN dx."""

    def __init__(self, block: Block) -> None:
        assert block.law.hand is not None, "the block refuses laws without"
        self.block, self.hand = block, block.law.hand
        self.nodes = block.body.geometry.nodes

    def residual(self, u: Array, p: Array) -> Array:
        """f_int - f_ext, (n_u,)."""
        block = self.block
        s = block.setting(p)
        dN, dx = block.metric(s, np)
        parts = []
        for case in range(len(block.directions)):
            F = self._F(block.displacements(u, s, case, self.nodes), dN)
            f_e = _forces(self.hand.P(F, _per_point(s.q, F)), dN, dx)
            f, _ = block.supports.gather(f_e, self.nodes, case)
            if block.load_kind == "traction":
                f = f - block.supports.gather(block.dead_forces(s, case, np), block.loaded.nodes, case)[0]
            elif block.load_kind == "follower":
                u_f = block.displacements(u, s, case, block.loaded.nodes)
                f = f - block.supports.gather(block.follower_forces(u_f, s, case, np), block.loaded.nodes, case)[0]
            parts.append(f)
        return np.concatenate(parts)

    def tangents(self, u_e: Array, q: Any, dN: Array, dx: Array, pick: Array) -> Array:
        """Entries `pick` of the element matrices: see Solid.tangents."""
        from problems.solid import contract

        F = self._F(u_e, dN)
        A = self.hand.A(F, _per_point(q, F)) * dx[..., None, None, None, None]
        return contract(A.swapaxes(2, 3), dN, pick)

    def by_p(self, u: Array, p: Array) -> Any:
        """R_p (n_u, n_p), a sparse matrix: every cell depends on one parameter through each constant."""
        from scipy.sparse import coo_array

        block, assert_q_p = self.block, self.block.unknown.q_p
        assert assert_q_p is not None, "the block refuses other unknowns"
        s = block.setting(p)
        dN, dx = block.metric(s, np)
        rows, columns, entries = [], [], []
        for case in range(len(block.directions)):
            F = self._F(block.displacements(u, s, case, self.nodes), dN)
            unknowns = block.supports.unknowns(self.nodes, case)
            free = unknowns >= 0
            for P_q, (q_p, column) in zip(self.hand.P_q(F, _per_point(s.q, F)), assert_q_p(p), strict=True):
                f_e = _forces(P_q, dN, dx).reshape(unknowns.shape) * q_p[:, None]
                rows.append(case * block.supports.n_free + unknowns[free])
                columns.append(np.broadcast_to(column[:, None], unknowns.shape)[free])
                entries.append(f_e[free])
        ijv = (np.concatenate(part) for part in (entries, rows, columns))
        data, i, j = ijv
        return coo_array((data, (i, j)), shape=(block.n_state, len(p))).tocsr()

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
